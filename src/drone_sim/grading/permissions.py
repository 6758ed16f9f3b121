"""What a submission may call: it may fly, read, print and draw; everything else has to be allowed in the plan.

A function is free only if it is listed here; one that is not listed is not free. A test lists every function of the
API with what it needs, so a new function is decided on before it is free. `rules` checks the effects on the flight,
whatever was called.

The scripts of the scene run in the judge's process, with all rights. So a submission calls only those of their
functions that the plan lists (`calls`), runs no text in them, and sets no value that they have set.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from typing import TYPE_CHECKING, Any

from drone_sim.grading.own_objects import OwnObjects
from drone_sim.grading.scene_values import SceneValues
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.message_text import MAX_NAME, printable
from drone_sim.remote.control import ClientControl
from drone_sim.run.simulation import Simulation
from drone_sim.run.simulation_setup import script_of
from drone_sim.scripting.api import (
    custom_data,
    distances,
    drawings,
    graphs,
    image_filters,
    listing,
    matrices,
    names,
    object_collections,
    packing,
    ros_functions,
    sensors,
    signals,
    threads,
    trajectories,
    vision,
    windows,
    wireless,
)
from drone_sim.scripting.api.calls import declaration_of
from drone_sim.scripting.api.constants import CONSTANTS, bare
from drone_sim.scripting.api.ignored import MODULES
from drone_sim.scripting.api.registry import Attachment
from drone_sim.scripting.api.simulation import SimulationFunctions
from drone_sim.vehicles.vehicle import Vehicle

if TYPE_CHECKING:
    from drone_sim.grading.plan import Plan  # which the node, and its start, can do without

MOVE, PUSH, CHANGE = "move", "push", "change"  # the words of a plan's `allowed`
CALL, READ = "call", "read"  # what the plan's `calls` and `reads` say
WRITE, LOAD, OPEN, RUN = "write", "load", "open", "run"  # no plan allows these
_BY_PLAN = (MOVE, PUSH, CHANGE)
MOST_TRIED = 20  # that a result tells of
_FREE_CLASSES: tuple[type, ...] = (
    custom_data.CustomDataFunctions,
    distances.DistanceFunctions,
    drawings.DrawingFunctions,
    graphs.GraphFunctions,
    image_filters.ImageFilters,
    matrices.Matrices,
    matrices.Poses,
    names.NameFunctions,
    object_collections.CollectionFunctions,
    packing.Bits,
    packing.Packing,
    packing.Tables,
    ros_functions.RosFunctions,
    ros_functions.ServiceFunctions,
    ros_functions.TopicFunctions,
    sensors.ProximitySensors,
    sensors.Sensors,
    signals.SignalFunctions,
    signals.TubeFunctions,
    threads.Threads,
    trajectories.TrajectoryFunctions,
    vision.VisionSensors,
    windows.Dialogs,
    windows.Views,
    wireless.Wireless,
)
# Beside these: what ends the flight, or makes nothing but frames.
_FREE = [
    *("stopSimulation", "addLog", "addStatusbarMessage", "createDummy", "createPath"),
    "resamplePath",
    # of clients outside: when the simulation begins, and steps, which does nothing to the world
    *("startSimulation", "setStepping", "acquireLock", "releaseLock", "handleExtCalls", "testCB"),
]
_READING = ("get", "is", "check", "read")  # what the names of functions begin with that only read
# Of an object, by its handle, which comes first; a script's own marks are its own.
_MOVING = [
    "setObjectPosition",
    "setObjectOrientation",
    "setObjectQuaternion",
    "setObjectPose",
    "setObjectMatrix",
    "setObjectParent",
    "moveToObject",
    "moveToPosition",
    "rmlMoveToPosition",
    "followPath",
]
_MOVING_ALWAYS = [
    "setPathPosition",
    "setJointForce",
    "setJointInterval",
    "setJointMode",
    "setJointTargetForce",
    "setJointTargetPosition",
    "setJointTargetVelocity",
    "setSphericalJointMatrix",
    "moveToJointPositions",
    "rmlMoveToJointPositions",
    "resetDynamicObject",
]
_BY_PARAMETERS = [
    "moveToConfig",
    "moveToConfig_init",
    "moveToConfig_step",
    "moveToConfig_cleanup",
    "moveToPose",
    "moveToPose_init",
]
_ACTIONS = {
    **dict.fromkeys(_MOVING_ALWAYS, MOVE),
    **dict.fromkeys(("addForce", "addForceAndTorque"), PUSH),
    "saveModel": WRITE,
    "loadModel": LOAD,  # a model brings scripts, which run in the judge's process
    "callScriptFunction": CALL,
    "executeScriptString": RUN,
}
_PORTS = ("simRemoteApi.", "sim.extRemoteApi")  # what functions begin with that open a port for clients
_WHOLE = {LOAD: "a model", OPEN: "a port", RUN: "a text in a script"}  # what such a call is about
_PARAMETERS = ("setScriptSimulationParameter", "setUserParameter")
_DRIVES = "particleVelocity"
_SELF = CONSTANTS["handle_self"]
_FRAMES = ("dummy", "path", "camera", "vision_sensor", "script")  # what may hang on a mark
Look = Callable[[list[Any]], str | None]


class Forbidden(ValueError):
    """A submission has called what the plan does not allow; one line."""


class Actions:
    """Tells what a call needs: one of the words above, or nothing."""

    def __init__(
        self, simulation: Simulation, flown: Iterable[Vehicle], scripts: Set[str], marks: Iterable[SceneObject] = ()
    ):
        """The caller flies the vehicles `flown`, is the scripts of the objects `scripts`, and may move `marks`."""
        self._objects, self._scripts = simulation.context.objects, simulation.context.scripts
        self._flown, self._own = list(flown), scripts
        self._propellers = {name for one in self._flown for name in one.propulsion.script_parameters}
        self._marks = {self._objects.handle_of(one) for one in marks}  # handles that are known to be marks'
        self._settable: set[tuple[int, str]] = set()  # parameters that are known to be free
        looks: tuple[tuple[Sequence[str], Look], ...] = (
            (_MOVING, self._of_object),
            (_PARAMETERS, self._of_parameter),
            (_BY_PARAMETERS, self._of_motion),
            (("setJointPosition",), self._of_joint),
        )
        by_name = {f"sim.{name}": look for named, look in looks for name in named}
        self._looks = {name: by_name[own] for name, own in _own_names().items() if own in by_name}

    def of(self, function: str, arguments: list[Any]) -> str | None:
        """Return what a call needs, None for nothing."""
        look = self._looks.get(function)
        return look(arguments) if look is not None else _action_of(function)

    def what(self, function: str, arguments: list[Any]) -> str:
        """Return what a call is about, as a person calls it."""
        action = _action_of(function)
        if action in _WHOLE:
            return _WHOLE[action]
        if action == CALL and len(arguments) > 1:
            name, at, of = str(arguments[0]).partition("@")
            return f"{name} of {f'the script of {of}' if at else self.what('', arguments[1:])}"
        if _is_of_scene(function):
            return "the scene"
        one = self._object(arguments)
        if one is not None:
            return one.name
        script = self._scripts.get(arguments[0]) if arguments and _is_handle(arguments[0]) else None
        return f"the script of {script.name}" if script is not None else "the scene"

    def _object(self, arguments: list[Any]) -> SceneObject | None:
        """Return the object whose handle comes first."""
        return self._objects.get(bare(arguments[0])) if arguments and _is_handle(arguments[0]) else None

    # ---- what depends on what it is done to

    def _of_object(self, arguments: list[Any]) -> str | None:
        """Return what moving an object needs: nothing, of a mark."""
        if arguments and type(arguments[0]) is int and arguments[0] in self._marks:
            return None
        one = self._object(arguments)
        if one is None or not self._is_mark(one):
            return MOVE
        self._marks.add(self._objects.handle_of(one))
        return None

    def _is_mark(self, one: SceneObject) -> bool:
        """Tell whether an object is a frame for a script's own use: it is not solid and carries nothing solid."""
        if one.kind not in ("dummy", "path") or one.body is not None:
            return False
        below = (
            other
            for other in map(self._objects.get, self._objects)
            if other is not None and other.is_descendant_of(one)
        )
        return all(other.kind in _FRAMES for other in below)

    def _of_joint(self, arguments: list[Any]) -> str | None:
        """Return what turning a joint needs: nothing, of a vehicle's own propeller, whose blades are seen to turn."""
        one = self._object(arguments)
        is_blade = one is not None and any(vehicle.propulsion.blades.has(one.name) for vehicle in self._flown)
        return None if is_blade else MOVE

    def _of_motion(self, arguments: list[Any]) -> str | None:
        """Return what a motion needs: nothing, of a mark, or of mere numbers."""
        given = arguments[0] if arguments else None
        if not isinstance(given, Mapping):
            return None
        moved = given.get("object")
        return MOVE if given.get("joints") else None if moved is None else self._of_object([moved])

    def _of_parameter(self, arguments: list[Any]) -> str | None:
        """Return what setting a script's parameter needs: nothing, of its own, or of how fast a propeller turns."""
        if len(arguments) < 2:
            return CHANGE
        handle, name, *_ = arguments
        if type(name) is not str or not _is_handle(handle):
            return CHANGE
        if (handle == _SELF and self._own) or (handle, name) in self._settable:
            return None
        script = self._script(handle, arguments)
        if script in self._own or (script in self._propellers and name == _DRIVES):
            self._settable.add((handle, name))
            return None
        return CHANGE

    def _script(self, handle: int, arguments: list[Any]) -> str:
        """Return the object of the script that a handle means, its own or its object's; '' for none."""
        script = self._scripts.get(handle)
        if script is not None:
            return script.name
        one = self._object(arguments)
        if one is not None and one.kind == "script":
            one = one.parent
        return one.name if one is not None and one.name in self._scripts else ""


