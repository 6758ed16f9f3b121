"""Scene files that the page offers: recently opened ones, the user's, the package's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import package_path
from drone_sim.vrep_files.model import SUFFIXES

_LIST = ".recent_scenes.json"
_MAX_RECENT = 10
_MAX_OWN = 200


class RecentScenes:
    """List of recently opened scene files, kept in the user's folder."""

    def __init__(self, folder: Path):
        """`folder` is the user's; it need not exist."""
        self._folder = folder

    def listed(self) -> dict[str, Any]:
        """Return the folder and the files in each group."""
        suffixes = {".yaml", ".yml", *SUFFIXES}
        own = sorted(file for file in self._folder.glob("*") if file.suffix.lower() in suffixes and file.is_file())
        shipped = sorted((package_path() / "config/scenes").glob("*.yaml"))
        return {
            "folder": str(self._folder),
            "recent": [file for file in self._recent() if Path(file).is_file()],
            "own": list(map(str, own[:_MAX_OWN])),
            "package": list(map(str, shipped)),
        }

    def _recent(self) -> list[str]:
        try:
            files = json.loads((self._folder / _LIST).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return []
        return [file for file in files if isinstance(file, str)][:_MAX_RECENT] if isinstance(files, list) else []

    def add(self, file: str) -> None:
        """Put a file that was opened or saved at the top of the list; errors of writing the list are ignored."""
        if not file:
            return
        files = [file, *(other for other in self._recent() if other != file)][:_MAX_RECENT]
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            writing.write(self._folder / _LIST, json.dumps(files))
        except OSError:
            pass
