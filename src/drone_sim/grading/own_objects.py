"""The objects that a submission may read if the plan limits it to its own vehicle (`reads: own`)."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api import listing
from drone_sim.scripting.api.calls import methods_of
from drone_sim.scripting.api.constants import bare
from drone_sim.scripting.api.image_filters import ImageFilters
from drone_sim.scripting.api.objects import Objects
from drone_sim.scripting.api.sensors import EVERY_SENSOR, Sensors

_CREATED_KINDS = ("dummy", "path", "script")  # kinds of objects that a script may create
_OBJECT_KEYS = ("object", "relObject")  # of the mapping that describes a motion


class OwnObjects:
    """The objects of a submission: its vehicles with all their children, and the objects that it has created."""

    def __init__(self, simulation: Simulation, names: Iterable[str]):
        """Create this before the simulation's scripts begin; `names` are those of the vehicles' objects."""
        context = simulation.context
        self._objects, self._collections = context.objects, context.collections
        roots = [self._objects[self._objects.handle(name)] for name in names]
        self._initial_handles = {*self._objects}
        self.handles = {  # of the vehicles' objects
            handle
            for handle, scene_object in ((handle, self._objects[handle]) for handle in self._objects)
            if any(scene_object is root or scene_object.is_descendant_of(root) for root in roots)
        }

    def foreign_object(self, function: str, arguments: list[Any]) -> str | None:
        """Return the name of an object in a call that is not the submission's own, None if there is none."""
        return next(filter(None, map(self._foreign_name, _entities(function, arguments))), None)

    def _foreign_name(self, value: Any) -> str | None:
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            return None  # not a handle
        if value in EVERY_SENSOR:
            return "all objects"
        handle = bare(int(value))
        if handle in self._collections:
            members = self._collections.objects(handle, self._objects)
            return next(filter(None, map(self._foreign_name, members)), None)
        scene_object = self._objects.get(handle)
        return None if scene_object is None or self._is_own(handle, scene_object) else scene_object.name

    def _is_own(self, handle: int, scene_object: SceneObject) -> bool:
        return handle in self.handles or (handle not in self._initial_handles and scene_object.kind in _CREATED_KINDS)


def _entities(function: str, arguments: list[Any]) -> Iterator[Any]:
    """Yield the handles among the arguments of a call."""
    for index, default in _handle_arguments().get(function, ()):
        yield arguments[index] if index < len(arguments) else default
    for argument in arguments:
        if isinstance(argument, Mapping):
            yield from (argument.get(key) for key in _OBJECT_KEYS)


@functools.cache
def _handle_arguments() -> dict[str, tuple[tuple[int, Any], ...]]:
    """Return the index and the default of each argument that is a handle, by function, as module.name."""
    handle_arguments = {}
    for kind in (*listing.classes_of_sim(), Objects, Sensors, ImageFilters):
        for method, _, names in methods_of(kind):
            parameters = enumerate([*inspect.signature(method).parameters.values()][1:])
            handles = tuple((index, one.default) for index, one in parameters if one.annotation == "Handle")
            handle_arguments.update(dict.fromkeys(names, handles))
    return handle_arguments
