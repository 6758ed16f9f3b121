"""Scripts that students hand in from the cockpit, in a folder where everybody can write and only the teacher can read.

The folder of a task is below $DRONE_SIM_HAND_IN. Its files are named USER+TIME+DIGEST.py. Students can write whatever
they like there, so `grade` believes only who owns a file; the time in the name only decides which of a user's counts.
"""

from __future__ import annotations

import hashlib
import os
import pwd
import re
import stat
import time
from dataclasses import dataclass
from pathlib import Path

from drone_sim.files import writing
from drone_sim.grading.submissions.submission import Person, Submission
from drone_sim.message_text import shown

VARIABLE = "DRONE_SIM_HAND_IN"
_NAME = re.compile(r"(?P<user>\w[\w.@-]{0,63})\+(?P<time>[\dT.Z-]{20})\+(?P<digest>[0-9a-f]{12})(?P<suffix>\.py|\.lua)")
_LARGEST = 1 << 20  # bytes
_MODE = 0o640  # the folder's group, the teachers, can read it


@dataclass(frozen=True)
class _Entry:
    path: Path
    user: str  # by the file's name
    digest: str
    suffix: str
    owner: int
    age: tuple[str, int]  # the time in its name, and that of its last change (ns), which a copy of the folder loses


def folder_of(task: str) -> Path | None:
    """Return the folder for handing in a task; None if there is none that this user can write to."""
    folder = Path(os.environ.get(VARIABLE) or os.devnull, task)
    return folder if task and folder.is_dir() and os.access(folder, os.W_OK | os.X_OK) else None


def hand_in(task: str, text: str, suffix: str) -> tuple[str, str]:
    """Write a script into the task's folder; return time (UTC) and digest. Raises OSError, and ValueError."""
    folder = folder_of(task)
    if folder is None:
        raise ValueError(f"{task}: cannot be handed in now: {VARIABLE} has no folder {task} that you can write to")
    content = text.encode("utf-8")
    now, digest = time.strftime("%Y-%m-%dT%H.%M.%SZ", time.gmtime()), _digest(content)
    path = folder / f"{name_of(os.getuid())}+{now}+{digest}{suffix}"
    if not _NAME.fullmatch(path.name):
        raise ValueError(f"{shown(path.name)}: no such file can be handed in: user or suffix is not allowed")
    writing.write_new(path, content)
    path.chmod(_MODE)
    return now, digest


def is_shared(folder: Path) -> bool:
    """Return whether a folder has the sticky bit of those where students hand in: nothing else there is believed."""
    return bool(folder.stat().st_mode & stat.S_ISVTX)


def submissions_in(folder: Path, store: Path) -> list[Submission]:
    """Return each user's latest script in a folder where scripts are handed in; [] for any other folder.

    The scripts are copied to `store`, because their owners can replace them at any time. Other files are ignored.
    """
    copies = store / f"{folder.resolve().name:.40}-{_digest(os.fsencode(folder.resolve()))}"
    return sorted((_copy(entry, copies) for entry in _latest_in(folder)), key=lambda submission: submission.script)


def times_in(folder: Path) -> dict[str, str]:
    """Return when each user handed in last (UTC), by the name of the files' owner."""
    return {name_of(entry.owner): entry.age[0] for entry in _latest_in(folder)}


def _latest_in(folder: Path) -> list[_Entry]:
    latest: dict[tuple[int, str], _Entry] = {}
    for path in folder.iterdir():
        entry = _entry_of(path)
        if entry is None:
            continue
        # Copies of the teacher's own all have the same owner.
        key = entry.owner, entry.user if entry.owner == os.getuid() else ""
        if key not in latest or latest[key].age < entry.age:
            latest[key] = entry
    return list(latest.values())


def _entry_of(path: Path) -> _Entry | None:
    match = _NAME.fullmatch(path.name)
    try:
        status = path.lstat()
    except FileNotFoundError:  # its owner has just removed it
        return None
    if match is None or not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
        return None
    age = match["time"], status.st_ctime_ns
    return _Entry(path, match["user"], match["digest"], match["suffix"], status.st_uid, age)


def _copy(entry: _Entry, store: Path) -> Submission:
    owner = name_of(entry.owner)
    if entry.owner not in (os.getuid(), _uid_of(entry.user)):
        reason = f"belongs to {owner}, not to {entry.user}"
        return Submission(str(entry.path), (Person(owner),), f"{shown(entry.path.name)}: {reason}")
    people = (Person(entry.user),)
    try:
        content = _read(entry)
    except (OSError, ValueError) as error:
        return Submission(str(entry.path), people, f"{shown(entry.path.name)}: {error}")
    copy = store / entry.user / f"{entry.user}{entry.suffix}"  # alone: a script can import what is beside it
    copy.parent.mkdir(parents=True, exist_ok=True)
    with writing.replacing(copy, binary=True, through_links=False) as file:
        file.write(content)
    return Submission(str(copy), people)


def _read(entry: _Entry) -> bytes:
    """Return the content. Raises ValueError if it was replaced or changed after it was handed in, and OSError."""
    descriptor = os.open(entry.path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with open(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        content = file.read(_LARGEST + 1)
    if not stat.S_ISREG(status.st_mode) or status.st_uid != entry.owner or len(content) > _LARGEST:
        raise ValueError("is no file, or has more than 1 MiB")
    if _digest(content) != entry.digest:
        raise ValueError("does not match the digest in its name: it was changed after it was handed in")
    return content


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:12]


def name_of(uid: int) -> str:
    """Return the name of a system user, `user UID` if it has none."""
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"user {uid}"


def _uid_of(name: str) -> int:
    try:
        return pwd.getpwnam(name).pw_uid
    except KeyError:
        return -1
