"""The scene around the vehicles: floor and objects in the world."""

from __future__ import annotations

import numpy as np

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.state import Pose, State
from drone_sim.scene import scene_files
from drone_sim.scene.scene_parameters import ObjectParameters, SceneParameters
from drone_sim.shapes.visual import Visual
from drone_sim.world import World


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
    """What stands in the world besides the vehicles."""

    def __init__(self, parameters: SceneParameters, world: World):
        """Put floor and objects into an empty world. Raises ParameterError for a file that cannot be used."""
        self.parameters = parameters
        scene_files.check(parameters)
        self._world = world
        floor = parameters.floor
        self.floor = world.add_floor(floor.size, floor.texture, ground=not floor.edge)
        try:
            self._numbers = [_add(world, one) for one in parameters.objects]
        except ValueError as error:
            raise ParameterError(str(error)) from None
        self.bodies = [SceneBody(world, number) for number in self._numbers]  # in the order of the parameters

    def name_objects(self, objects: ObjectTree) -> None:
        """Let scripts find the objects that have a name. Raises ParameterError, with its place, for a taken one."""
        for index, (one, body) in enumerate(zip(self.parameters.objects, self.bodies)):
            if one.name in objects:
                raise ParameterError(f"an object named '{one.name}' is there already", ("objects", index, "name"))
            if one.name:
                objects.add(one.name, body=body)

    def names(self) -> dict[int, tuple[str, str]]:
        """Return, by body in the world, what a person calls it, and its name among the objects of scripts, or ''."""
        named = {self.floor: ("Floor", "Floor")}
        for index, (one, number) in enumerate(zip(self.parameters.objects, self._numbers)):
            named[number] = (one.name or f"objects/{index}", one.name)
        return named

    def visuals(self) -> tuple[list[Visual], np.ndarray]:
        """Return how the objects look, the floor aside, and the poses world from visual, (N, 4, 4)."""
        return self._world.visuals(self._numbers), self._world.visual_poses(self._numbers)


def _add(world: World, one: ObjectParameters) -> int:
    return world.add_object(one.to_shape(), one.pose, mass=one.mass, color=one.color, texture=one.texture)
