"""What an argument of `grade` names: a script, or the submissions in a folder, a zip, or a table of names and paths."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from drone_sim.grading.jobs.files import Unreadable, is_child_script
from drone_sim.grading.submissions import archive, exports
from drone_sim.grading.submissions.roster import listed
from drone_sim.grading.submissions.submission import Refused, Submission
from drone_sim.message_text import shown

_ENDINGS = (".py", ".lua")
_MOST = 1000
_HIDDEN = (".", "__MACOSX", "__pycache__")
_WHAT = "no child script (a file with a sysCall_ function)"


def submissions_of(given: str, store: Path) -> list[Submission]:
    """Return what an argument names: a script itself; of a folder, a zip or a table of a class every submission.

    In a folder each child script (a file with a sysCall_ function) is one, and each folder or zip in it is, with the
    only child script that it has, however deep. Zips are laid out below `store`. What is wrong with a submission is
    its `error`. Raises ValueError, in one line, for a folder, a zip or a table without any, and OSError.
    """
    path = Path(given)
    if path.suffix.lower() == ".csv":
        found = [_looked_up(one, store) for one in listed(path)]
    elif path.suffix.lower() == ".zip":
        found = _of_zip(path, store)
    elif path.is_dir() and path.suffix not in _ENDINGS:
        found = _of_folder(path, store)
    else:
        return [Submission(given)]
    if not found:
        raise ValueError(f"{shown(given)}: no submission is in it: {_WHAT}")
    if len(found) > _MOST:
        raise ValueError(f"{shown(given)}: holds {len(found)} submissions; {_MOST} can be graded at once")
    return found


def _of_zip(path: Path, store: Path) -> list[Submission]:
    try:
        folder, refused = archive.unpack(path, store, exports.arranged)
    except Refused as error:
        raise ValueError(f"{shown(str(path))}: {error}") from None
    people = exports.people_in(folder)
    left_out = [
        Submission(str(folder / part if part else path), people.get(part, _people(part)), why)
        for part, why in refused.items()
    ]
    return sorted([*_of_folder(folder, store), *left_out], key=lambda one: one.script)


def _of_folder(folder: Path, store: Path) -> list[Submission]:
    people = exports.people_in(folder)
    entries = [one for one in sorted(folder.iterdir()) if not one.name.startswith(_HIDDEN)]
    files = [one for one in entries if one.suffix in _ENDINGS and _may_fly(one)]
    found = []
    for entry in entries:
        whose = people.get(entry.name, _people(entry.name))
        if entry in files:
            found.append(Submission(str(entry), whose))
        elif (entry.is_dir() and entry.suffix not in _ENDINGS) or entry.suffix.lower() == ".zip":
            leads_out = entry.is_symlink() and not Path(os.path.realpath(entry)).is_relative_to(folder.resolve())
            error = f"{shown(entry.name)}: is a link that leads out of its folder" if leads_out else ""
            one = _looked_up(Submission(str(entry), whose, error), store)
            if not one.error or whose or not files:  # beside scripts it may be a folder of theirs
                found.append(one)
    return found


def _people(name: str) -> tuple[exports.Person, ...]:
    person = exports.person_of(name)
    return () if person is None else (person,)


def _may_fly(path: Path) -> bool:
    """Return whether a file is a child script; a file that cannot be read counts as one, whose flights say so."""
    try:
        return path.is_symlink() or not path.is_file() or is_child_script(path)
    except Unreadable:
        return True


def _looked_up(one: Submission, store: Path) -> Submission:
    """Return a submission with the only child script of the folder or zip that it is."""
    path = Path(one.script)
    if one.error:
        return one
    try:
        if path.suffix.lower() == ".zip":
            path = archive.unpack_whole(path, store)
        if path.is_dir() and path.suffix not in _ENDINGS:
            return replace(one, script=str(_only_script(path, store)))
        return one
    except (Refused, Unreadable) as error:
        return replace(one, error=f"{shown(path.name)}: {error}")
    except (PermissionError, RecursionError):
        return replace(one, error=f"{shown(path.name)}: holds a folder that cannot be read, or too many in each other")


def _only_script(folder: Path, store: Path) -> Path:
    """Return the only child script in a folder, or in the only zip in it. Raises Refused, Unreadable and OSError."""
    files = list(_files(folder))
    scripts = [one for one in files if one.suffix in _ENDINGS and is_child_script(one)]
    zips = [one for one in files if one.suffix.lower() == ".zip"]
    if not scripts and len(zips) == 1:
        folder = archive.unpack_whole(zips[0], store)
        scripts = [one for one in _files(folder) if one.suffix in _ENDINGS and is_child_script(one)]
    if len(scripts) == 1:
        return scripts[0]
    if not scripts:
        raise Refused(f"holds {_WHAT}")
    names = ", ".join(str(one.relative_to(folder)) for one in scripts[:4])
    raise Refused(f"holds {len(scripts)} child scripts ({names}); one is to be graded")


def _files(folder: Path) -> Iterator[Path]:
    """Give a folder's files, and those of its folders, without links."""
    for here, folders, names in os.walk(folder):
        folders[:] = sorted(one for one in folders if not one.startswith(_HIDDEN))
        paths = (Path(here, name) for name in sorted(names))
        yield from (one for one in paths if one.is_file() and not one.is_symlink())
