"""Output folder of an import: file names, rounded numbers, and the report of differences from the V-REP file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.message_text import MAX_NAME
from drone_sim.scene import entry

_DECIMALS = 6  # micrometres and microradians
_ZEROS = [0.0, 0.0, 0.0]


def number(value: float, digits: int = _DECIMALS) -> float:
    """Return `value` rounded to `digits` decimals, and 0 instead of -0."""
    return entry.rounded([value], digits)[0]


def numbers(values: Iterable[float]) -> list[float]:
    """Return the values rounded by `number`."""
    return entry.rounded(values, _DECIMALS)


def shade(color: Iterable[float]) -> list[float]:
    """Return a rounded RGBA colour as a list, without the opacity if it is 1."""
    red, green, blue, opacity = entry.rounded(color, 3)
    return [red, green, blue] if opacity == 1 else [red, green, blue, opacity]


def pose_keys(matrix: Sequence[float]) -> dict[str, Any]:
    """Return the keys `position` (m) and `rpy` (rad) of a transform; a key with only zeros is omitted."""
    return {key: value for key, value in entry.pose_keys(matrix, _DECIMALS).items() if value != _ZEROS}


def label(text: str) -> str:
    """Return `text` as a valid name in a scene file: printable and at most MAX_NAME characters."""
    return "".join(letter if letter.isprintable() else "_" for letter in text)[:MAX_NAME]


def word(name: str, otherwise: str) -> str:
    """Return `name` as letters, digits and _ only, with `otherwise` in front unless it begins with a letter."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:48]
    return plain if re.match(r"[A-Za-z]", plain) else f"{otherwise}_{plain}".rstrip("_")


class Folder:
    """Writes files below a folder, which is created with the first file."""

    def __init__(self, path: Path):
        """Write below `path`."""
        self.path = path
        self._taken: set[str] = set()

    def free_name(self, wanted: str, suffix: str, below: str = "") -> str:
        """Return an unused file name, relative to this folder, similar to `wanted`, and reserve it."""
        plain = f"{below}{word(wanted, 'object')}"
        name, number = f"{plain}{suffix}", 2
        while name.lower() in self._taken:
            name, number = f"{plain}_{number}{suffix}", number + 1
        self._taken.add(name.lower())
        return name

    def keep_free(self, names: Iterable[str]) -> None:
        """Reserve these names, so that `free_name` returns none of them."""
        self._taken.update(name.lower() for name in names)

    def write(self, name: str, content: str | bytes) -> None:
        """Write a file; text is encoded as UTF-8. Raises OSError."""
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with writing.replacing(path, binary=isinstance(content, bytes)) as file:
            file.write(content)


LIST = "IMPORT.txt"


class Report:
    """The differences from the V-REP file, one line for each; objects with the same difference share a line."""

    def __init__(self) -> None:
        self.notes: list[str] = []  # what works the same in another way
        self._names: dict[str, list[str]] = {}

    def add(self, name: str, what: str) -> None:
        """Add the line `what` for an object; '' stands for the whole file."""
        names = self._names.setdefault(what, [])
        if name not in names:
            names.append(name)

    def __len__(self) -> int:
        """Return the number of lines, without notes."""
        return len(self._names)

    def lines(self, most: int | None = None) -> Iterator[str]:
        """Yield the lines, each with its object names, at most `most` of them."""
        for what, names in self._names.items():
            more = f" and {len(names) - most} more" if most is not None and len(names) > most else ""
            yield f"{', '.join(names[:most])}{more}: {what}" if names != [""] else what
