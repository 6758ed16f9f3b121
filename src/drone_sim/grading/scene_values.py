"""Values that scripts share: signals, custom data, parameters, tubes, collections. Some belong to the scene's scripts.

A submission may not set these. A value belongs to the scene's scripts if it is not what the submission has left there.
Tubes and collections belong to the script that has opened or made them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from typing import Any

from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.calls import declaration_of
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.custom_data import CustomDataFunctions
from drone_sim.scripting.api.object_collections import CollectionFunctions
from drone_sim.scripting.api.ros_functions import RosFunctions
from drone_sim.scripting.api.signals import SignalFunctions, TubeFunctions

_APP, _ALL = CONSTANTS["handle_app"], CONSTANTS["handle_all"]
_CUSTOM, _PATHS = "customData.", ("customData.PATH", "customData.PATHCTRLPTS")
Done = Callable[[Any], None]  # is told the result of a call
Look = Callable[[list[Any]], tuple[str, Done | None]]


class SceneValues:
    """Tells which calls of a submission would set or clear a value of the scene's scripts."""

    def __init__(self, simulation: Simulation, own_objects: Set[int]):
        """Take the simulation before its scripts begin; `own_objects` are the handles of the submission's own."""
        self._simulation, context = simulation, simulation.context
        self._objects, self._signals, self._data = context.objects, context.signals, context.data
        self._left: dict[Any, Any] = {}  # what the submission has left, by the key of a value
        self._own_objects = own_objects
        self._made: set[int] = set()  # handles of the submission's own tubes and collections
        self._tubes, self._collections = context.tubes, context.collections
        self.makes: Mapping[str, set[int]] = dict.fromkeys(
            ("sim.tubeOpen", *_names(CollectionFunctions, ("createCollection",))), self._made
        )
        # By the names of functions: each returns the value of the scene's that a call would set ('' for none), and a
        # function that is to be told the result.
        self.looks: Mapping[str, Look] = {
            **dict.fromkeys(_names(SignalFunctions, ("set", "clear")), self._of_signal),
            **dict.fromkeys(_names(CustomDataFunctions, ("write",)), self._of_data),
            **dict.fromkeys(_names(CustomDataFunctions, ("set", "remove")), self._of_property),
            "sim.persistentDataWrite": lambda given: self._of_data([_APP, *given]),
            **dict.fromkeys(_names(RosFunctions, ("setParam", "deleteParam")), self._of_parameter),
            **dict.fromkeys(_names(TubeFunctions, ("tubeClose", "tubeWrite", "tubeRead")), self._of_tube),
            **dict.fromkeys(_names(CollectionFunctions, ("add", "empty", "destroy", "remove")), self._of_collection),
        }

    def _of_signal(self, given: list[Any]) -> tuple[str, Done | None]:
        name = given[0] if given else None
        names = [name] if isinstance(name, str) else self._signals.names()
        return self._of("the signal {}", {one: one for one in names}, self._signals.of_name)

    def _of_data(self, given: list[Any]) -> tuple[str, Done | None]:
        return self._of_property([given[0], f"{_CUSTOM}{given[1]}"] if len(given) > 1 else [])

    def _of_property(self, given: list[Any]) -> tuple[str, Done | None]:
        if len(given) < 2 or not _is_number(given[0]):
            return "", None  # the function itself says what is wrong
        key = int(given[0]), given[1]
        one = self._objects.get(key[0])
        shown = f"{key[1]} of {one.name if one is not None else 'the scene'}"
        if key[1] in _PATHS and one is not None and key[0] not in self._own_objects:
            return shown, None  # scripts would take it for the path's own points
        return self._of("{}", {shown: key}, self._data.values.get)

    def _of_parameter(self, given: list[Any]) -> tuple[str, Done | None]:
        backend = self._simulation.context.backend
        if backend is None or not given or not isinstance(given[0], str):
            return "", None  # without a backend each script has parameters of its own
        full = {one.bus.resolve(given[0]) for one in self._simulation.vehicles.values()}
        return self._of("the parameter {}", {one: one for one in full}, backend.parameter)

    def _of(self, shown: str, keys: Mapping[str, Any], value: Callable[[Any], Any]) -> tuple[str, Done | None]:
        for name, key in keys.items():
            now = value(key)
            if now is not None and now != self._left.get(key):
                return shown.format(name), None
        return "", lambda _: self._left.update((key, value(key)) for key in keys.values())

    def _of_tube(self, given: list[Any]) -> tuple[str, Done | None]:
        return self._of_handle(given, self._tubes, "a tube of another script")

    def _of_collection(self, given: list[Any]) -> tuple[str, Done | None]:
        return self._of_handle(given, self._collections, "a collection of another script")

    def _of_handle(self, given: list[Any], there: Any, shown: str) -> tuple[str, Done | None]:
        """Look at a call whose first argument is a handle; sim.handle_all means all that are there."""
        handle = given[0] if given else None
        meant = [*there] if handle == _ALL else [handle] if _is_number(handle) and handle in there else []
        return ("" if self._made.issuperset(meant) else shown), None


def _is_number(value: Any) -> bool:
    return type(value) is int or (type(value) is float and math.isfinite(value))


def _names(kind: type, beginnings: Iterable[str]) -> Iterator[str]:
    """Yield the functions of a class, as module.name, under each name, if their own name begins so."""
    for attribute in vars(kind).values():
        declaration = declaration_of(attribute)
        if declaration and attribute.__name__.startswith(tuple(beginnings)):
            yield from (f"{declaration.module}.{name}" for name in declaration.names)
