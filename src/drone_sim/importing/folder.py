"""The folder that an import writes: files, names and numbers as a scene has them, and what is not as it was."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import read_bytes, resolve
from drone_sim.mechanics import frames
from drone_sim.message_text import MAX_NAME

_DIGITS = 6  # after the point: micrometres and microradians
_NOTHING = [0.0, 0.0, 0.0]


def number(value: float, digits: int = _DIGITS) -> float:
    """Return a number without the noise of its last digits, and without a -0."""
    return round(float(value), digits) + 0.0


def numbers(values: Iterable[float]) -> list[float]:
    """Return a list of such numbers."""
    return [number(value) for value in values]


def shade(color: Iterable[float]) -> list[float]:
    """Return a colour; an opaque one without the opacity."""
    red, green, blue, opacity = (number(value, 3) for value in color)
    return [red, green, blue] if opacity == 1 else [red, green, blue, opacity]


def pose_keys(matrix: Sequence[float]) -> dict[str, Any]:
    """Return `position` and `rpy` of a transform, what is zero left out."""
    keys = {"position": numbers(frames.position(matrix)), "rpy": numbers(frames.to_rpy(matrix))}
    return {key: value for key, value in keys.items() if value != _NOTHING}


def label(text: str) -> str:
    """Return a text as a scene file may have it as a name: printable and not too long."""
    return "".join(letter if letter.isprintable() else "_" for letter in text)[:MAX_NAME]


def word(name: str, otherwise: str) -> str:
    """Return a name of letters, digits and _ alone, a letter first: for files, topics and vehicles."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:48]
    return plain if re.match(r"[A-Za-z]", plain) else f"{otherwise}_{plain}".rstrip("_")


class Folder:
    """Writes files below one folder, which it makes."""

    def __init__(self, path: Path):
        """Take its path. Nothing is made before the first file is written."""
        self.path = path
        self._taken: set[str] = set()

    def free_name(self, wanted: str, suffix: str, below: str = "") -> str:
        """Return a file name like the one wanted that no other file of this folder has, relative to it."""
        plain = f"{below}{word(wanted, 'object')}"
        name, number = f"{plain}{suffix}", 2
        while name.lower() in self._taken:
            name, number = f"{plain}_{number}{suffix}", number + 1
        self._taken.add(name.lower())
        return name

    def keep_free(self, names: Iterable[str]) -> None:
        """Give no file one of these names."""
        self._taken.update(name.lower() for name in names)

    def write(self, name: str, content: str | bytes) -> None:
        """Write a file, text in UTF-8. Raises OSError."""
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with writing.replacing(path, binary=isinstance(content, bytes)) as file:
            file.write(content)


LIST = "IMPORT.txt"
_HOLE = "WILL NOT WORK: "
_LONGEST_LIST = 1 << 20  # bytes


def holes(scene_file: str) -> list[str]:
    """Return what the import of a scene file says that will not work; nothing for a scene that is no import."""
    try:
        text = read_bytes(resolve(scene_file).with_name(LIST), _LONGEST_LIST).decode("utf-8", "replace")
    except (OSError, ValueError):
        return []
    return [line.removeprefix(_HOLE) for line in text.splitlines() if line.startswith(_HOLE)]


class Report:
    """Lines for the end of an import, by what they say; objects of which the same is said share one."""

    def __init__(self) -> None:
        """Begin with nothing to say."""
        self.notes: list[str] = []  # what is the same by other means
        self.holes: list[str] = []  # what will not work
        self._said: dict[str, list[str]] = {}

    def add(self, name: str, what: str) -> None:
        """Say something of an object; '' is the whole file."""
        names = self._said.setdefault(what, [])
        if name not in names:
            names.append(name)

    def __len__(self) -> int:
        """How much there is to say."""
        return len(self._said) + len(self.holes)

    def lines(self, most: int | None = None) -> Iterator[str]:
        """Yield one line for everything that is said, with all of its objects, or the first so many; holes first."""
        yield from (f"{_HOLE}{one}" for one in self.holes)
        for what, names in self._said.items():
            more = f" and {len(names) - most} more" if most is not None and len(names) > most else ""
            yield f"{', '.join(names[:most])}{more}: {what}" if names != [""] else what
