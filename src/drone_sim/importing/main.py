"""`rosrun drone_sim import_scene FILE.ttt|.ttm [OUT]`: a file of V-REP's as a scene that flies here."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from drone_sim.importing.scene_folder import LIST, Imported, import_file
from drone_sim.vrep_files.errors import VrepFileError
from drone_sim.vrep_files.reading import SUFFIXES

_FAILED, _SIGNALLED = 1, 128


def main(arguments: Sequence[str] | None = None) -> int:
    """Import; return 0, or 1 after a line on stderr for a file that cannot be read or written."""
    options = _parser().parse_args(arguments)
    try:
        _say(_import(Path(options.file), options.out, options.force))
        return 0
    except (VrepFileError, OSError) as error:
        print(f"import_scene: {' '.join(str(error).split())}", file=sys.stderr, flush=True)
        return _FAILED
    except KeyboardInterrupt:
        return _SIGNALLED + signal.SIGINT


def _import(path: Path, out: str | None, force: bool) -> Imported:
    if path.suffix.lower() not in SUFFIXES:
        raise VrepFileError(f"{path}: must end in {' or '.join(SUFFIXES)}")
    folder = path.with_suffix("") if out is None else Path(out)
    if folder.exists() and not folder.is_dir():
        raise VrepFileError(f"{folder}: is no folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise VrepFileError(f"{folder}: is not empty; name another folder after the file, or give --force")
    return import_file(path, folder)


def _say(imported: Imported) -> None:
    counts = {"object": imported.objects, "vehicle": imported.vehicles, "script": imported.scripts}
    said = ", ".join(f"{count} {word}" if count == 1 else f"{count} {word}s" for word, count in counts.items())
    print(f"{imported.scene}: {said}")
    for note in imported.report.notes:
        print(note)
    if imported.report:
        print(f"Not as it was in the file (all of it in {LIST}):")
        for line in imported.report.short():
            print(f"  {line}")
    print(f"roslaunch drone_sim drone.launch scene:={imported.scene}")


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """Give one line, as for every other mistake, instead of the usage."""
        self.exit(_FAILED, f"import_scene: {' '.join(message.split())} (see import_scene --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="import_scene", description="Make a scene of V-REP or CoppeliaSim one that flies here.")
    parser.add_argument("file", metavar="FILE.ttt", help="scene or model (.ttm), V-REP 3.0 to CoppeliaSim 4.9")
    parser.add_argument("out", metavar="OUT", nargs="?", help="folder to write (default: FILE without its ending)")
    parser.add_argument("--force", action="store_true", help="write into a folder that is not empty")
    return parser


if __name__ == "__main__":
    sys.exit(main())
