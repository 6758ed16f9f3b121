"""The scripts that the editor may open: those of the package, to be copied, and those in a folder of the user's."""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drone_sim.files.resources import package_path
from drone_sim.grading import tasks
from drone_sim.ros.cockpit.scripts import script_files
from drone_sim.ros.cockpit.scripts.script_files import ShelfError
from drone_sim.scripting.python.helpers import BUILT_IN

OWN = "mine"
_ENDINGS = (".py", ".lua")
_LONGEST = 100  # characters of a name
_MOST = 1000  # scripts of one kind
_START = "start.py"  # what a task begins with
_LAST_STAGE = "6_ros.py"  # the tutorial's whole controller


@dataclass(frozen=True)
class Book:
    """A script: the name by which a browser asks for it, and its file."""

    name: str  # such as tutorial/1_thrust.py
    path: Path
    is_own: bool  # whether it may be written

    @property
    def group(self) -> str:
        """Which kind it is of: built-in, tutorial, tasks or mine."""
        return self.name.partition("/")[0]

    @property
    def file_name(self) -> str:
        """The name without its kind, such as 1_thrust.py."""
        return self.name.partition("/")[2]


class Shelf:
    """Scripts by name, such as `built-in/pilot.py` or `mine/first.lua`. Nothing else is read or written."""

    def __init__(self, folder: Path, shipped: Mapping[str, Callable[[], dict[str, Path]]] | None = None):
        """Take the user's folder, which the first copy makes, and files by name of each kind that is shipped."""
        self.folder = folder
        self._shipped = shipped_with_the_package() if shipped is None else shipped
        self._originals: dict[str, str] = {}  # of the user's own, as they were before the first change
        self._writing = threading.Lock()  # two browsers may save at once

    # ---- what there is

    def books(self) -> list[Book]:
        """Return all that there are now."""
        shipped = [
            Book(f"{kind}/{name}", path, False)
            for kind, files in self._shipped.items()
            for name, path in files().items()
        ]
        return [*shipped, *(self._own(name) for name in scripts_in(self.folder))]

    def find(self, name: Any) -> Book:
        """Return a script by its name. Raises ShelfError."""
        found = next((book for book in self.books() if book.name == name), None)
        if found is None:
            raise ShelfError(f"{str(name)[:80]!r}: no such script")
        self._place(found)
        return found

    def _place(self, book: Book) -> Path:
        """Return where a script is: a link in the folder may lead to another file there. Raises ShelfError."""
        if not book.is_own:
            return book.path
        try:
            place = Path(os.path.realpath(book.path))
        except ValueError as error:
            raise ShelfError(f"{book.name!r}: {error}") from None
        if place.parent != self.folder.resolve():
            raise ShelfError(f"{book.name}: is a link that leads out of {self.folder}, and is left alone")
        return place

    def of_file(self, path: str) -> Book | None:
        """Return the script whose file that is, None where it is none of these."""
        return next((book for book in self.books() if str(book.path) == path), None)

    def digest(self) -> str:
        """Return what changes whenever a script comes or goes."""
        names = "\n".join(book.name for book in self.books())
        return hashlib.sha1(names.encode("utf-8", "surrogatepass"), usedforsecurity=False).hexdigest()[:12]

    def version(self, name: Any) -> str:
        """Return the version of a script's file now, '' where it is gone."""
        found = next((book for book in self.books() if book.name == name), None)
        return script_files.version_of(found.path) if found else ""

    # ---- text

    def read(self, book: Book) -> tuple[str, str]:
        """Return a script's text, and its version, which changes when the file does. Raises ShelfError."""
        return script_files.read(book.name, book.path)

    def save(self, book: Book, text: str, version: str) -> tuple[Book, str] | None:
        """Write a script whose version the editor has; one of the package becomes a copy in the user's folder.

        Return what has been written, and its version; None where another has changed the file, and nothing was
        written. Raises ShelfError.
        """
        with self._writing:
            if not book.is_own:
                original, book = self.read(book)[0], self._copy_of(book)
                written = script_files.write(book.name, book.path, text, is_new=True)
                self._originals[book.name] = original
                return book, written
            if version != script_files.version_of(book.path):
                return None
            place = self._place(book)
            self._originals.setdefault(book.name, self.read(book)[0])
            return book, script_files.write(book.name, place, text)

    def save_as(self, name: Any, text: str) -> tuple[Book, str]:
        """Write a new script of the user's; return it, and its version. Raises ShelfError."""
        book = self._own(_checked(name))
        with self._writing:
            if os.path.lexists(book.path):
                raise ShelfError(f"{book.name}: is there already; take another name")
            version = script_files.write(book.name, book.path, text, is_new=True)
            self._originals[book.name] = text
            return book, version

    def keep_both(self, name: Any, text: str, mine: bool) -> tuple[Book, str, str]:
        """End a conflict about a script of the user's: `text`, or what the file holds, goes into another file.

        The file itself holds the `text` in the end where that is `mine`, or where there was no file. Return the script,
        its version, and the name of the other script, '' where there is none. Raises ShelfError.
        """
        file_name = str(name).removeprefix(f"{OWN}/")
        book = self._own(file_name if file_name in scripts_in(self.folder) else _checked(file_name))
        with self._writing:
            place = self._place(book)
            if not os.path.lexists(place):
                return book, script_files.write(book.name, place, text, is_new=True), ""
            second = self._copy_of(book)
            if mine:
                script_files.copy(book.name, place, second.path)
                return book, script_files.write(book.name, place, text), second.name
            script_files.write(second.name, second.path, text, is_new=True)
            return book, script_files.version_of(book.path), second.name

    def original(self, book: Book) -> str:
        """Return what a script was before the first change, to go back to. Raises ShelfError."""
        known = self._originals.get(book.name)
        return self.read(book)[0] if known is None else known

    def _own(self, file_name: str) -> Book:
        return Book(f"{OWN}/{file_name}", self.folder / file_name, True)

    def _copy_of(self, book: Book) -> Book:
        """Return a script of the user's that does not exist yet, named as another one."""
        stem, ending = Path(book.file_name).stem, book.path.suffix
        names = [stem, *(f"{stem}_{number}" for number in range(2, _MOST))]
        name = next((one for one in names if not os.path.lexists(self.folder / f"{one}{ending}")), None)
        if name is None:
            raise ShelfError(f"{book.name}: there are too many copies in {self.folder}")
        return self._own(f"{name}{ending}")


