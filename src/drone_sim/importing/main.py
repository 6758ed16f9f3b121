"""`rosrun drone_sim import_scene FILE.ttt|.ttm [OUT]`: convert a V-REP file into a scene."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drone_sim.command_line import Parser, status_of
from drone_sim.importing.scene_folder import LIST, Imported, import_file
from drone_sim.vrep_files.model import SUFFIXES, VrepFileError

_NAME = "import_scene"


def main(arguments: Sequence[str] | None = None) -> int:
    """Import a file; return 0, or 1 after an error line on stderr if a file cannot be read or written."""
    options = _parser().parse_args(arguments)
    return status_of(_NAME, lambda: _print_summary(_import(Path(options.file), options.out, options.force)))


def _import(path: Path, out: str | None, force: bool) -> Imported:
    if path.suffix.lower() not in SUFFIXES:
        raise VrepFileError(f"{path}: must end in {' or '.join(SUFFIXES)}")
    folder = path.with_suffix("") if out is None else Path(out)
    if folder.exists() and not folder.is_dir():
        raise VrepFileError(f"{folder}: is not a folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise VrepFileError(f"{folder}: is not empty: give another folder as second argument, or --force")
    return import_file(path, folder)


def _print_summary(imported: Imported) -> None:
    counts = {"object": imported.objects, "vehicle": imported.vehicles, "script": imported.scripts}
    summary = ", ".join(f"{count} {word}" if count == 1 else f"{count} {word}s" for word, count in counts.items())
    print(f"{imported.scene}: {summary}")
    for note in imported.report.notes:
        print(note)
    if imported.report:
        print(f"What differs from the file (the whole list is in {LIST}):")
        for line in imported.report.lines(most=8):
            print(f"  {line}")
    print(f"roslaunch drone_sim drone.launch scene:={imported.scene}")


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=_NAME, description="Convert a scene or model of V-REP or CoppeliaSim into files for drone_sim."
    )
    parser.add_argument("file", metavar="FILE.ttt", help="scene or model (.ttm), V-REP 3.0 to CoppeliaSim 4.9")
    parser.add_argument("out", metavar="OUT", nargs="?", help="folder to write (default: FILE without its ending)")
    parser.add_argument("--force", action="store_true", help="write into a folder that is not empty")
    return parser


if __name__ == "__main__":
    sys.exit(main())
