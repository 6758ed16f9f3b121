"""Which objects a submission may read where the plan limits it to its own vehicle (`reads: own`)."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api import listing
from drone_sim.scripting.api.calls import declaration_of
from drone_sim.scripting.api.constants import bare
from drone_sim.scripting.api.image_filters import ImageFilters
from drone_sim.scripting.api.objects import Objects
from drone_sim.scripting.api.sensors import EVERY_SENSOR, Sensors

_MADE = ("dummy", "path", "script")  # what a script may make
_IN_MAPPINGS = ("object", "relObject")  # keys of what a motion is told


class OwnObjects:
    """Tells the objects of a submission from all others: its vehicle and what hangs there, and what it has made."""

    def __init__(self, simulation: Simulation, names: Iterable[str]):
        """Take the simulation before its scripts begin, and the `names` of the vehicles' objects."""
        context = simulation.context
        self._objects, self._collections = context.objects, context.collections
        roots = [self._objects[self._objects.handle(name)] for name in names]
        self._from_the_start = {*self._objects}
        self.handles = {  # of the vehicles' objects
            handle
            for handle, one in ((handle, self._objects[handle]) for handle in self._objects)
            if any(one is root or one.is_descendant_of(root) for root in roots)
        }

    def other_in(self, function: str, arguments: list[Any]) -> str | None:
        """Return an object in a call that is not the submission's own, by its name for people; None for none."""
        return next(filter(None, map(self._other, _entities(function, arguments))), None)

    def _other(self, value: Any) -> str | None:
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            return None  # which is no handle of anything
        if value in EVERY_SENSOR:
            return "all objects"
        handle = bare(int(value))
        if handle in self._collections:
            members = self._collections.objects(handle, self._objects)
            return next(filter(None, map(self._other, members)), None)
        one = self._objects.get(handle)
        return None if one is None or self._is_own(handle, one) else one.name

    def _is_own(self, handle: int, one: SceneObject) -> bool:
        return handle in self.handles or (handle not in self._from_the_start and one.kind in _MADE)


def _entities(function: str, arguments: list[Any]) -> Iterator[Any]:
    """Yield the handles among the arguments of a call."""
    for place, default in _places().get(function, ()):
        yield arguments[place] if place < len(arguments) else default
    for one in arguments:
        if isinstance(one, Mapping):
            yield from (one.get(key) for key in _IN_MAPPINGS)


@functools.cache
def _places() -> dict[str, tuple[tuple[int, Any], ...]]:
    """Return for each function, as module.name, which arguments are handles, and the default where one is left out."""
    found = {}
    for kind in (*listing.classes_of_sim(), Objects, Sensors, ImageFilters):
        for attribute in vars(kind).values():
            declaration = declaration_of(attribute)
            if declaration:
                given = [*inspect.signature(attribute).parameters.values()][1:]
                places = [(n, one.default) for n, one in enumerate(given) if one.annotation == "Handle"]
                found.update({f"{declaration.module}.{name}": tuple(places) for name in declaration.names})
    return found
