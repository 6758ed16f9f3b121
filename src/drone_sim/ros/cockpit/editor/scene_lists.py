"""Scene files that the page offers: the package's, the user's, and recently opened ones."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import package_path, resolve
from drone_sim.vrep_files.model import SUFFIXES

NO_SCENE = "none"  # as in the launch file
NEW_SCENE = "new scene"  # the name of a scene without a file
_MINE = "mine/"
_SHIPPED = "config/scenes"
_RECENT = ".recent_scenes.json"  # in the user's folder
_MAX_RECENT = 10
_MAX_OWN = 200  # files of the user's
_SUFFIXES = {".yaml", ".yml", *SUFFIXES}


def own_files(folder: Path, suffixes: Collection[str]) -> list[Path]:
    """Return the files of the user's in a folder that have one of the suffixes."""
    files = sorted(file for file in folder.glob("*") if file.suffix.lower() in suffixes and file.is_file())
    return files[:_MAX_OWN]


def scene_path(scene_file: str) -> str:
    """Return the path of a scene file, which may be given as package:// or relative; `none` for none."""
    if scene_file in ("", NO_SCENE):
        return NO_SCENE
    try:
        return str(resolve(scene_file))
    except (OSError, ValueError):
        return scene_file


class SceneList:
    """Names of scenes for the page, each with its value of the parameter `scene_file`."""

    def __init__(self, folder: Path):
        """`folder` is that of the user's scenes, listed after those of the package; it need not exist."""
        self._folder = folder
        shipped = sorted((package_path() / _SHIPPED).glob("*.yaml"))
        # As package:// so that a simulator on another machine finds its own copy.
        self._shipped = {file.stem: f"package://drone_sim/{_SHIPPED}/{file.name}" for file in shipped}

    def names(self, current: str) -> tuple[tuple[str, ...], str]:
        """Return all names, and the name of the scene file `current`, which is its path if it is not in the list."""
        files = self._files()
        path = scene_path(current)
        name = next((name for name, file in files.items() if scene_path(file) == path), path)
        return tuple(dict.fromkeys((*files, name))), name

    def file(self, name: str) -> str:
        """Return the value of the parameter `scene_file` for a name."""
        return self._files().get(name, name)

    def _files(self) -> dict[str, str]:
        own = {f"{_MINE}{file.name}": str(file) for file in own_files(self._folder, _SUFFIXES)}
        return {NO_SCENE: NO_SCENE, **self._shipped, **own}


class RecentScenes:
    """List of recently opened scene files, kept in the user's folder, which need not exist."""

    def __init__(self, folder: Path):
        self._folder = folder

    def listed(self) -> dict[str, Any]:
        """Return the folder and the files in each group."""
        return {
            "folder": str(self._folder),
            "recent": [file for file in self._recent() if Path(file).is_file()],
            "own": list(map(str, own_files(self._folder, _SUFFIXES))),
            "package": list(map(str, sorted((package_path() / _SHIPPED).glob("*.yaml")))),
        }

    def _recent(self) -> list[str]:
        try:
            files = json.loads((self._folder / _RECENT).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return []
        return [file for file in files if isinstance(file, str)][:_MAX_RECENT] if isinstance(files, list) else []

    def add(self, file: str) -> None:
        """Put a file that was opened or saved at the top of the list; errors of writing the list are ignored."""
        if not file:
            return
        files = [file, *(other for other in self._recent() if other != file)][:_MAX_RECENT]
        with contextlib.suppress(OSError):
            self._folder.mkdir(parents=True, exist_ok=True)
            writing.write(self._folder / _RECENT, json.dumps(files))
