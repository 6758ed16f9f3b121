"""Permissions of a submission: it may fly, read, print and draw; everything else must be allowed in the plan.

A function is free only if it is listed here. A test lists every function of the API with the action that it needs, so a
new function must be classified before it is free. `rules` checks the effects on the flight, whatever was called.

The scripts of the scene run in the judge's process, with all rights. Therefore a submission calls only those of their
functions that the plan lists (`calls`), runs no text in them, and sets no value that they have set.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from typing import TYPE_CHECKING, Any

from drone_sim.grading.ownership import OwnObjects, SceneValues
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
    motions,
    names,
    object_collections,
    packing,
    ros_functions,
    sensors,
    signals,
    threads,
    vision,
    windows,
    wireless,
)
from drone_sim.scripting.api.calls import methods_of
from drone_sim.scripting.api.constants import CONSTANTS, bare
from drone_sim.scripting.api.ignored import MODULES
from drone_sim.scripting.api.registry import CHILD, Attachment
from drone_sim.scripting.api.simulation import SimulationFunctions
from drone_sim.vehicles.vehicle import Vehicle

if TYPE_CHECKING:
    from drone_sim.grading.plan import Plan  # not at run time: the node starts faster without it

MOVE, PUSH, CHANGE = "move", "push", "change"  # actions that a plan's `allowed` allows
CALL, READ = "call", "read"  # actions that a plan's `calls` and `reads` allow
WRITE, LOAD, OPEN, RUN, PLAN = "write", "load", "open", "run", "plan"  # actions that no plan allows
_BY_PLAN = (MOVE, PUSH, CHANGE)
MAX_TRIED = 20  # forbidden calls listed in a result
_FREE_CLASSES: tuple[type, ...] = (
    custom_data.CustomDataFunctions,
    distances.DistanceFunctions,
    drawings.DrawingFunctions,
    graphs.GraphFunctions,
    image_filters.ImageFilters,
    matrices.Matrices,
    matrices.Poses,
    motions.TrajectoryFunctions,
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
    vision.VisionSensors,
    windows.Dialogs,
    windows.Views,
    wireless.Wireless,
)
# Functions of other classes that are free: they end the flight, or create nothing but frames.
_FREE = [
    *("stopSimulation", "addLog", "addStatusbarMessage", "createDummy", "createPath"),
    "resamplePath",
    # of remote clients: they control when the simulation starts and steps, and do nothing to the world
    *("startSimulation", "setStepping", "acquireLock", "releaseLock", "handleExtCalls", "testCB"),
]
_READING_PREFIXES = ("get", "is", "check", "read")  # of the names of functions that only read
# The first argument is the handle of an object; for a frame of the script's own, they need no action.
_MOVING = [
    *("setObjectPosition", "setObjectOrientation", "setObjectQuaternion", "setObjectPose", "setObjectMatrix"),
    *("setObjectParent", "moveToObject", "moveToPosition", "rmlMoveToPosition", "followPath"),
]
_MOVING_ALWAYS = [
    *("setPathPosition", "setJointForce", "setJointInterval", "setJointMode", "setJointTargetForce"),
    *("setJointTargetPosition", "setJointTargetVelocity", "setSphericalJointMatrix", "moveToJointPositions"),
    *("rmlMoveToJointPositions", "resetDynamicObject"),
]
_MOVING_BY_MAPPING = [  # the first argument is a mapping that may name an object or joints
    *("moveToConfig", "moveToConfig_init", "moveToConfig_step", "moveToConfig_cleanup"),
    *("moveToPose", "moveToPose_init"),
]
_ACTIONS = {
    **dict.fromkeys(_MOVING_ALWAYS, MOVE),
    **dict.fromkeys(("addForce", "addForceAndTorque"), PUSH),
    "saveModel": WRITE,
    "loadModel": LOAD,  # a model brings scripts, which run in the judge's process
    "callScriptFunction": CALL,
    "executeScriptString": RUN,
}
_PORT_PREFIXES = ("simRemoteApi.", "sim.extRemoteApi")  # of functions that open a port for clients
_SUBJECTS = {
    LOAD: "a model",
    OPEN: "a port",
    RUN: "a text in a script",
    PLAN: "a path in the judge's process",
}  # for messages
_SETTING_PARAMETERS = ("setScriptSimulationParameter", "setUserParameter")
_PROPELLER_PARAMETER = "particleVelocity"
_SELF = CONSTANTS["handle_self"]
_FRAME_CHILDREN = ("dummy", "path", "camera", "vision_sensor", "script")  # kinds that may be children of a frame
GetAction = Callable[[list[Any]], str | None]


class Forbidden(ValueError):
    """A submission has made a call that the plan does not allow; one line."""


class Actions:
    """The actions (the constants above) that calls of the script API need."""

    def __init__(
        self, simulation: Simulation, flown: Iterable[Vehicle], scripts: Set[str], frames: Iterable[SceneObject] = ()
    ):
        """The caller flies the vehicles `flown`, is the scripts of the objects `scripts`, and may move `frames`."""
        self._objects, self._scripts = simulation.context.objects, simulation.context.scripts
        self._flown, self._own = list(flown), scripts
        self._propellers = {name for vehicle in self._flown for name in vehicle.propulsion.script_parameters}
        self._frames = {self._objects.handle_of(frame) for frame in frames}  # cache of handles of frames
        self._settable: set[tuple[int, str]] = set()  # cache of parameters that need no action
        rules: tuple[tuple[Sequence[str], GetAction], ...] = (
            (_MOVING, self._object_action),
            (_SETTING_PARAMETERS, self._parameter_action),
            (_MOVING_BY_MAPPING, self._motion_action),
            (("setJointPosition",), self._joint_action),
        )
        by_name = {f"sim.{name}": get_action for names, get_action in rules for name in names}
        self._by_arguments = {name: by_name[own] for name, own in _declared_names().items() if own in by_name}

    def action_of(self, function: str, arguments: list[Any]) -> str | None:
        """Return the action that a call needs, None for a free call."""
        get_action = self._by_arguments.get(function)
        return get_action(arguments) if get_action is not None else _function_action(function)

    def subject_of(self, function: str, arguments: list[Any]) -> str:
        """Return the thing that a call acts on, in words for a message."""
        action = _function_action(function)
        if action in _SUBJECTS:
            return _SUBJECTS[action]
        if action == CALL and len(arguments) > 1:
            name, at, owner = str(arguments[0]).partition("@")
            return f"{name} of {f'the script of {owner}' if at else self.subject_of('', arguments[1:])}"
        name = function.partition(".")[2]
        if name.startswith(("create", "load")) or hasattr(SimulationFunctions, name):
            return "the scene"  # the first argument is no handle
        scene_object = self._first_object(arguments)
        if scene_object is not None:
            return scene_object.name
        script = self._scripts.by_handle.get(arguments[0]) if arguments and _is_handle(arguments[0]) else None
        return f"the script of {script.name}" if script is not None else "the scene"

    def _first_object(self, arguments: list[Any]) -> SceneObject | None:
        """Return the object whose handle is the first argument."""
        return self._objects.by_handle.get(bare(arguments[0])) if arguments and _is_handle(arguments[0]) else None

    # ---- actions that depend on the arguments

    def _object_action(self, arguments: list[Any]) -> str | None:
        """Return the action for moving an object: none for a frame."""
        if arguments and type(arguments[0]) is int and arguments[0] in self._frames:
            return None
        scene_object = self._first_object(arguments)
        if scene_object is None or not self._is_frame(scene_object):
            return MOVE
        self._frames.add(self._objects.handle_of(scene_object))
        return None

    def _is_frame(self, scene_object: SceneObject) -> bool:
        """Return whether an object is a dummy or path without a body, and all its descendants are frames as well.

        Frames are the kinds in _FRAME_CHILDREN.
        """
        if scene_object.kind not in ("dummy", "path") or scene_object.body is not None:
            return False
        others = self._objects.by_handle.values()
        return all(other.kind in _FRAME_CHILDREN for other in others if other.is_descendant_of(scene_object))

    def _joint_action(self, arguments: list[Any]) -> str | None:
        """Return the action for turning a joint: none for a flown vehicle's propeller, which only shows its blades."""
        scene_object = self._first_object(arguments)
        is_blade = scene_object is not None and any(
            vehicle.propulsion.blades.has(scene_object.name) for vehicle in self._flown
        )
        return None if is_blade else MOVE

    def _motion_action(self, arguments: list[Any]) -> str | None:
        """Return the action for a motion: none for a frame, or if it names no object and no joints."""
        motion = arguments[0] if arguments else None
        if not isinstance(motion, Mapping):
            return None
        moved = motion.get("object")
        return MOVE if motion.get("joints") else None if moved is None else self._object_action([moved])

    def _parameter_action(self, arguments: list[Any]) -> str | None:
        """Return the action for setting a script's parameter: none for its own, or for the speed of its propellers."""
        if len(arguments) < 2:
            return CHANGE
        handle, name, *_ = arguments
        if type(name) is not str or not _is_handle(handle):
            return CHANGE
        if (handle == _SELF and self._own) or (handle, name) in self._settable:
            return None
        owner = self._script_owner(handle, arguments)
        if owner in self._own or (owner in self._propellers and name == _PROPELLER_PARAMETER):
            self._settable.add((handle, name))
            return None
        return CHANGE

    def _script_owner(self, handle: int, arguments: list[Any]) -> str:
        """Return the name of the object whose script a handle (of the script or of the object) means, '' for none."""
        script = self._scripts.by_handle.get(handle)
        if script is not None:
            return script.name if script.kind == CHILD else ""
        scene_object = self._first_object(arguments)
        if scene_object is not None and scene_object.kind == "script":
            scene_object = scene_object.parent
        return scene_object.name if scene_object is not None and scene_object.name in self._scripts else ""


