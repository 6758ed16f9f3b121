"""What the simulators of a course tell its teachers, and what the teachers tell all students: files in one folder.

Only teachers can write to the folder $DRONE_SIM_CLASSROOM and to its folder `scenes`. Everybody can write to its folder
`reports`, which only teachers can list. Students can write whatever they like there, so only the owner of a file
counts.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import secrets
import stat
import time
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.files import writing
from drone_sim.grading.submissions.handed_in import name_of
from drone_sim.message_text import shown
from drone_sim.run import parameters

VARIABLE = "DRONE_SIM_CLASSROOM"
TEXTS = ("status", "script", "scene", "grades")  # of a report
_MESSAGE, _REPORTS, _SCENES = "to_all.json", "reports", "scenes"
_SCENE_NAME = re.compile(r"\w[\w -]{0,60}\.ya?ml")
_OUTDATED = 30.0  # s after which a simulator that reports nothing has ended
_MAX_TEXT = 200  # characters
_LARGEST = 1 << 18  # bytes
_MODE = 0o640  # the folder's group, the teachers, can read a report
_MESSAGE_MODE = 0o644


class Message(NamedTuple):
    """Words of a teacher to all students, about a task or none (''), and about a scene file or none."""

    time: str
    text: str
    task: str
    scene: str = ""


def folder() -> Path | None:
    """Return the folder of the course; None if there is none, or this user cannot report there."""
    found = Path(os.environ.get(VARIABLE) or os.devnull)
    return found if os.access(found / _REPORTS, os.W_OK | os.X_OK) else None


def report_path(room: Path) -> Path:
    """Return a new path for the reports of one simulator. Nobody else knows it, so nobody else can put a file there."""
    return room / _REPORTS / f"{secrets.token_hex(8)}.json"


def report(path: Path, texts: dict[str, str], picture: str) -> None:
    """Write how this user's simulator is; `texts` are those of TEXTS, `picture` a JPEG in Base64. Raises OSError."""
    content = {key: texts.get(key, "")[:_MAX_TEXT] for key in TEXTS} | {"picture": picture}
    temporary = path.with_suffix(".new")
    # At no time can other students read it.
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, _MODE)
    with open(descriptor, "w", encoding="utf-8") as file:
        json.dump(content, file)
    temporary.replace(path)


def reports(room: Path) -> dict[str, dict[str, str]]:
    """Return the latest report of each user whose simulator runs, by the owner of the files.

    Only one file of each user is read, however many there are.
    """
    latest: dict[int, tuple[float, Path]] = {}
    for path in (room / _REPORTS).glob("*.json"):
        try:
            status = path.lstat()
        except OSError:  # its owner has just removed it
            continue
        if time.time() - status.st_mtime < _OUTDATED and latest.get(status.st_uid, (0.0,))[0] < status.st_mtime:
            latest[status.st_uid] = status.st_mtime, path
    found = {}
    for owner, (_, path) in latest.items():
        with contextlib.suppress(OSError, ValueError, RecursionError):
            found[name_of(owner)] = _checked(_read(path, owner))
    return found


def tell_all(room: Path, text: str, task: str, scene: str = "") -> None:
    """Show all students a text and the buttons of a task and of a scene; nothing if all are ''. Raises OSError."""
    path = room / _MESSAGE
    if not text and not task and not scene:
        path.unlink(missing_ok=True)
        return
    message = Message(time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), text[:_MAX_TEXT], task, scene)
    writing.write(path, json.dumps(message._asdict()))
    path.chmod(_MESSAGE_MODE)


def message_to_all(room: Path) -> Message | None:
    """Return what the teachers tell all students; None if that is nothing."""
    try:
        content = {"scene": "", **_read(room / _MESSAGE)}
        return Message(*(_text(content[key]) for key in Message._fields))
    except (OSError, ValueError, LookupError, RecursionError):
        return None


def scenes_folder(room: Path) -> Path:
    """Return the folder of the scene files that the teachers have sent; it need not exist."""
    return room / _SCENES


def keep_scene(room: Path, name: str, content: bytes) -> None:
    """Write a scene file for all students. Raises OSError, and ValueError if the simulator would refuse the file."""
    if not _SCENE_NAME.fullmatch(name):
        raise ValueError(f"{shown(name)}: a scene's name has letters, digits, spaces, _ and -, and ends in .yaml")
    folder = scenes_folder(room)
    folder.mkdir(exist_ok=True)
    file = folder / f"{name}.new"  # beside the files that it may name
    try:
        file.write_bytes(content)
        check_scene(file)
        file.chmod(_MESSAGE_MODE)
        file.replace(folder / name)
    finally:
        file.unlink(missing_ok=True)


def check_scene(file: Path) -> None:
    """Read a scene file as the simulator does. Raises ParameterError, a ValueError."""
    parameters.load({"scene_file": str(file)})


def _read(path: Path, owner: int | None = None) -> dict[str, Any]:
    """Return the content of a file, of this owner if one is given. Raises OSError, ValueError and RecursionError."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with open(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1 or status.st_size > _LARGEST:
            raise ValueError("is no file of at most 256 KiB with one name")
        if owner not in (None, status.st_uid):
            raise ValueError("was replaced by another user's file")
        content = json.loads(file.read(_LARGEST))
    if not isinstance(content, dict):
        raise ValueError("must be a mapping")
    return content


def _checked(content: dict[str, Any]) -> dict[str, str]:
    picture = str(content.get("picture", ""))
    return {**{key: _text(content.get(key, "")) for key in TEXTS}, "picture": picture if _is_base64(picture) else ""}


def _text(value: Any) -> str:
    """Return a value as a short text that can be sent: JSON may contain half of a surrogate pair."""
    return str(value)[:_MAX_TEXT].encode("utf-8", "replace").decode()


def _is_base64(text: str) -> bool:
    return text.isascii() and text.replace("+", "").replace("/", "").rstrip("=").isalnum()
