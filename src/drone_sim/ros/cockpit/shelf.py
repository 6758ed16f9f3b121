"""The scripts that the editor may open: those of the package, to be copied, and those in a folder of the user's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import package_path

_ENDINGS = (".py", ".lua")
_LARGEST = 1 << 20  # bytes
_SHIPPED = (("built-in", "src/drone_sim/child_scripts"), ("tutorial", "docs/tutorial"))
_OWN = "mine"


class ShelfError(ValueError):
    """What was asked of the shelf cannot be done; one line."""


@dataclass(frozen=True)
class Book:
    """A script: the name by which a browser asks for it, and its file."""

    name: str
    path: Path
    is_own: bool  # whether it may be written


class Shelf:
    """Scripts by name, such as `built-in/pilot.py` or `mine/first.lua`. Nothing else is read or written."""

    def __init__(self, folder: Path, package: Path | None = None):
        """Take the user's folder, which the first copy makes."""
        self._folder = folder
        self._package = package or package_path()
        self._originals: dict[str, str] = {}  # of the user's own, as they were before the first change

    def books(self) -> list[Book]:
        """Return all that there are now."""
        shipped = [
            Book(f"{shelf}/{file.name}", file, False)
            for shelf, folder in _SHIPPED
            for file in _scripts(self._package / folder)
        ]
        return [*shipped, *(Book(f"{_OWN}/{file.name}", file, True) for file in _scripts(self._folder))]

    def find(self, name: Any) -> Book:
        """Return a script by its name. Raises ShelfError."""
        found = next((book for book in self.books() if book.name == name), None)
        if found is None:
            raise ShelfError(f"{str(name)[:80]!r}: no such script")
        return found

    def of_file(self, path: str) -> Book | None:
        """Return the script whose file that is, None where it is none of these."""
        return next((book for book in self.books() if str(book.path) == path), None)

    def read(self, book: Book) -> tuple[str, str]:
        """Return a script's text, and its version, which changes when the file does. Raises ShelfError."""
        try:
            if book.path.stat().st_size > _LARGEST:
                raise ShelfError(f"{book.name}: is larger than {_LARGEST} bytes")
            return book.path.read_text(encoding="utf-8"), _version(book.path)
        except (OSError, UnicodeDecodeError) as error:
            raise ShelfError(f"{book.name}: {error}") from None

    def save(self, book: Book, text: str, version: str) -> tuple[Book, str]:
        """Write a script whose version the editor has; one of the package becomes a copy in the user's folder.

        Return what has been written, and its version. Raises ShelfError, also where another has changed the file.
        """
        if len(text.encode()) > _LARGEST:
            raise ShelfError(f"{book.name}: is larger than {_LARGEST} bytes")
        if not book.is_own:
            book, version = self._copy(book), ""
        elif book.path.exists() and version != _version(book.path):
            raise ShelfError(f"{book.name}: has been changed by somebody else; nothing was written")
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if book.path.exists():
                self._originals.setdefault(book.name, self.read(book)[0])
            writing.write(book.path, text)
        except OSError as error:
            raise ShelfError(f"{book.name}: {error}") from None
        return book, _version(book.path)

    def original(self, book: Book) -> str:
        """Return what a script was before the first change, to go back to. Raises ShelfError."""
        return self._originals.get(book.name) or self.read(book)[0]

    def _copy(self, book: Book) -> Book:
        """Return a script of the user's that does not exist yet, named as one of the package."""
        stem, ending = book.path.stem, book.path.suffix
        names = [stem, *(f"{stem}_{number}" for number in range(2, 1000))]
        name = next((one for one in names if not (self._folder / f"{one}{ending}").exists()), None)
        if name is None:
            raise ShelfError(f"{book.name}: there are too many copies in {self._folder}")
        self._originals[f"{_OWN}/{name}{ending}"] = self.read(book)[0]
        return Book(f"{_OWN}/{name}{ending}", self._folder / f"{name}{ending}", True)


def _scripts(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = [file for file in sorted(folder.iterdir()) if file.suffix in _ENDINGS]
    return [file for file in files if not file.name.startswith(("_", "."))]


def _version(path: Path) -> str:
    state = path.stat()
    return f"{state.st_mtime_ns}-{state.st_size}"