class Permissions(Actions):
    """Checks each call of a submission before it is executed, and records the forbidden ones."""

    def __init__(self, plan: Plan, simulation: Simulation, submission: str, goals: Iterable[int] = ()):
        """Create this before the scripts are loaded; the script `submission` flies the vehicles without an own script.

        Only the scene's scripts may move the objects with the handles `goals`, because the plan's criteria name them.
        """
        own = [
            vehicle
            for vehicle in simulation.vehicles.values()
            if script_of(vehicle.parameters, simulation.parameters, submission) == submission
        ]
        names = {vehicle.object_name for vehicle in own}
        super().__init__(simulation, own, names)
        self._allowed, self._calls, self._simulation = {*plan.allowed}, {*plan.calls}, simulation
        own_objects = OwnObjects(simulation, names)
        self._readable = own_objects if plan.reads == "own" else None
        self._own_handles = {*own_objects.handles}
        self._goals = {*goals}.difference(self._objects.handle_of(vehicle.object) for vehicle in own)
        self._values = SceneValues(simulation, self._own_handles)
        creators = {"sim.createDummy": self._own_handles, "sim.createPath": self._own_handles, **self._values.creators}
        self._add_created = {function: handles.add for function, handles in creators.items()}
        for function in ("sim.callScriptFunction", "sim.executeScriptString"):  # `_permit_call` decides
            self._by_arguments[function] = lambda _arguments: None
        self._scripts.permit = self._permit_call
        self.tried: list[str] = []  # a line for the first forbidden call of each action and subject
        self._refused: set[tuple[str, str]] = set()

    def __call__(self, function: str, arguments: list[Any]) -> Callable[[Any], None] | None:
        """Raise Forbidden for a call that the submission may not make; return a callback for its result, or None."""
        action = self.action_of(function, arguments)
        if action is not None:
            goal = next(self._moved_goals(arguments), None)
            if goal is not None:
                self._refuse(function, action, goal.name, ": a criterion names it")
            self._require(function, action, self.subject_of(function, arguments))
        other = self._readable.foreign_object(function, arguments) if self._readable is not None else None
        if other is not None:
            self._refuse(function, READ, other, " (reads: all would)")
        check = self._values.checks.get(function)
        if check is None:
            return self._add_created.get(function)
        value, on_result = check(arguments)
        if value:
            self._require(function, CHANGE, value)
        return on_result

    def _require(self, function: str, action: str, subject: str) -> None:
        if action not in self._allowed:
            self._refuse(function, action, subject, f" (allowed: [{action}] would)" if action in _BY_PLAN else "")

    def _is_own(self, script: Attachment) -> bool:
        return script.kind == CHILD and script.name in self._own

    def _permit_call(self, caller: Attachment, callee: Attachment, name: str) -> None:
        """Raise Forbidden if the submission may not call a function of a script, or run a text in it (`name` '')."""
        if not self._is_own(caller) or self._is_own(callee):
            return
        owner = f"the script of {callee.name}"
        if not name:
            self._refuse("sim.executeScriptString", RUN, f"a text in {owner}", "")
        subject = f"{printable(name):.{MAX_NAME}} of {owner}"
        if name not in self._calls:
            self._refuse("sim.callScriptFunction", CALL, subject, " (calls: [its name] would)")
        if callee.script is not None and not callee.script.defines(name):
            self._refuse("sim.callScriptFunction", CALL, subject, ": its own file does not define such a function")

    def _refuse(self, function: str, action: str, subject: str, reason: str) -> None:
        if (action, subject) not in self._refused and len(self.tried) < MAX_TRIED:
            self._refused.add((action, subject))
            self.tried.append(f"tried to {action} {subject} at {self._simulation.time:.2f} s ({function})")
        raise Forbidden(f"the plan does not allow a script to {action} {subject}{reason}")

    def _is_frame(self, scene_object: SceneObject) -> bool:
        """Return whether an object is a frame of the submission's vehicle, or one that the submission has created."""
        is_own = self._objects.handle_of(scene_object) in self._own_handles
        return is_own and super()._is_frame(scene_object) and not any(self._goals_on(scene_object))

    def _moved_goals(self, arguments: list[Any]) -> Iterator[SceneObject]:
        """Yield the goals that a call moves or changes: those that it names, and their descendants.

        A goal on a vehicle of the submission may move with the vehicle.
        """
        for handle in _handles(arguments[:1]):
            scene_object = self._objects.by_handle.get(bare(handle))
            if scene_object is not None:
                is_carrier = any(scene_object.is_part_of(vehicle.object) for vehicle in self._flown)
                yield from (goal for goal in self._goals_on(scene_object) if goal is scene_object or not is_carrier)

    def _goals_on(self, scene_object: SceneObject) -> Iterator[SceneObject]:
        """Yield the goals that are an object, or a descendant of it."""
        goals = filter(None, map(self._objects.by_handle.get, self._goals))
        return (goal for goal in goals if goal is scene_object or goal.is_descendant_of(scene_object))


