"""The folder that an import writes: every file under a name of its own."""

from __future__ import annotations

from pathlib import Path

from drone_sim.files import writing
from drone_sim.importing.labels import word


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

    def write(self, name: str, content: str) -> None:
        """Write a text file. Raises OSError."""
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        writing.write(path, content)
