"""Unpacking of untrusted zips within limits; a refused part gets a line that says why."""

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
from drone_sim.grading.jobs.files import MAX_SIZE
from drone_sim.message_text import shown

_MAX_FILES = 1000  # in a part
_MAX_MEMBERS = 200_000  # in a zip
_MAX_DEPTH = 64  # of folders; Python can walk through some hundreds
_MIN_ROOM, _MAX_RATIO = 2**30, 20  # a zip may unpack to the larger of so many bytes and so many times its own size
_BLOCK = 2**20
_IGNORED = ("__MACOSX", ".DS_Store", "Thumbs.db")
_LEADING_OUT = ("..", "/", "//")  # pieces of a path that lead out of a folder
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # zipfile decompresses the others without a limit of memory
_BAD_NAME_ERRORS = (errno.ENAMETOOLONG, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EINVAL, errno.EILSEQ)
# Errors of zipfile for a zip that is damaged, encrypted, or compressed by an unknown method.
_ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)
Parts = tuple[str, ...]
Arrange = Callable[[Sequence[Parts]], list[tuple[str, Parts]]]
_Member = tuple[zipfile.ZipInfo, Parts]


class Refused(ValueError):
    """A submission cannot be graded; one line says why. Other submissions can."""


def unpack(path: Path, store: Path, arrange: Arrange) -> tuple[Path, dict[str, str]]:
    """Return a folder below `store` with the content of a zip, and a line for each refused part.

    `arrange` returns for the path of each member the part that it belongs to, and its path in that part's folder, ()
    for a part that is a file. The refused part '' stands for members that belong to no part. Raises OSError, and
    Refused for a file that is no zip.
    """
    if not path.is_file():
        raise Refused("is not a regular file")
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    folder = store / f"{path.stem:.40}-{digest.hexdigest()[:12]}"
    store.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=store) as unfinished:
        room = max(_MIN_ROOM, _MAX_RATIO * path.stat().st_size)
        try:
            with zipfile.ZipFile(path) as archive:
                refused = _unpack_parts(archive, Path(unfinished, "all"), arrange, room)
        except _ZIP_ERRORS as error:
            raise Refused(f"is not a zip that can be read: {_error_text(error)}") from None
        if not folder.exists():  # another run may use the same zip
            os.rename(Path(unfinished, "all"), folder)
    return folder, refused


def unpack_whole(path: Path, store: Path) -> Path:
    """Return a folder with the content of a zip. Raises Refused, also if a part is refused."""
    folder, refused = unpack(path, store, lambda paths: [("", path_in_zip) for path_in_zip in paths])
    for reason in refused.values():
        raise Refused(reason)
    return folder


def _unpack_parts(archive: zipfile.ZipFile, folder: Path, arrange: Arrange, room: int) -> dict[str, str]:
    """Unpack a zip part by part, `room` bytes at most, and return the reasons of the refused parts.

    All names are checked before the first file is written. The smallest parts come first, so that a huge part leaves
    room for the others.
    """
    parts, refused = _checked_parts(archive, arrange)
    folder.mkdir()
    for part, members in sorted(parts.items(), key=lambda item: _size(item[1])):
        try:
            if len(members) > _MAX_FILES:
                raise Refused(f"holds more than {_MAX_FILES} files")
            if _size(members) > MAX_SIZE:
                raise Refused(f"holds more than {MAX_SIZE // MEBIBYTE} MiB")
            if _size(members) > room:
                raise Refused(f"is {_size(members) // MEBIBYTE} MiB, more than is left of the limit for one zip")
            for info, inside in members:
                member = path_below(folder, part, *inside)
                member.parent.mkdir(parents=True, exist_ok=True)
                with archive.open(info) as file, open(member, "xb") as output:  # an error for a second file of a name
                    output.write(file.read(info.file_size + 1))
            room -= _size(members)
        except (*_ZIP_ERRORS, OSError) as error:
            if isinstance(error, OSError) and error.errno not in _BAD_NAME_ERRORS:
                raise  # not the zip's fault, such as a full disk
            refused[part] = str(error) if isinstance(error, Refused) else f"cannot be unpacked: {_error_text(error)}"
            if part:
                remove(folder / part, within=folder)
    return refused


def _checked_parts(archive: zipfile.ZipFile, arrange: Arrange) -> tuple[dict[str, list[_Member]], dict[str, str]]:
    """Return the members of every part with allowed names and kinds, and the reasons of the refused parts.

    A member whose path leads out belongs to the part that its path names before that, or to '' if there is none.
    """
    refused: dict[str, str] = {}
    members: list[tuple[zipfile.ZipInfo, Parts, str]] = []
    infos = archive.infolist()
    if len(infos) > _MAX_MEMBERS:
        raise Refused(f"holds {len(infos)} files; at most {_MAX_MEMBERS} are allowed")
    for info in infos:
        path = PurePosixPath(info.filename).parts
        if info.filename.endswith("/") or not path or {*path} & {*_IGNORED}:
            continue
        inside, fault = tuple(takewhile(lambda piece: piece not in _LEADING_OUT, path)), _fault(info, path)
        if inside:
            members.append((info, inside if inside == path else (*inside, "_"), fault))
        else:
            refused.setdefault("", fault)
    parts: dict[str, list[_Member]] = {}
    for (info, _, fault), (part, inside) in zip(members, arrange([path for _, path, _ in members])):
        parts.setdefault(part, []).append((info, inside))
        if fault:
            refused.setdefault(part, fault)
    return {part: some for part, some in parts.items() if part not in refused}, refused


def _fault(info: zipfile.ZipInfo, path: Parts) -> str:
    """Return the reason why a member is not allowed, '' if it is."""
    name = shown(info.orig_filename)  # with the characters after a NUL, where zipfile ends a name
    if {*path} & {*_LEADING_OUT} or "\\" in info.filename or "\0" in info.orig_filename:
        return f"holds a path that leads out of it: {name}"
    if len(path) > _MAX_DEPTH:
        return f"holds a path of more than {_MAX_DEPTH} folders: {name}"
    if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG):
        return f"holds something that is not a regular file: {name}"
    if info.compress_type not in _METHODS:
        return f"holds a file that is neither stored nor deflated, the usual methods of a zip: {name}"
    return ""


def _size(members: Sequence[_Member]) -> int:
    """Return the largest size of a part in bytes: zipfile reads no more of a file than its declared size."""
    return sum(info.file_size for info, _ in members)


def _error_text(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return f"{' '.join(text.split()):.200}"
