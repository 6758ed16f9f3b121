"""Check that a submission does not set or clear the values of the scene's scripts.

These values are signals, custom data, parameters, tubes and collections. A value belongs to the scene's scripts unless
the submission has set it last. Tubes and collections belong to the script that has opened or created them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Set
from typing import Any

from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.calls import methods_of
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.custom_data import CustomDataFunctions
from drone_sim.scripting.api.object_collections import CollectionFunctions
from drone_sim.scripting.api.ros_functions import RosFunctions
from drone_sim.scripting.api.signals import SignalFunctions, TubeFunctions

_APP, _ALL = CONSTANTS["handle_app"], CONSTANTS["handle_all"]
_CUSTOM_PREFIX, _PATH_PROPERTIES = "customData.", ("customData.PATH", "customData.PATHCTRLPTS")
OnResult = Callable[[Any], None]
# The scene's value that a call would set ('' for none), and a callback for the result.
Verdict = tuple[str, OnResult | None]
Check = Callable[[list[Any]], Verdict]


class SceneValues:
    """Finds the calls of a submission that would set or clear a value of the scene's scripts."""

    def __init__(self, simulation: Simulation, own_objects: Set[int]):
        """Create this before the simulation's scripts begin; `own_objects` are the handles of the submission's own."""
        self._simulation, context = simulation, simulation.context
        self._objects, self._signals, self._data = context.objects, context.signals, context.data
        self._own_objects = own_objects
        self._own_values: dict[Any, Any] = {}  # values that the submission has set, by their keys
        self._created: set[int] = set()  # handles of the submission's own tubes and collections
        self._tubes, self._collections = context.tubes, context.collections
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
            **dict.fromkeys(_names(TubeFunctions, ("tubeClose", "tubeWrite", "tubeRead")), self._check_tube),
            **dict.fromkeys(_names(CollectionFunctions, ("add", "empty", "destroy", "remove")), self._check_collection),
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
        scene_object = self._objects.get(key[0])
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

    def _check_tube(self, arguments: list[Any]) -> Verdict:
        return self._check_handle(arguments, self._tubes, "a tube of another script")

    def _check_collection(self, arguments: list[Any]) -> Verdict:
        return self._check_handle(arguments, self._collections, "a collection of another script")

    def _check_handle(self, arguments: list[Any], existing: Any, label: str) -> Verdict:
        """Check a call whose first argument is a handle; sim.handle_all means all existing handles."""
        handle = arguments[0] if arguments else None
        handles = [*existing] if handle == _ALL else [handle] if _is_number(handle) and handle in existing else []
        return ("" if self._created.issuperset(handles) else label), None


def _is_number(value: Any) -> bool:
    return type(value) is int or (type(value) is float and math.isfinite(value))


def _names(kind: type, prefixes: tuple[str, ...]) -> Iterator[str]:
    """Return all names, as module.name, of the functions of a class whose methods start with one of the prefixes."""
    return (name for method, _, names in methods_of(kind) if method.__name__.startswith(prefixes) for name in names)
