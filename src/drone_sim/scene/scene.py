"""The scene around the drone: floor and objects, from a YAML file, and back into one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drone_sim.config.types import Checked, FoundFile, ParameterError
from drone_sim.files import writing, yaml_files
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.state import Pose, State
from drone_sim.run.parameters import Parameters
from drone_sim.scene import scene_files
from drone_sim.scene.scene_parameters import ObjectParameters
from drone_sim.shapes.visual import Visual
from drone_sim.world import Shape, World


class SceneBody:
    """One object of the scene, as the object tree sees it."""

    def __init__(self, world: World, body: int):
        """Take the world and the number of the body in it."""
        self._world = world
        self._body = body

    @property
    def state(self) -> State:
        """Pose and velocity."""
        return self._world.state(self._body)

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""
        return self.state.matrix

    def move(self, pose: Pose) -> None:
        """Put it there, at rest."""
        self._world.set_pose(self._body, pose)


class Scene:
    """What stands in the world besides the drone."""

    def __init__(self, parameters: Parameters, world: World):
        """Put floor and objects into an empty world. Raises ParameterError for a file that cannot be used."""
        self._all = parameters
        self._parameters = parameters.scene
        scene_files.check(parameters.scene)
        self._world = world
        floor = parameters.scene.floor
        world.add_floor(floor.size, floor.texture, ground=not floor.edge)
        try:
            self._numbers = [world.add_shape(_shape(one)) for one in parameters.scene.objects]
        except ValueError as error:
            raise ParameterError(str(error)) from None
        self._bodies = [SceneBody(world, number) for number in self._numbers]

    def name_objects(self, objects: ObjectTree) -> None:
        """Let scripts find the objects that have a name. Raises ParameterError for a name that is taken."""
        for index, (one, body) in enumerate(zip(self._parameters.objects, self._bodies)):
            if one.name in objects:
                place = self._all.scene_place(("objects", index, "name"))
                raise ParameterError(f"{place}: an object named '{one.name}' is there already")
            if one.name:
                objects.add(one.name, body=body)

    def visuals(self) -> tuple[list[Visual], np.ndarray]:
        """Return how the objects look, floor and drone aside, and the poses world from visual, (N, 4, 4)."""
        return self._world.visuals(self._numbers), self._world.visual_poses(self._numbers)

    def save(self, path: Path, drone: Matrix) -> None:
        """Write floor, objects and drone as they stand now, as a scene file. Its own files keep their names.

        Raises ParameterError where that would be no scene that can be loaded, such as with the drone below the
        floor, and OSError; what was in the file is then still there.
        """
        x, y, z = frames.position(drone)
        content: dict[str, Any] = {
            "floor": self._plain(self._parameters.floor, path.parent),
            "drone": {**self._named(path.parent), "position": [x, y, z], "yaw": frames.to_rpy(drone)[2]},
            "objects": self._objects(path.parent),
        }
        text = "# metres, radians\n" + yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
        try:
            self._all.check_scene(yaml_files.parse(text), path)
        except ValueError as error:
            raise ParameterError(f"the scene as it stands cannot be saved: {error}") from None
        path.parent.mkdir(parents=True, exist_ok=True)
        writing.write(path, text)

    def _named(self, folder: Path) -> dict[str, Any]:
        """Return what the last scene file said of the drone, place aside."""
        own = {key: getattr(self._all.drone, key) for key in self._all.drone_in_scene if key in ("name", "urdf")}
        return {key: _file_name(value, folder) for key, value in own.items()}

    def _objects(self, folder: Path) -> list[dict[str, Any]]:
        saved = []
        for one, body in zip(self._parameters.objects, self._bodies):
            values = self._plain(one, folder)
            values["position"] = list(body.state.position)
            values["rpy"] = list(frames.to_rpy(body.matrix))
            saved.append(values)
        return saved

    def _plain(self, values: Checked, folder: Path) -> dict[str, Any]:
        """Return them as YAML has them, their files named as a scene file in `folder` can name them."""
        plain = values.model_dump(mode="json", exclude_defaults=True)
        for key in ("file", "texture"):
            if plain.get(key):
                plain[key] = _file_name(getattr(values, key), folder)
        return plain


def _file_name(value: str, folder: Path) -> str:
    return value.seen_from(folder) if isinstance(value, FoundFile) else value


def _shape(one: ObjectParameters) -> Shape:
    return Shape(one.shape, one.size, one.position, one.rpy, one.color, one.mass, getattr(one, "file", ""), one.texture)
