"""The scenes that the panel offers, by short names: the package's, and those in the user's folder."""

from __future__ import annotations

from pathlib import Path

from drone_sim.files.resources import package_path, resolve
from drone_sim.vrep_files.reading import SUFFIXES

_NONE = "none"  # as the launch file says it
_MINE = "mine/"
_FOLDER = "config/scenes"
_MOST = 200  # of the user's
_KINDS = {".yaml", ".yml", *SUFFIXES}


class Scenes:
    """Names of scenes, and what the parameter `scene_file` is for each."""

    def __init__(self, folder: Path):
        """Take the user's folder, which need not be there."""
        self._folder = folder
        shipped = sorted((package_path() / _FOLDER).glob("*.yaml"))
        # Named so that a simulation on another machine finds its own.
        self._shipped = {one.stem: f"package://drone_sim/{_FOLDER}/{one.name}" for one in shipped}

    def offered(self, flown: str) -> tuple[tuple[str, ...], str]:
        """Return the names, and that of the scene that is flown: one of them, or the file where it is another."""
        files = self._files()
        place = _place(flown)
        name = next((name for name, file in files.items() if _place(file) == place), place)
        return tuple(dict.fromkeys((*files, name))), name

    def file(self, name: str) -> str:
        """Return what `scene_file` must be for a name that was offered."""
        return self._files().get(name, name)

    def _files(self) -> dict[str, str]:
        own = (one for one in _listed(self._folder) if one.suffix.lower() in _KINDS and one.is_file())
        mine = {f"{_MINE}{one.name}": str(one) for one in sorted(own)[:_MOST]}
        return {_NONE: _NONE, **self._shipped, **mine}


def _listed(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError:
        return []


def _place(flown: str) -> str:
    """Return a scene's file as its path, however it was named."""
    if flown in ("", _NONE):
        return _NONE
    try:
        return str(resolve(flown))
    except (OSError, ValueError):
        return flown
