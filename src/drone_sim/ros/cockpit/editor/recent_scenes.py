"""Scene files on offer: those opened last, the user's, the package's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import package_path
from drone_sim.vrep_files.model import SUFFIXES

_LIST = ".recent_scenes.json"
_MOST = 10
_MOST_OWN = 200


class RecentScenes:
    """Remembers in the user's folder which were opened."""

    def __init__(self, folder: Path):
        """Take the user's folder, which need not be there."""
        self._folder = folder

    def listed(self) -> dict[str, Any]:
        """Return the folder, and the files."""
        suffixes = {".yaml", ".yml", *SUFFIXES}
        own = sorted(one for one in self._folder.glob("*") if one.suffix.lower() in suffixes and one.is_file())
        shipped = sorted((package_path() / "config/scenes").glob("*.yaml"))
        return {
            "folder": str(self._folder),
            "recent": [one for one in self._recent() if Path(one).is_file()],
            "own": list(map(str, own[:_MOST_OWN])),
            "package": list(map(str, shipped)),
        }

    def _recent(self) -> list[str]:
        try:
            found = json.loads((self._folder / _LIST).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return []
        return [one for one in found if isinstance(one, str)][:_MOST] if isinstance(found, list) else []

    def add(self, file: str) -> None:
        """Remember a file that was opened or saved; an error while writing the list is ignored."""
        if not file:
            return
        files = [file, *(one for one in self._recent() if one != file)][:_MOST]
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            writing.write(self._folder / _LIST, json.dumps(files))
        except OSError:
            pass
