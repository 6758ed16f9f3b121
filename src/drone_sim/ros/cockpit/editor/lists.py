"""Lists that the page offers: scenes, recently opened scene files, and models on its shelf, with pictures and edits."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from drone_sim.editing.library import KINDS
from drone_sim.files import writing
from drone_sim.files.resources import package_path, resolve
from drone_sim.grading import classroom
from drone_sim.ros.cockpit.server.access_control import Content
from drone_sim.vehicles.types import TYPES
from drone_sim.vrep_files.model import SUFFIXES

NO_SCENE = "none"  # as in the launch file
NEW_SCENE = "new scene"  # the name of a scene without a file
_MINE, _COURSE = "mine/", "course/"
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
        """`folder` is that of the user's scenes, listed after those of package and course; it need not exist."""
        self._folder = folder
        room = classroom.folder()
        self._course = classroom.scenes_folder(room) if room else None
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
        sent = own_files(self._course, _SUFFIXES) if self._course else []
        of_course = {f"{_COURSE}{file.name}": str(file) for file in sent}
        return {NO_SCENE: NO_SCENE, **self._shipped, **of_course, **own}


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


# ---- models

PICTURES = "config/models/pictures"
_WEB = "/models/"
_FOLDER = "models"  # in the folder of the user's scripts
_Operation = dict[str, Any]


def _add(name: str, **values: Any) -> _Operation:
    return {"do": "add", "objects": [{"name": name, **values}]}


SHAPES: dict[str, _Operation] = {
    "Cuboid": _add("Cuboid", shape="box", size=[0.5, 0.5, 0.5]),
    "Sphere": _add("Sphere", shape="sphere", size=[0.25]),
    "Cylinder": _add("Cylinder", shape="cylinder", size=[0.25, 0.5]),
    "Capsule": _add("Capsule", shape="capsule", size=[0.15, 0.4]),
    "Cone": {"do": "add_model", "model": "cone"},
    "Plane": _add("Plane", shape="box", size=[1, 1, 0.002], respondable=False),
    "Wall": _add("Wall", shape="box", size=[0.1, 3, 2], color=[0.86, 0.82, 0.74]),
}
ARENA = ("gate", "landing_pad", "pole", "ramp", "table", "window_frame")
SENSORS: dict[str, _Operation] = {
    "Dummy": _add("Dummy", kind="dummy", size=0.05),
    "Target sphere": _add("Target", shape="sphere", size=[0.05], color=[0.2, 0.8, 0.2], respondable=False),
    "Camera": _add("Camera", kind="vision_sensor", width=640, height=480, rpy=[1.5708, 0, -1.5708]),
    "Vision sensor": _add("VisionSensor", kind="vision_sensor", rpy=[1.5708, 0, -1.5708]),
    "Proximity sensor": _add("ProximitySensor", kind="proximity_sensor", type="cone", angle=0.5, range=2),
    "Joint": _add("Joint", kind="joint", type="revolute"),
}
_HEIGHT = 0.5  # m, of a vehicle above the surface that it is dropped on
_BARE: dict[str, Any] = {  # V-REP's quadricopter: its own two cameras, no Track_base, the stock script
    "script": "target",
    "cameras": {name: None for name in ("front", "depth", "track", "floor")},
    "objects": {"Track_base": None},
}


class ModelList:
    """Models of the package and of the user's folder."""

    def __init__(self, folder: Path):
        """`folder` is that of the user's scripts and scenes; the models are in its subfolder `models`."""
        self.folder = folder / _FOLDER

    def groups(self) -> list[dict[str, Any]]:
        vehicles: dict[str, _Operation] = {
            name.capitalize(): {"do": "add_vehicle", "type": name, "height": _HEIGHT} for name in TYPES
        }
        vehicles["Quadricopter of V-REP"] = {**vehicles["Quadricopter"], "values": _BARE}
        arena: dict[str, _Operation] = {
            name.replace("_", " ").capitalize(): {"do": "add_model", "model": name} for name in ARENA
        }
        arena["Text sign"] = {"do": "add_sign", "text": "START"}
        shipped = {"Shapes": SHAPES, "Arena": arena, "Vehicles": vehicles, "Sensors": SENSORS}
        groups = {group: [_row(*model) for model in models.items()] for group, models in shipped.items()}
        groups["Yours"] = [_row(file.name, self.operation(file), "") for file in own_files(self.folder, KINDS)]
        return [{"name": group, "models": models} for group, models in groups.items()]

    def operation(self, file: Path) -> _Operation:
        """Return the edit operation that adds a file of the user's."""
        return {"do": "add_model", "model": str(file)}

    def picture(self, path: str) -> Content:
        """Return the picture of one of the package's models; None for any other path."""
        if not path.startswith(_WEB):
            return None
        file = package_path() / PICTURES / path.removeprefix(_WEB)
        if file.suffix != ".png" or file.parent != package_path() / PICTURES or not file.is_file():
            return None
        return "image/png", file.read_bytes()


def _row(title: str, operation: _Operation, picture: str | None = None) -> dict[str, Any]:
    key = title.lower().replace(" ", "_")
    if picture is None:
        picture = f"{_WEB[1:]}{key}.png" if (package_path() / PICTURES / f"{key}.png").is_file() else ""
    return {"model": key, "title": title, "picture": picture, "op": operation}
