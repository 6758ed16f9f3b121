"""The scene around the drone: floor and objects, from a YAML file, and back into one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np
import yaml

from drone_sim import frames, scene_files
from drone_sim.frames import Matrix
from drone_sim.objects import ObjectTree
from drone_sim.parameter_types import ParameterError
from drone_sim.scene_parameters import ObjectParameters, SceneParameters
from drone_sim.state import Pose, State
from drone_sim.visual import Visual
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

    def __init__(self, parameters: SceneParameters, world: World):
        """Put floor and objects into an empty world. Raises ParameterError for a file that cannot be used."""
        self._parameters = parameters
        scene_files.check(parameters)
        self._world = world
        world.add_floor(parameters.floor.size, parameters.floor.texture)
        try:
            self._numbers = [world.add_shape(_shape(one)) for one in parameters.objects]
        except ValueError as error:
            raise ParameterError(str(error)) from None
        self._bodies = [SceneBody(world, number) for number in self._numbers]

    def name_objects(self, objects: ObjectTree) -> None:
        """Let scripts find the objects that have a name. Raises ParameterError for a name that is taken."""
        for one, body in zip(self._parameters.objects, self._bodies):
            if one.name in objects:
                raise ParameterError(f"scene: an object named '{one.name}' is there already")
            if one.name:
                objects.add(one.name, body=body)

    def visuals(self) -> Tuple[List[Visual], np.ndarray]:
        """Return how the objects look, floor and drone aside, and the poses world from visual, (N, 4, 4)."""
        return self._world.visuals(self._numbers), self._world.visual_poses(self._numbers)

    def save(self, path: Path, drone: Matrix) -> None:
        """Write floor, objects and drone as they stand now, as a scene file. Raises OSError."""
        x, y, z = frames.position(drone)
        content: Dict[str, Any] = {
            "floor": self._parameters.floor.model_dump(),
            "drone": {"position": [x, y, z], "yaw": frames.to_euler(drone)[2]},
            "objects": self._objects(),
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("# metres, radians\n" + yaml.safe_dump(content, sort_keys=False), encoding="utf-8")

    def _objects(self) -> List[Dict[str, Any]]:
        saved = []
        for one, body in zip(self._parameters.objects, self._bodies):
            values = one.model_dump(mode="json", exclude_defaults=True)
            values["position"] = list(body.state.position)
            values["rpy"] = list(frames.to_rpy(body.matrix))
            saved.append(values)
        return saved


def _shape(one: ObjectParameters) -> Shape:
    return Shape(one.shape, one.size, one.position, one.rpy, one.color, one.mass, getattr(one, "file", ""), one.texture)
