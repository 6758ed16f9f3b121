"""A folder of submissions: files, and folders of several files of which one is the child script."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from drone_sim.grading.jobs.files import is_child_script
from drone_sim.message_text import shown

_ENDINGS = (".py", ".lua")
_MOST = 1000
_HIDDEN = (".", "__MACOSX")


def scripts_of(given: str) -> list[str]:
    """Return the scripts that an argument names: itself, or those of a folder, by name.

    In a folder each child script (a file with a sysCall_ function) is one, and each folder in it is, with the only
    child script that it has, however deep. Raises ValueError for a folder without any, and for one of whose scripts
    nobody can tell which is meant.
    """
    if not os.path.isdir(given) or given.endswith(_ENDINGS):
        return [given]
    found: list[str] = []
    for entry in sorted(Path(given).iterdir()):
        if entry.name.startswith(_HIDDEN):
            continue
        if entry.is_dir() and entry.suffix not in _ENDINGS:
            found += _only_one(entry)
        elif entry.suffix in _ENDINGS and (entry.is_symlink() or not entry.is_file() or is_child_script(entry)):
            found.append(str(entry))  # what cannot be read is said in its own flights
    if not found:
        raise ValueError(f"{shown(given)}: no submission is in this folder: no file with a sysCall_ function")
    if len(found) > _MOST:
        raise ValueError(f"{shown(given)}: holds {len(found)} submissions; {_MOST} can be graded at once")
    return found


def _only_one(folder: Path) -> Iterator[str]:
    scripts = [one for one in _files(folder) if is_child_script(one)]
    if len(scripts) > 1:
        names = ", ".join(str(one.relative_to(folder)) for one in scripts[:4])
        raise ValueError(f"{shown(str(folder))}: holds {len(scripts)} child scripts ({names}); one is to be graded")
    yield from map(str, scripts)


def _files(folder: Path) -> list[Path]:
    """Return a folder's files that may be scripts, and those of its folders, without links."""
    found: list[Path] = []
    for here, folders, names in os.walk(folder):
        folders[:] = sorted(one for one in folders if not one.startswith(_HIDDEN))
        paths = (Path(here, name) for name in sorted(names))
        found += [one for one in paths if one.suffix in _ENDINGS and one.is_file() and not one.is_symlink()]
    return found
