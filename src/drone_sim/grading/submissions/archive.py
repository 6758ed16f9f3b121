"""Zips of strangers: unpacked into a folder, within limits; a part that is refused gets one line that says why."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from itertools import takewhile
from pathlib import Path, PurePosixPath

from drone_sim.files.containment import path_below, remove
from drone_sim.files.resources import MEBIBYTE
from drone_sim.grading.jobs.files import LARGEST
from drone_sim.grading.submissions.submission import Refused
from drone_sim.message_text import shown

_MOST_FILES = 1000  # of a part
_MOST_MEMBERS = 200_000  # of a zip
_DEEPEST = 64  # folders in each other; Python walks through some hundreds
_ROOM, _RATIO = 2**30, 20  # bytes that any zip may hold unpacked, and what a large one may hold for each of its own
_BLOCK = 2**20
_IGNORED = ("__MACOSX", ".DS_Store", "Thumbs.db")
_UP = ("..", "/", "//")  # pieces of a path that lead out of a folder
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # zipfile reads the others without a limit of memory
_NAMES = (errno.ENAMETOOLONG, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EINVAL, errno.EILSEQ)
# What zipfile raises for a zip that is damaged, encrypted, or packed in a way that it does not know.
_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)
Parts = tuple[str, ...]
Arrange = Callable[[Sequence[Parts]], list[tuple[str, Parts]]]
_Member = tuple[zipfile.ZipInfo, Parts]


def unpack(path: Path, store: Path, arrange: Arrange) -> tuple[Path, dict[str, str]]:
    """Return a folder below `store` with what a zip holds, and why parts of it are left out, in a line each.

    `arrange` gives for the paths of all members the part that each belongs to, and its path in that part's folder, ()
    for a part that is a file. The part '' in the answer stands for members that belong to no part. Raises Refused for
    a file that is no zip, and OSError.
    """
    if not path.is_file():
        raise Refused("is not a regular file")
    folder = store / f"{path.stem:.40}-{_digest(path)}"
    store.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=store) as unfinished:
        room = max(_ROOM, _RATIO * path.stat().st_size)
        try:
            with zipfile.ZipFile(path) as archive:
                refused = _laid(archive, Path(unfinished, "all"), arrange, room)
        except _BROKEN as error:
            raise Refused(f"is not a zip that can be read: {_line(error)}") from None
        if not folder.exists():  # another run of the same zip may fly what is there
            os.rename(Path(unfinished, "all"), folder)
    return folder, refused


def unpack_whole(path: Path, store: Path) -> Path:
    """Return a folder with what a zip holds. Raises Refused, also where anything in it cannot be had."""
    folder, refused = unpack(path, store, lambda paths: [("", one) for one in paths])
    for why in refused.values():
        raise Refused(why)
    return folder


def _digest(path: Path) -> str:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()[:12]


def _laid(archive: zipfile.ZipFile, folder: Path, arrange: Arrange, room: int) -> dict[str, str]:
    """Unpack a zip part by part, into `room` bytes at most; return why some parts are left out.

    All names are checked before the first file is written. The smallest parts come first, so that a part without end
    leaves room for the others.
    """
    parts, refused = _parts(archive, arrange)
    folder.mkdir()
    for part, members in sorted(parts.items(), key=lambda item: _size(item[1])):
        try:
            _check_amount(members, room)
            for info, inside in members:
                _write(archive, info, path_below(folder, part, *inside))
            room -= _size(members)
        except (*_BROKEN, OSError) as error:
            if isinstance(error, OSError) and error.errno not in _NAMES:
                raise  # such as a full disk: nobody's fault
            refused[part] = str(error) if isinstance(error, Refused) else f"cannot be unpacked: {_line(error)}"
            if part:
                remove(folder / part, within=folder)
    return refused


def _parts(archive: zipfile.ZipFile, arrange: Arrange) -> tuple[dict[str, list[_Member]], dict[str, str]]:
    """Return the members of every part whose names and kinds are allowed, and why the other parts are refused.

    A member whose path leads out belongs to the part that the path names before it does so, or, without one, to ''.
    """
    refused: dict[str, str] = {}
    named: list[tuple[zipfile.ZipInfo, Parts, str]] = []
    for info, path in _members(archive):
        inside, fault = tuple(takewhile(lambda piece: piece not in _UP, path)), _fault(info, path)
        if inside:
            named.append((info, inside if inside == path else (*inside, "_"), fault))
        else:
            refused.setdefault("", fault)
    parts: dict[str, list[_Member]] = {}
    for (info, _, fault), (part, inside) in zip(named, arrange([path for _, path, _ in named])):
        parts.setdefault(part, []).append((info, inside))
        if fault:
            refused.setdefault(part, fault)
    return {part: members for part, members in parts.items() if part not in refused}, refused


def _members(archive: zipfile.ZipFile) -> list[_Member]:
    infos = archive.infolist()
    if len(infos) > _MOST_MEMBERS:
        raise Refused(f"holds {len(infos)} files; {_MOST_MEMBERS} can be looked through")
    found = [(info, PurePosixPath(info.filename).parts) for info in infos if info.filename[-1:] != "/"]
    return [(info, parts) for info, parts in found if parts and not {*parts} & {*_IGNORED}]


def _fault(info: zipfile.ZipInfo, path: Parts) -> str:
    """Return why a member cannot be in a submission, '' for an allowed one."""
    name = shown(info.orig_filename)  # with what follows a NUL, at which zipfile cuts a name off
    if {*path} & {*_UP} or "\\" in info.filename or "\0" in info.orig_filename:
        return f"holds a path that leads out of it: {name}"
    if len(path) > _DEEPEST:
        return f"holds a path of more than {_DEEPEST} folders: {name}"
    if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG):
        return f"holds something that is not a regular file: {name}"
    if info.compress_type not in _METHODS:
        return f"holds a file that is neither stored nor deflated, the usual methods of a zip: {name}"
    return ""


def _size(members: Sequence[_Member]) -> int:
    """Return how many bytes a part can have at most: zipfile reads no more of a file than is declared."""
    return sum(info.file_size for info, _ in members)


def _check_amount(members: Sequence[_Member], room: int) -> None:
    """Raise Refused for a part that is too large."""
    if len(members) > _MOST_FILES:
        raise Refused(f"holds more than {_MOST_FILES} files")
    if _size(members) > LARGEST:
        raise Refused(f"holds more than {LARGEST // MEBIBYTE} MiB")
    if _size(members) > room:
        raise Refused(f"is {_size(members) // MEBIBYTE} MiB, more than is left of what is unpacked from one zip")


def _write(archive: zipfile.ZipFile, info: zipfile.ZipInfo, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with archive.open(info) as file, open(path, "xb") as laid:  # no second file of that name
        laid.write(file.read(info.file_size + 1))


def _line(error: Exception) -> str:
    said = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return f"{' '.join(said.split()):.200}"
