"""Zips of strangers: unpacked into a folder, within limits; a part that is refused gets one line that says why."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path, PurePosixPath

from drone_sim.files.resources import MEBIBYTE
from drone_sim.grading.jobs.files import LARGEST
from drone_sim.grading.submissions.submission import Refused
from drone_sim.message_text import shown

_MOST_FILES = 1000  # of a part
_MOST_MEMBERS = 200_000  # of a zip
_BLOCK = 2**20
_IGNORED = ("__MACOSX", ".DS_Store", "Thumbs.db")
_NAMES = (errno.ENAMETOOLONG, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EINVAL, errno.EILSEQ)
# What zipfile raises for a zip that is damaged, encrypted, or packed in a way that it does not know.
_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)
Parts = tuple[str, ...]
Arrange = Callable[[Sequence[Parts]], list[tuple[str, Parts]]]
_Member = tuple[zipfile.ZipInfo, Parts]


def unpack(path: Path, store: Path, arrange: Arrange) -> tuple[Path, dict[str, str]]:
    """Return a folder below `store` with what a zip holds, and why parts of it are left out, in a line each.

    `arrange` gives for the paths of all members the part that each belongs to, and its path in that part's folder.
    Raises Refused for a file that is no zip, and OSError.
    """
    folder = store / f"{path.stem:.40}-{_digest(path)}"
    store.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=store) as unfinished:
        try:
            with zipfile.ZipFile(path) as archive:
                refused = _laid(archive, Path(unfinished, "all"), arrange)
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


def _laid(archive: zipfile.ZipFile, folder: Path, arrange: Arrange) -> dict[str, str]:
    """Lay down what is in a zip, part by part; return why some are left out."""
    members = _members(archive)
    parts: dict[str, list[_Member]] = {}
    for (info, _), (part, inside) in zip(members, arrange([path for _, path in members])):
        parts.setdefault(part, []).append((info, inside))
    folder.mkdir()
    refused = {}
    for part, inside_part in parts.items():
        try:
            _lay(archive, inside_part, folder / part)
        except (*_BROKEN, OSError) as error:
            if isinstance(error, OSError) and error.errno not in _NAMES:
                raise  # such as a full disk: nobody's fault
            refused[part] = str(error) if isinstance(error, Refused) else f"cannot be unpacked: {_line(error)}"
            if part:
                shutil.rmtree(folder / part, ignore_errors=True)
    return refused


def _members(archive: zipfile.ZipFile) -> list[_Member]:
    infos = archive.infolist()
    if len(infos) > _MOST_MEMBERS:
        raise Refused(f"holds {len(infos)} files; {_MOST_MEMBERS} can be looked through")
    found = [(info, PurePosixPath(info.filename).parts) for info in infos if not info.is_dir()]
    return [(info, parts) for info, parts in found if parts and not {*parts} & {*_IGNORED}]


def _lay(archive: zipfile.ZipFile, members: Sequence[_Member], folder: Path) -> None:
    """Lay down a part. Raises Refused, OSError, and what is _BROKEN."""
    left = LARGEST
    for number, (info, parts) in enumerate(members):
        _check(info, parts, number)
        with archive.open(info) as file:
            content = file.read(left + 1)
        left -= len(content)
        if left < 0:
            raise Refused(f"holds more than {LARGEST // MEBIBYTE} MiB")
        path = folder.joinpath(*parts)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def _check(info: zipfile.ZipInfo, parts: Parts, number: int) -> None:
    """Raise Refused for a member that is none of a submission."""
    if number >= _MOST_FILES:
        raise Refused(f"holds more than {_MOST_FILES} files")
    if PurePosixPath(info.filename).is_absolute() or ".." in parts or "\\" in info.filename:
        raise Refused(f"holds a path that leads out of it: {shown(info.filename)}")
    if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG):
        raise Refused(f"holds something that is not a regular file: {shown(info.filename)}")


def _line(error: Exception) -> str:
    said = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return f"{' '.join(said.split()):.200}"
