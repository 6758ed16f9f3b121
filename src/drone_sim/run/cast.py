"""All that has a child script: the vehicles, and the objects that the scene attaches one to."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.object_tree import SceneObject
from drone_sim.run.parameters import Parameters
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.attached_script import AttachedScript
from drone_sim.vehicles.shared import Shared
from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)
_LAST_TURNS = 10  # that a thread has for its end, once the simulation is about to stop

Actor = Vehicle | AttachedScript


class Cast:
    """Vehicles and attached scripts, in V-REP's order: from the root of the tree to its leaves, each branch in turn."""

    def __init__(self, parameters: Parameters, vehicles: Mapping[str, Vehicle], shared: Shared):
        """Take the vehicles, which may come and go, and the scripts that the scene has."""
        self.attached: list[AttachedScript] = []
        self._scripts = parameters.scene.scripts
        self._place = parameters.scene_place
        self._vehicles = vehicles
        self._shared = shared

    def begin_anew(self) -> None:
        """Attach the scene's scripts to the objects that are there, without loading them. Raises ParameterError."""
        self.attached = []
        self.attach()

    def attach(self) -> list[AttachedScript]:
        """Attach the scripts whose objects are there by now; return those. Raises ParameterError."""
        there = {one.own_script for one in self.attached}
        found: list[AttachedScript] = []
        for index, one in enumerate(self._scripts):
            handle = self._handle(one.object, index)
            if handle is not None and self._shared.objects[handle].name not in there:
                found.append(AttachedScript(one, handle, self._vehicles, self._shared))
                there.add(found[-1].own_script)
        self.attached += found
        return found

    def _handle(self, name: str, index: int) -> int | None:
        """Return the object of a script; None for one of a vehicle that may still come. Raises ParameterError."""
        objects = self._shared.objects
        if name not in objects and (objects.is_copied(plain(name)) or (plain(name) != name and plain(name) in objects)):
            _LOG.warning("no object is named '%s' now: its script waits until a vehicle comes that has it", name)
            return None
        try:
            handle = objects.handle(name)
            if any(objects[handle] is one.own_object for one in self._vehicles.values()):
                raise ValueError(f"'{name}' has the script that the key `script` of its vehicle names")
        except ValueError as error:
            place = self._place(("scripts", index, "object"))
            raise ParameterError(f"{place}: scripts/{index}/object: {error}") from None
        return handle

    def detach(self, vehicle: str) -> None:
        """Let go of the scripts on a vehicle's own objects."""
        for one in self.of(vehicle):
            self.attached.remove(one)
            one.leave()

    def of(self, vehicle: str) -> list[AttachedScript]:
        """Return the scripts on a vehicle's own objects, apart from its own one."""
        return [
            one for one in self.in_order(self.attached) if isinstance(one, AttachedScript) and one.goes_with == vehicle
        ]

    # ---- in the order of the tree

    def all(self) -> Sequence[Actor]:
        """Return all of them, in order."""
        vehicles = tuple(self._vehicles.values())
        return self.in_order((*vehicles, *self.attached)) if self.attached else vehicles

    def in_order(self, actors: Sequence[Actor]) -> list[Actor]:
        """Return some of them, in order."""
        return sorted(actors, key=lambda one: self._way(one.own_script))

    def _way(self, name: str) -> list[int]:
        """Return the handles on the way from the root to an object."""
        objects, way = self._shared.objects, []
        here: SceneObject | None = objects[objects.handle(name)]
        while here is not None:
            way.append(objects.handle_of(here))
            here = here.parent
        return way[::-1]

    # ---- the end

    def clean_up(self, actors: Sequence[Actor]) -> list[ScriptError]:
        """Let threads end, and call every cleanup, whatever the others do; return what went wrong."""
        errors: list[ScriptError] = []
        control = self._shared.control
        try:
            control.is_stopping = True
            for _ in range(_LAST_TURNS):
                for one in actors:
                    if one.script.threaded:
                        _attempt(one.script.take_turn, errors)
            control.is_ending = True
            for one in actors:
                _attempt(lambda script=one.script: script.call("cleanup"), errors)  # type: ignore[misc]
        finally:
            control.is_stopping = control.is_ending = False
        return errors


def _attempt(action: Callable[[], None], errors: list[ScriptError]) -> None:
    try:
        action()
    except ScriptError as error:
        errors.append(error)


def tell(errors: Sequence[ScriptError]) -> None:
    """Raise the first error, after a line on each of the others."""
    for second in errors[1:]:
        LOG.error("%s", second)
    if errors:
        raise errors[0]