class Permissions(Actions):
    """Looks at each call of a submission before it is carried out, and keeps what was tried."""

    def __init__(self, plan: Plan, simulation: Simulation, submission: str, goals: Iterable[int] = ()):
        """Hold a `plan` against a `simulation`, in which the script `submission` flies what has none of its own.

        Nobody but the scene's own scripts may move the objects of the handles `goals`: the plan's criteria name them.
        """
        own = [
            one
            for one in simulation.vehicles.values()
            if script_of(one.parameters, simulation.parameters, submission) == submission
        ]
        names = {one.object_name for one in own}
        super().__init__(simulation, own, names)
        self._allowed, self._calls, self._simulation = {*plan.allowed}, {*plan.calls}, simulation
        own_objects = OwnObjects(simulation, names)
        self._readable = own_objects if plan.reads == "own" else None
        self._own_handles = {*own_objects.handles}
        self._goals = {*goals}.difference(self._objects.handle_of(one.object) for one in own)
        self._values = SceneValues(simulation, self._own_handles)
        made = {"sim.createDummy": self._own_handles, "sim.createPath": self._own_handles, **self._values.makes}
        self._makes = {function: handles.add for function, handles in made.items()}
        for decided in ("sim.callScriptFunction", "sim.executeScriptString"):  # by `_permit_call`
            self._looks[decided] = _nothing
        self._scripts.permit = self._permit_call
        self.tried: list[str] = []  # in one line each; the first time of each thing that was tried with each object
        self._known: set[tuple[str, str]] = set()

    def __call__(self, function: str, arguments: list[Any]) -> Callable[[Any], None] | None:
        """Raise Forbidden for a call that the submission may not make; return what is to be told its result."""
        action = self.of(function, arguments)
        if action is not None:
            goal = next(self._goals_moved(arguments), None)
            if goal is not None:
                self._refuse(function, action, goal.name, ": a criterion names it")
            self._demand(function, action, self.what(function, arguments))
        other = self._readable.other_in(function, arguments) if self._readable is not None else None
        if other is not None:
            self._refuse(function, READ, other, " (reads: all would)")
        look = self._values.looks.get(function)
        if look is None:
            return self._makes.get(function)
        value, done = look(arguments)
        if value:
            self._demand(function, CHANGE, value)
        return done

    def _demand(self, function: str, action: str, what: str) -> None:
        if action not in self._allowed:
            self._refuse(function, action, what, f" (allowed: [{action}] would)" if action in _BY_PLAN else "")

    def _permit_call(self, caller: Attachment, callee: Attachment, name: str) -> None:
        """Raise Forbidden if the submission may not call a function of a script, or run a text in it (`name` '')."""
        if caller.name not in self._own or callee.name in self._own:
            return
        of = f"the script of {callee.name}"
        if not name:
            self._refuse("sim.executeScriptString", RUN, f"a text in {of}", "")
        what = f"{printable(name):.{MAX_NAME}} of {of}"
        if name not in self._calls:
            self._refuse("sim.callScriptFunction", CALL, what, " (calls: [its name] would)")
        if callee.script is not None and not callee.script.defines(name):
            self._refuse("sim.callScriptFunction", CALL, what, ": its own file does not define such a function")

    def _refuse(self, function: str, verb: str, what: str, why: str) -> None:
        if (verb, what) not in self._known and len(self.tried) < MOST_TRIED:
            self._known.add((verb, what))
            self.tried.append(f"tried to {verb} {what} at {self._simulation.time:.2f} s ({function})")
        raise Forbidden(f"the plan does not allow a script to {verb} {what}{why}")

    def _is_mark(self, one: SceneObject) -> bool:
        """Return whether an object is a frame of the submission's own: of its vehicle, or one that it has made."""
        is_own = self._objects.handle_of(one) in self._own_handles
        return is_own and super()._is_mark(one) and not any(self._goals_at(one))

    def _goals_moved(self, arguments: list[Any]) -> Iterator[SceneObject]:
        """Yield the goals that a call moves or changes: those that it names, and those that are children of these.

        A goal on a vehicle of the submission may be carried along with the vehicle.
        """
        for handle in _handles(arguments[:1]):
            one = self._objects.get(bare(handle))
            if one is not None:
                is_carrier = any(one.is_part_of(vehicle.object) for vehicle in self._flown)
                yield from (goal for goal in self._goals_at(one) if goal is one or not is_carrier)

    def _goals_at(self, one: SceneObject) -> Iterator[SceneObject]:
        """Yield the goals that are an object, or that it carries."""
        goals = filter(None, map(self._objects.get, self._goals))
        return (goal for goal in goals if goal is one or goal.is_descendant_of(one))


