"""What the simulators of a course tell its teachers, and what the teachers tell all students: files in one folder.

Only teachers can write to the folder $DRONE_SIM_CLASSROOM. Everybody can write to its folder `reports`, which only
teachers can list. Students can write whatever they like there, so only the owner of a file counts.
"""

from __future__ import annotations

import json
import os
import pwd
import secrets
import stat
import time
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.files import writing

VARIABLE = "DRONE_SIM_CLASSROOM"
TEXTS = ("status", "script", "scene", "grades")  # of a report
_MESSAGE, _REPORTS = "to_all.json", "reports"
_OUTDATED = 30.0  # s after which a simulator that reports nothing has ended
_MAX_TEXT = 200  # characters
_LARGEST = 1 << 18  # bytes
_MODE = 0o640  # the folder's group, the teachers, can read a report
_MESSAGE_MODE = 0o644


class Message(NamedTuple):
    """Words of a teacher to all students, about a task or none ('')."""

    time: str
    text: str
    task: str


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
    """Return the latest report of each user whose simulator runs, by the owner of the files."""
    latest: dict[int, tuple[float, dict[str, Any]]] = {}
    for path in (room / _REPORTS).glob("*.json"):
        try:
            owner, changed, content = _read(path)
        except (OSError, ValueError, RecursionError):
            continue
        if time.time() - changed < _OUTDATED and latest.get(owner, (0.0,))[0] < changed:
            latest[owner] = changed, content
    return {_name_of(owner): _checked(content) for owner, (_, content) in latest.items()}


def tell_all(room: Path, text: str, task: str) -> None:
    """Show all students a text and the button of a task; nothing if both are ''. Raises OSError."""
    path = room / _MESSAGE
    if not text and not task:
        path.unlink(missing_ok=True)
        return
    message = Message(time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), text[:_MAX_TEXT], task)
    writing.write(path, json.dumps(message._asdict()))
    path.chmod(_MESSAGE_MODE)


def message_to_all(room: Path) -> Message | None:
    """Return what the teachers tell all students; None if that is nothing."""
    try:
        _, _, content = _read(room / _MESSAGE)
        return Message(*(str(content[key])[:_MAX_TEXT] for key in Message._fields))
    except (OSError, ValueError, LookupError, RecursionError):
        return None


def _read(path: Path) -> tuple[int, float, dict[str, Any]]:
    """Return owner, time of the last change and content of a file. Raises OSError, ValueError and RecursionError."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with open(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1 or status.st_size > _LARGEST:
            raise ValueError("is no file of at most 256 KiB with one name")
        content = json.loads(file.read(_LARGEST))
    if not isinstance(content, dict):
        raise ValueError("must be a mapping")
    return status.st_uid, status.st_mtime, content


def _checked(content: dict[str, Any]) -> dict[str, str]:
    picture = str(content.get("picture", ""))
    texts = {key: str(content.get(key, ""))[:_MAX_TEXT] for key in TEXTS}
    return {**texts, "picture": picture if _is_base64(picture) else ""}


def _name_of(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"user {uid}"


def _is_base64(text: str) -> bool:
    return text.isascii() and text.replace("+", "").replace("/", "").rstrip("=").isalnum()
