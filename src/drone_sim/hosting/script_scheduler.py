"""In which order scripts are called: those of the vehicles, and of the objects that the scene attaches one to."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TypeVar

from drone_sim.config.types import Location, ParameterError
from drone_sim.context import SimulationContext
from drone_sim.hosting.child_scripts import AttachedScript, ChildScript, HostedScript
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.scene import Scene
from drone_sim.scripting.api.host import Operations
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)
_LAST_TURNS = 10  # that a thread has for its end, once the simulation is about to stop

AnyScript = ChildScript | AttachedScript
_Script = TypeVar("_Script", bound=HostedScript)


class ScriptScheduler:
    """Has all scripts, in V-REP's order: from the root of the tree to its leaves, each branch in turn."""

    def __init__(
        self,
        scene: Scene,
        place: Callable[[Location], str],
        vehicles: Mapping[str, Vehicle],
        context: SimulationContext,
    ):
        """Take the scene, whose scripts may come and go, and the vehicles, which may, too.

        `place` returns where a key of the scene stands, for a message.
        """
        self.child_scripts: dict[str, ChildScript] = {}  # by vehicle
        self.attached: list[AttachedScript] = []
        self.leaving: list[AttachedScript] = []  # those that ran when their objects went
        self.changes = 0  # how many have come, or gone, or changed their names, on objects
        self.is_changed = False  # whether `follow` is due
        self._scene = scene
        self._place = place
        self._vehicles = vehicles
        self._context = context

    def begin_anew(self) -> None:
        """Have every script anew where its object is, without loading it. Raises ParameterError."""
        self.attached, self.leaving = [], []
        for one in self.child_scripts.values():
            one.begin()
        self.attach()

    def attach(self, objects: Collection[str] | None = None) -> list[AttachedScript]:
        """Attach the scripts whose objects are there by now, or those of some; return those of the scene.

        Raises ParameterError.
        """
        for name, vehicle in self._vehicles.items():
            if name not in self.child_scripts:
                self.child_scripts[name] = ChildScript(vehicle)
                self.child_scripts[name].begin()
        there = {one.own_script for one in self.attached}
        found: list[AttachedScript] = []
        for index, one in enumerate(self._scene.scripts.values()):
            if objects is not None and one.object not in objects:
                continue
            handle = self._handle(one.object, index)
            if handle is not None and self._context.objects[handle].name not in there:
                found.append(AttachedScript(one, handle, self._vehicles, self._context))
                there.add(found[-1].own_script)
        self.attached += found
        self._count(len(found))
        return found

    def _count(self, changes: int) -> None:
        self.changes += changes
        self.is_changed = bool(changes) or self.is_changed

    def _handle(self, name: str, index: int) -> int | None:
        """Return the object of a script; None for one of a vehicle that may still come. Raises ParameterError."""
        objects = self._context.objects
        if name not in objects and (objects.is_copied(plain(name)) or (plain(name) != name and plain(name) in objects)):
            _LOG.warning(
                "there is no object named '%s' yet: its script starts once a vehicle with such an object is added", name
            )
            return None
        try:
            handle = objects.handle(name)
            if any(objects[handle] is one.object for one in self._vehicles.values()):
                raise ValueError(f"'{name}' already has a script, which the key `script` of its vehicle names")
        except ValueError as error:
            place = self._place(("scripts", index, "object"))
            raise ParameterError(f"{place}: scripts/{index}/object: {error}") from None
        return handle

    def detach(self, vehicle: str) -> None:
        """Let go of the scripts of a vehicle."""
        for one in self.attached[:]:
            if one.goes_with == vehicle:
                self.attached.remove(one)
                one.leave()
        self.child_scripts.pop(vehicle).leave()

    # ---- objects that come and go

    def rename(self, name: str, new: str) -> None:
        """Know the script of an object, if it has one, by the object's new name."""
        for one in self.attached:
            if one.own_script == name:
                one.own_script = new
                self._context.scripts.rename(name, new)
                self._count(1)

    def end(self, objects: Collection[str]) -> None:
        """Call the cleanup of scripts whose objects are about to go, and let go of them; one that runs ends later."""
        for one in [script for script in self.attached if script.own_script in objects]:
            self.attached.remove(one)
            self._count(1)
            if one.is_busy:
                self.leaving.append(one.split_off())
            else:
                self.clean_up([one])
            one.leave()

    def follow(self, operations: Operations) -> None:
        """End the scripts that ran when their objects went, and begin those that have come; called between phases.

        `operations` is what these may do to objects.
        """
        self.is_changed = False
        self.clean_up(self.leaving)
        while self.leaving:
            self.leaving.pop().close()
        for one in self.in_order([script for script in self.attached if not script.is_loaded]):
            one.load_script(one.file, operations)

    def of(self, vehicle: str) -> list[AnyScript]:
        """Return the scripts of a vehicle, in order: that on itself, and those on its own objects."""
        return self.in_order([self.child_scripts[vehicle], *(one for one in self.attached if one.goes_with == vehicle)])

    # ---- in the order of the tree

    def all(self) -> Sequence[AnyScript]:
        """Return all of them, in order."""
        own = tuple(self.child_scripts.values())
        return self.in_order((*own, *self.attached)) if self.attached else own

    def in_order(self, scripts: Sequence[_Script]) -> list[_Script]:
        """Return some of them, in order."""
        return sorted(scripts, key=lambda one: self._way(one.own_script))

    def _way(self, name: str) -> list[int]:
        """Return the handles on the way from the root to an object."""
        objects, way = self._context.objects, []
        here: SceneObject | None = objects[objects.handle(name)]
        while here is not None:
            way.append(objects.handle_of(here))
            here = here.parent
        return way[::-1]

    # ---- the end

    def clean_up(self, scripts: Sequence[AnyScript]) -> list[ScriptError]:
        """Let threads end, and call every cleanup, whatever the others do; return what went wrong."""
        errors: list[ScriptError] = []
        control = self._context.control
        before = control.is_stopping, control.is_ending
        try:
            control.is_stopping = True
            for _ in range(_LAST_TURNS):
                for one in scripts:
                    if one.script.threaded:
                        _attempt(one.script.take_turn, errors)
            control.is_ending = True
            for one in scripts:
                _attempt(lambda script=one.script: script.call("cleanup"), errors)  # type: ignore[misc]
        finally:
            control.is_stopping, control.is_ending = before
        return errors


def _attempt(action: Callable[[], None], errors: list[ScriptError]) -> None:
    try:
        action()
    except ScriptError as error:
        errors.append(error)


def raise_first(errors: Sequence[ScriptError]) -> None:
    """Raise the first error, after a line on each of the others."""
    for second in errors[1:]:
        LOG.error("%s", second)
    if errors:
        raise errors[0]