def _handles(values: Iterable[Any]) -> Iterator[int]:
    """Yield the handles in the first argument of a call: it is a handle, a list of them, or what a motion is told."""
    for one in values:
        if _is_handle(one):
            yield int(one)
        elif isinstance(one, Mapping):
            yield from _handles((one.get("object"), one.get("joints")))
        elif isinstance(one, (list, tuple)):
            yield from (int(each) for each in one if _is_handle(each))


def _nothing(_arguments: list[Any]) -> None:
    pass


def _is_of_scene(function: str) -> bool:
    """Tell whether what comes first in a call is not the handle of an object, or of a script."""
    name = function.partition(".")[2]
    return name.startswith(("create", "load")) or hasattr(SimulationFunctions, name)


def _is_handle(value: Any) -> bool:
    return type(value) is int or (type(value) is float and value.is_integer())


def _action_of(function: str) -> str | None:
    """Return what a function needs, None for nothing."""
    if function in free():
        return None
    if function.startswith(_PORTS):
        return OPEN
    return _ACTIONS.get(_own_names().get(function, function).partition(".")[2], CHANGE)


@functools.cache
def free() -> frozenset[str]:
    """Return the functions that are free, each as module.name."""
    found = {f"{module}.{name}" for module, groups in MODULES.items() for one in groups for name in one.functions}
    own = {f"sim.{name}" for name in _FREE}
    for kind in (*_FREE_CLASSES, *listing.classes_of_sim(), ClientControl):
        names = _names_of(kind)
        found.update(
            name
            for name, written in names.items()
            if written in own or kind in _FREE_CLASSES or written.partition(".")[2].startswith(_READING)
        )
    return frozenset(found)


@functools.cache
def _own_names() -> dict[str, str]:
    """Return the name under which each function of the API is written, by all of its names; each as module.name."""
    return {name: own for kind in (*listing.classes_of_sim(), *_FREE_CLASSES) for name, own in _names_of(kind).items()}


def _names_of(kind: type) -> dict[str, str]:
    found = {}
    for attribute in vars(kind).values():
        declaration = declaration_of(attribute)
        if declaration:
            own = f"{declaration.module}.{attribute.__name__}"
            found.update({f"{declaration.module}.{name}": own for name in declaration.names})
    return found
