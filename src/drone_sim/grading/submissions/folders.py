"""The submissions that an argument of `grade` names: a script, or those in a folder, a zip, or a table."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from drone_sim.grading.jobs.files import Unreadable, is_child_script
from drone_sim.grading.submissions import archive, handed_in
from drone_sim.grading.submissions.archive import Refused
from drone_sim.grading.submissions.submission import (
    Submission,
    people_in,
    people_of,
    read_table,
    split_into_submissions,
)
from drone_sim.message_text import shown

_SCRIPT_SUFFIXES = (".py", ".lua")
_MAX_SUBMISSIONS = 1000
_IGNORED = (".", "__MACOSX", "__pycache__")  # prefixes of names
_NO_SCRIPT = "no child script (a file with a sysCall_ function)"


def submissions_of(argument: str, store: Path) -> list[Submission]:
    """Return the submissions that an argument names: a script itself, or all in a folder, a zip or a table of a class.

    In a folder, each child script (a file with a sysCall_ function) is a submission, and so is each folder or zip with
    exactly one child script at any depth. In a folder where scripts are handed in, only these are. Zips are unpacked
    below `store`. A submission's own faults are in its `error`. Raises OSError, and ValueError, in one line, if there
    is no submission, or too many.
    """
    path = Path(argument)
    if path.suffix.lower() == ".csv":
        submissions = [_resolve_script(submission, store) for submission in read_table(path)]
    elif path.suffix.lower() == ".zip":
        submissions = _in_class_zip(path, store)
    elif path.is_dir() and path.suffix not in _SCRIPT_SUFFIXES:
        submissions = handed_in.submissions_in(path, store)
        if not submissions and not handed_in.is_shared(path):
            submissions = _in_folder(path, store)
    else:
        return [Submission(argument)]
    if not submissions:
        raise ValueError(f"{shown(argument)}: no submission is in it: {_NO_SCRIPT}")
    if len(submissions) > _MAX_SUBMISSIONS:
        raise ValueError(
            f"{shown(argument)}: holds {len(submissions)} submissions; {_MAX_SUBMISSIONS} can be graded at once"
        )
    return submissions


def _in_class_zip(path: Path, store: Path) -> list[Submission]:
    try:
        folder, refused = archive.unpack(path, store, split_into_submissions)
    except Refused as error:
        raise ValueError(f"{shown(str(path))}: {error}") from None
    people = people_in(folder)
    refused_submissions = [
        Submission(str(folder / part if part else path), people.get(part, people_of(part)), reason)
        for part, reason in refused.items()
    ]
    return sorted([*_in_folder(folder, store), *refused_submissions], key=lambda submission: submission.script)


def _in_folder(folder: Path, store: Path) -> list[Submission]:
    people_by_name = people_in(folder)
    entries = [path for path in sorted(folder.iterdir()) if not path.name.startswith(_IGNORED)]
    files = [path for path in entries if path.suffix in _SCRIPT_SUFFIXES and _may_be_child_script(path)]
    submissions = []
    for entry in entries:
        people = people_by_name.get(entry.name, people_of(entry.name))
        if entry in files:
            submissions.append(Submission(str(entry), people))
        elif (entry.is_dir() and entry.suffix not in _SCRIPT_SUFFIXES) or entry.suffix.lower() == ".zip":
            leads_out = entry.is_symlink() and not Path(os.path.realpath(entry)).is_relative_to(folder.resolve())
            error = f"{shown(entry.name)}: is a link that leads out of its folder" if leads_out else ""
            submission = _resolve_script(Submission(str(entry), people, error), store)
            if not submission.error or people or not files:  # else it may be a folder of the scripts beside it
                submissions.append(submission)
    return submissions


def _may_be_child_script(path: Path) -> bool:
    """Return whether a file is a child script, or cannot be read: then the results of its flights have the error."""
    try:
        return path.is_symlink() or not path.is_file() or is_child_script(path)
    except Unreadable:
        return True


def _resolve_script(submission: Submission, store: Path) -> Submission:
    """Return a submission whose folder or zip is replaced by the only child script in it."""
    path = Path(submission.script)
    if submission.error:
        return submission
    try:
        if path.suffix.lower() == ".zip":
            path = archive.unpack_whole(path, store)
        if path.is_dir() and path.suffix not in _SCRIPT_SUFFIXES:
            return replace(submission, script=str(_only_script(path, store)))
        return submission
    except (Refused, Unreadable) as error:
        reason = str(error)
    except (PermissionError, RecursionError):
        reason = "holds a folder that cannot be read, or too many in each other"
    return replace(submission, error=f"{shown(path.name)}: {reason}")


def _only_script(folder: Path, store: Path) -> Path:
    """Return the only child script in a folder, or in the only zip in it. Raises Refused, Unreadable and OSError."""
    files = list(_files_below(folder))
    scripts = [path for path in files if path.suffix in _SCRIPT_SUFFIXES and is_child_script(path)]
    zips = [path for path in files if path.suffix.lower() == ".zip"]
    if not scripts and len(zips) == 1:
        folder = archive.unpack_whole(zips[0], store)
        scripts = [path for path in _files_below(folder) if path.suffix in _SCRIPT_SUFFIXES and is_child_script(path)]
    if len(scripts) == 1:
        return scripts[0]
    if not scripts:
        raise Refused(f"holds {_NO_SCRIPT}")
    names = ", ".join(str(script.relative_to(folder)) for script in scripts[:4])
    raise Refused(f"holds {len(scripts)} child scripts ({names}); there must be only one")


def _files_below(folder: Path) -> Iterator[Path]:
    """Yield the regular files in a folder and its subfolders, without links."""
    for current, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith(_IGNORED))
        paths = (Path(current, name) for name in sorted(names))
        yield from (path for path in paths if path.is_file() and not path.is_symlink())
