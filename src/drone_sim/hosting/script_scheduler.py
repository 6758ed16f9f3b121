"""Order of the calls of all scripts: those of the vehicles, and those that the scene attaches to objects."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import TypeVar

from drone_sim.config.types import Location, ParameterError
from drone_sim.context import SimulationContext
from drone_sim.hosting.child_scripts import AttachedScript, ChildScript, HostedScript
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.scene import Scene
from drone_sim.scene.scene_parameters import AttachedScriptParameters
from drone_sim.scripting.api.host import Operations
from drone_sim.scripting.api.registry import CHILD, CUSTOMIZATION
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)
_LAST_TURNS = 10  # turns for each thread to end, once the simulation is about to stop

AnyScript = ChildScript | AttachedScript
_Script = TypeVar("_Script", bound=HostedScript)


class ScriptScheduler:
    """All scripts in V-REP's order: child scripts, then customization scripts, each from the root to the leaves.

    Depth first, in the tree of objects.
    """

    def __init__(
        self,
        scene: Scene,
        place: Callable[[Location], str],
        vehicles: Mapping[str, Vehicle],
        context: SimulationContext,
    ):
        """Use a scene and vehicles; scripts and vehicles may be added and removed later.

        `place` returns the position of a key of the scene (file and line) for a message.
        """
        self.child_scripts: dict[str, ChildScript] = {}  # by vehicle
        self.attached: list[AttachedScript] = []
        self.leaving: list[AttachedScript] = []  # those that were running when their objects were removed
        self.changes = 0  # number of attached scripts added, removed or renamed so far
        self.is_changed = False  # whether `follow` is due
        self._scene = scene
        self._place = place
        self._vehicles = vehicles
        self._context = context

    def begin_anew(self) -> None:
        """Attach every script again, without loading it. Raises ParameterError."""
        self.attached, self.leaving = [], []
        for script in self.child_scripts.values():
            script.begin()
        self.attach()

    def attach(self, objects: Collection[str] | None = None) -> list[AttachedScript]:
        """Attach the scripts of new vehicles and objects, or only of `objects`; return the new scripts of the scene.

        Raises ParameterError.
        """
        for name, vehicle in self._vehicles.items():
            if name not in self.child_scripts:
                self.child_scripts[name] = ChildScript(vehicle)
                self.child_scripts[name].begin()
        there = {(script.own_script, script.script_type) for script in self.attached}
        added: list[AttachedScript] = []
        for index, entry in enumerate(self._scene.scripts.values()):
            if objects is not None and entry.object not in objects:
                continue
            handle = self._handle(entry, index)
            if handle is None:
                continue
            for kind in (CHILD, CUSTOMIZATION):
                key = self._context.objects[handle].name, kind
                if (entry.script if kind == CHILD else entry.customization) and key not in there:
                    added.append(AttachedScript(entry, kind, handle, self._vehicles, self._context))
                    there.add(key)
        self.attached += added
        self._note_changes(len(added))
        return added

    def _note_changes(self, changes: int) -> None:
        self.changes += changes
        self.is_changed = bool(changes) or self.is_changed

    def _handle(self, entry: AttachedScriptParameters, index: int) -> int | None:
        """Return the handle of a script's object; None if a vehicle added later may have it. Raises ParameterError."""
        objects, name = self._context.objects, entry.object
        if name not in objects and (objects.is_copied(plain(name)) or (plain(name) != name and plain(name) in objects)):
            _LOG.warning(
                "there is no object named '%s' yet: its script starts once a vehicle with such an object is added", name
            )
            return None
        try:
            handle = objects.handle(name)
            if entry.script and any(objects[handle] is vehicle.object for vehicle in self._vehicles.values()):
                raise ValueError(f"'{name}' already has a script, which the key `script` of its vehicle names")
        except ValueError as error:
            place = self._place(("scripts", index, "object"))
            raise ParameterError(f"{place}: scripts/{index}/object: {error}") from None
        return handle

    def detach(self, vehicle: str) -> None:
        """Unload and remove the scripts of a vehicle."""
        for script in self.attached[:]:
            if script.goes_with == vehicle:
                self.attached.remove(script)
                script.leave()
        self.child_scripts.pop(vehicle).leave()

    # ---- changes of objects

    def rename(self, name: str, new: str) -> None:
        """Change the object name of a script, if the object has one."""
        for script in self.attached:
            if script.own_script == name:
                script.own_script = new
                self._context.scripts.rename(name, new, script.script_type)
                self._note_changes(1)

    def end(self, objects: Collection[str]) -> None:
        """Clean up and unload the scripts of objects about to be removed; a running one ends in `follow`."""
        for script in [script for script in self.attached if script.own_script in objects]:
            self.attached.remove(script)
            self._note_changes(1)
            if script.is_busy:
                self.leaving.append(script.split_off())
            else:
                self.clean_up([script])
            script.leave()

    def follow(self, operations: Operations) -> None:
        """Between phases, end the scripts of removed objects that were running, and load those of new objects.

        `operations`: the new scripts' operations on objects.
        """
        self.is_changed = False
        self.clean_up(self.leaving)
        while self.leaving:
            self.leaving.pop().close()
        for new in self.in_order([script for script in self.attached if not script.is_loaded]):
            new.load_script(new.file, operations)

    def of(self, vehicle: str) -> list[AnyScript]:
        """Return the scripts of a vehicle and of its objects, in V-REP's order."""
        return self.in_order([self.child_scripts[vehicle], *(it for it in self.attached if it.goes_with == vehicle)])

    # ---- order of calls

    def all(self) -> Sequence[AnyScript]:
        """Return all scripts in V-REP's order."""
        of_vehicles = tuple(self.child_scripts.values())
        return self.in_order((*of_vehicles, *self.attached)) if self.attached else of_vehicles

    def in_order(self, scripts: Sequence[_Script]) -> list[_Script]:
        """Return the scripts sorted into V-REP's order."""
        return sorted(scripts, key=lambda script: (script.script_type, self._path_to(script.own_script)))

    def _path_to(self, name: str) -> list[int]:
        """Return the handles on the path from the root to an object."""
        objects, path = self._context.objects, []
        current: SceneObject | None = objects[objects.handle(name)]
        while current is not None:
            path.append(objects.handle_of(current))
            current = current.parent
        return path[::-1]

    # ---- cleanup

    def clean_up(self, scripts: Sequence[AnyScript], is_over: bool = False) -> list[ScriptError]:
        """End threads, then call every script's cleanup, even if others fail; return the errors.

        `is_over`: the simulation ends, so that customization scripts are also called before that.
        """
        errors: list[ScriptError] = []
        control = self._context.control
        before = control.is_stopping, control.is_ending
        try:
            control.is_stopping = True
            for _ in range(_LAST_TURNS):
                for hosted in scripts:
                    if hosted.script.threaded:
                        _attempt(hosted.script.take_turn, errors)
            control.is_ending = True
            for hosted in scripts:
                phases = ("afterSimulation",) if is_over and hosted.script_type == CUSTOMIZATION else ()
                for phase in (*phases, "cleanup"):
                    _attempt(partial(hosted.script.call, phase), errors)
        finally:
            control.is_stopping, control.is_ending = before
        return errors


def _attempt(action: Callable[[], None], errors: list[ScriptError]) -> None:
    try:
        action()
    except ScriptError as error:
        errors.append(error)


def raise_first(errors: Sequence[ScriptError]) -> None:
    """Raise the first error, if any, after logging each of the others."""
    for second in errors[1:]:
        LOG.error("%s", second)
    if errors:
        raise errors[0]
