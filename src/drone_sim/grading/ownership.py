"""The objects that a submission may read if the plan says `reads: own`, and the values that it may set.

The values are signals, custom data, parameters, tubes and collections. A value belongs to the scene's scripts unless
the submission has set it last. Tubes and collections belong to the script that has opened or created them.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from typing import Any

from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api import listing
from drone_sim.scripting.api.calls import methods_of
from drone_sim.scripting.api.constants import CONSTANTS, bare
from drone_sim.scripting.api.custom_data import CustomDataFunctions
from drone_sim.scripting.api.image_filters import ImageFilters
from drone_sim.scripting.api.object_collections import CollectionFunctions
from drone_sim.scripting.api.objects import Objects
from drone_sim.scripting.api.ros_functions import RosFunctions
from drone_sim.scripting.api.sensors import EVERY_SENSOR, Sensors
from drone_sim.scripting.api.signals import SignalFunctions, TubeFunctions

_CREATED_KINDS = ("dummy", "path", "script")  # kinds of objects that a script may create
_OBJECT_KEYS = ("object", "relObject")  # of the mapping that describes a motion
_APP, _ALL = CONSTANTS["handle_app"], CONSTANTS["handle_all"]
_CUSTOM_PREFIX, _PATH_PROPERTIES = "customData.", ("customData.PATH", "customData.PATHCTRLPTS")
OnResult = Callable[[Any], None]
# The scene's value that a call would set ('' for none), and a callback for the result.
Verdict = tuple[str, OnResult | None]
Check = Callable[[list[Any]], Verdict]


# ---- objects


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
        scene_object = self._objects.by_handle.get(handle)
        if scene_object is None or handle in self.handles:
            return None
        is_created = handle not in self._initial_handles and scene_object.kind in _CREATED_KINDS
        return None if is_created else scene_object.name


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
            handles = tuple((index, each.default) for index, each in parameters if each.annotation == "Handle")
            handle_arguments.update(dict.fromkeys(names, handles))
    return handle_arguments


# ---- values


class SceneValues:
    """Finds the calls of a submission that would set or clear a value of the scene's scripts."""

    def __init__(self, simulation: Simulation, own_objects: Set[int]):
        """Create this before the simulation's scripts begin; `own_objects` are the handles of the submission's own."""
        self._simulation, context = simulation, simulation.context
        self._objects, self._signals, self._data = context.objects, context.signals, context.data
        self._own_objects = own_objects
        self._own_values: dict[Any, Any] = {}  # values that the submission has set, by their keys
        self._created: set[int] = set()  # handles of the submission's own tubes and collections
        check_tube = functools.partial(self._check_handle, context.tubes, "a tube of another script")
        check_collection = functools.partial(self._check_handle, context.collections, "a collection of another script")
        # Functions that create a tube or collection, and the set to which the handle that they return is added.
        self.creators: Mapping[str, set[int]] = dict.fromkeys(
            ("sim.tubeOpen", *_names(CollectionFunctions, ("createCollection",))), self._created
        )
        self.checks: Mapping[str, Check] = {  # by the names of functions
            **dict.fromkeys(_names(SignalFunctions, ("set", "clear")), self._check_signal),
            **dict.fromkeys(_names(CustomDataFunctions, ("write",)), self._check_data),
            **dict.fromkeys(_names(CustomDataFunctions, ("set", "remove")), self._check_property),
            "sim.persistentDataWrite": lambda arguments: self._check_data([_APP, *arguments]),
            **dict.fromkeys(_names(RosFunctions, ("setParam", "deleteParam")), self._check_parameter),
            **dict.fromkeys(_names(TubeFunctions, ("tubeClose", "tubeWrite", "tubeRead")), check_tube),
            **dict.fromkeys(_names(CollectionFunctions, ("add", "empty", "destroy", "remove")), check_collection),
        }

    def _check_signal(self, arguments: list[Any]) -> Verdict:
        name = arguments[0] if arguments else None
        names = [name] if isinstance(name, str) else self._signals.names()
        return self._check_values({f"the signal {name}": name for name in names}, self._signals.of_name)

    def _check_data(self, arguments: list[Any]) -> Verdict:
        is_complete = len(arguments) > 1
        return self._check_property([arguments[0], f"{_CUSTOM_PREFIX}{arguments[1]}"] if is_complete else [])

    def _check_property(self, arguments: list[Any]) -> Verdict:
        if len(arguments) < 2 or not _is_number(arguments[0]):
            return "", None  # the function itself raises an error
        key = int(arguments[0]), arguments[1]
        scene_object = self._objects.by_handle.get(key[0])
        label = f"{key[1]} of {scene_object.name if scene_object is not None else 'the scene'}"
        if key[1] in _PATH_PROPERTIES and scene_object is not None and key[0] not in self._own_objects:
            return label, None  # scripts would use it as the path's points
        return self._check_values({label: key}, self._data.values.get)

    def _check_parameter(self, arguments: list[Any]) -> Verdict:
        backend = self._simulation.context.backend
        if backend is None or not arguments or not isinstance(arguments[0], str):
            return "", None  # without a backend each script has its own parameters
        names = {vehicle.bus.resolve(arguments[0]) for vehicle in self._simulation.vehicles.values()}
        return self._check_values({f"the parameter {name}": name for name in names}, backend.parameter)

    def _check_values(self, keys: Mapping[str, Any], get_value: Callable[[Any], Any]) -> Verdict:
        """Check values, whose keys are given by their labels for messages."""
        for label, key in keys.items():
            value = get_value(key)
            if value is not None and value != self._own_values.get(key):
                return label, None
        return "", lambda _: self._own_values.update((key, get_value(key)) for key in keys.values())

    def _check_handle(self, existing: Any, label: str, arguments: list[Any]) -> Verdict:
        """Check a call whose first argument is a handle; sim.handle_all means all existing handles."""
        handle = arguments[0] if arguments else None
        handles = [*existing] if handle == _ALL else [handle] if _is_number(handle) and handle in existing else []
        return ("" if self._created.issuperset(handles) else label), None


def _is_number(value: Any) -> bool:
    return type(value) is int or (type(value) is float and math.isfinite(value))


def _names(kind: type, prefixes: tuple[str, ...]) -> Iterator[str]:
    """Return all names, as module.name, of the functions of a class whose methods start with one of the prefixes."""
    return (name for method, _, names in methods_of(kind) if method.__name__.startswith(prefixes) for name in names)