def shipped_with_the_package() -> dict[str, Callable[[], dict[str, Path]]]:
    """Return what gives the package's scripts of each kind, by name."""
    package = package_path()
    return {
        "built-in": lambda: scripts_in(BUILT_IN),
        "tutorial": lambda: _stages(package / "docs" / "tutorial"),
        "tasks": lambda: _starts(package / "docs" / "tutorial" / _LAST_STAGE),
    }


def scripts_in(folder: Path) -> dict[str, Path]:
    """Return the scripts in a folder, by name."""
    try:
        files = sorted(folder.iterdir())[: 10 * _MOST]
    except OSError:  # there is none yet
        return {}
    named = {file.name: file for file in files if file.suffix in _ENDINGS and not file.name.startswith(("_", "."))}
    return dict(list(named.items())[:_MOST])


def _stages(folder: Path) -> dict[str, Path]:
    """Return the tutorial's stages, whose names begin with their numbers; the folder holds tools, too."""
    return {name: path for name, path in scripts_in(folder).items() if name[0].isdigit()}


def _starts(last_stage: Path) -> dict[str, Path]:
    """Return what each task begins with, by the task's name: a file of its own, or the whole of the tutorial."""
    own = {name: tasks.folder() / name / _START for name in tasks.names()}
    found = {f"{name}.py": file if file.is_file() else last_stage for name, file in own.items()}
    return {name: file for name, file in found.items() if file.is_file()}


def _checked(name: Any) -> str:
    """Return the name of a file that may be made. Raises ShelfError."""
    if not isinstance(name, str) or not 0 < len(name) <= _LONGEST:
        raise ShelfError(f"{str(name)[:80]!r}: a name has 1 to {_LONGEST} characters")
    if Path(name).suffix not in _ENDINGS:
        raise ShelfError(f"{name!r}: a script's name ends in {' or '.join(_ENDINGS)}")
    if "/" in name or name.startswith(("_", ".")) or not name.isprintable():
        raise ShelfError(f"{name!r}: a name is letters, digits, '-' and '_', and begins with neither '_' nor '.'")
    return name