def _handles(values: Iterable[Any]) -> Iterator[int]:
    """Yield the handles in the first argument of a call: a handle, a list of handles, or a motion's mapping."""
    for value in values:
        if _is_handle(value):
            yield int(value)
        elif isinstance(value, Mapping):
            yield from _handles((value.get("object"), value.get("joints")))
        elif isinstance(value, (list, tuple)):
            yield from (int(each) for each in value if _is_handle(each))


def _is_handle(value: Any) -> bool:
    return type(value) is int or (type(value) is float and value.is_integer())


def _function_action(function: str) -> str | None:
    """Return the action that a function needs, whatever its arguments are; None for a free function."""
    if function in free_functions():
        return None
    if function.startswith(_PORT_PREFIXES):
        return OPEN
    if function.startswith("simOMPL."):
        return PLAN
    return _ACTIONS.get(_declared_names().get(function, function).partition(".")[2], CHANGE)


@functools.cache
def free_functions() -> frozenset[str]:
    """Return the functions that a submission may always call, each as module.name."""
    functions = {
        f"{module}.{name}" for module, groups in MODULES.items() for group in groups for name in group.functions
    }
    free = {f"sim.{name}" for name in _FREE}
    for kind in (*_FREE_CLASSES, *listing.classes_of_sim(), ClientControl):
        for _, own, all_names in methods_of(kind):
            if own in free or kind in _FREE_CLASSES or own.partition(".")[2].startswith(_READING_PREFIXES):
                functions.update(all_names)
    return frozenset(functions)


@functools.cache
def _declared_names() -> dict[str, str]:
    """Return the name of the method behind each function of the API, by all names of the function; as module.name."""
    kinds = (*listing.classes_of_sim(), *_FREE_CLASSES)
    return {name: own for kind in kinds for _, own, all_names in methods_of(kind) for name in all_names}
