"""Models on the page's shelf, each with its picture and the edit operation that adds it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drone_sim.editing.library import KINDS
from drone_sim.files.resources import package_path
from drone_sim.ros.cockpit.editor.scene_lists import own_files
from drone_sim.ros.cockpit.server.access_control import Content
from drone_sim.vehicles.types import TYPES

PICTURES = "config/models/pictures"
_WEB = "/models/"
_FOLDER = "models"  # in the folder of the user's scripts
_Operation = dict[str, Any]


def _add(name: str, **values: Any) -> _Operation:
    return {"do": "add", "objects": [{"name": name, **values}]}


def _shape(name: str, shape: str, **values: Any) -> _Operation:
    return _add(name, shape=shape, **values)


SHAPES: dict[str, _Operation] = {
    "Cuboid": _shape("Cuboid", "box", size=[0.5, 0.5, 0.5]),
    "Sphere": _shape("Sphere", "sphere", size=[0.25]),
    "Cylinder": _shape("Cylinder", "cylinder", size=[0.25, 0.5]),
    "Capsule": _shape("Capsule", "capsule", size=[0.15, 0.4]),
    "Cone": {"do": "add_model", "model": "cone"},
    "Plane": _shape("Plane", "box", size=[1, 1, 0.002], respondable=False),
    "Wall": _shape("Wall", "box", size=[0.1, 3, 2], color=[0.86, 0.82, 0.74]),
}
ARENA = ("gate", "landing_pad", "pole", "ramp", "table", "window_frame")
_SIGN = {"do": "add_sign", "text": "START"}
SENSORS: dict[str, _Operation] = {
    "Dummy": _add("Dummy", kind="dummy", size=0.05),
    "Target sphere": _shape("Target", "sphere", size=[0.05], color=[0.2, 0.8, 0.2], respondable=False),
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
        arena: dict[str, _Operation] = {name: {"do": "add_model", "model": name} for name in ARENA}
        arena["text_sign"] = _SIGN
        return [
            {"name": "Shapes", "models": [_row(title, operation) for title, operation in SHAPES.items()]},
            {"name": "Arena", "models": [_row(name.replace("_", " ").capitalize(), op) for name, op in arena.items()]},
            {"name": "Vehicles", "models": [_row(title, operation) for title, operation in vehicles.items()]},
            {"name": "Sensors", "models": [_row(title, operation) for title, operation in SENSORS.items()]},
            {
                "name": "Yours",
                "models": [_row(file.name, self.operation(file), "") for file in own_files(self.folder, KINDS)],
            },
        ]

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
