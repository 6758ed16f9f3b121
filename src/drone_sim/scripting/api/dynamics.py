"""`sim`: what the dynamics know of an object: masses, whether it moves, and parameters that say so."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.object_tree import SceneObject
from drone_sim.scripting.api.calls import WrongValue, numbers
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.types import Handle, Number, TwelveNumbers
from drone_sim.wording import near_names

_EVERYTHING = (CONSTANTS["handle_all"], CONSTANTS["handle_scene"])
_WHOLE = ("objintparam_", "shapeintparam_", "jointintparam_", "visionintparam_", "proxintparam_")
_FLOAT = ("objfloatparam_", "shapefloatparam_", "jointfloatparam_", "visionfloatparam_")


class Dynamics:
    """The functions on the dynamics of objects."""

    def __init__(self, host: Host, surroundings: Surroundings, ignored: Ignored):
        """Take the drone whose objects they are, the masses (kg) by name, and what says that something is ignored."""
        self._objects = host.objects
        self._masses = surroundings.masses
        self._ignored = ignored

    def resetDynamicObject(self, handle: Handle) -> None:
        """Let the body that carries an object (sim.handle_all: every body) begin anew where it is, at rest."""
        handles = list(self._objects) if handle in _EVERYTHING else [handle]
        bodies = {id(one): one for one in map(_carrier, (self._objects[one] for one in handles)) if one is not None}
        for one in bodies.values():
            one.put(one.matrix())

    def isDynamicallyEnabled(self, handle: Handle) -> bool:
        """Return whether the dynamics move an object."""
        return _carrier(self._objects[handle]) is not None

    def getShapeMass(self, handle: Handle) -> float:
        """Return the mass of a shape in kg; 0 where the dynamics do not move it."""
        return self._masses().get(self._objects[handle].name, 0.0)

    def getShapeMassAndInertia(
        self, handle: Handle, transform: TwelveNumbers | None = None
    ) -> tuple[float, list[float], list[float]]:
        """Return mass (kg), a table of nine zeros, and the shape's place in the frame of `transform` (m).

        The inertia of one shape is not known: bodies of several are one here.
        """
        place = self._objects[handle].matrix()
        if transform is not None:
            place = frames.multiply(frames.invert(numbers(transform, 12)), place)
        self._ignored.say("getShapeMassAndInertia", "the inertia of one shape is not known: nine zeros are returned")
        return self.getShapeMass(handle), [0.0] * 9, list(frames.position(place))

    # ---- parameters of objects

    def getObjectInt32Param(self, handle: Handle, parameter: int) -> int:
        """Return sim.shapeintparam_static (0 or 1), _respondable, or sim.objintparam_visible; 0 for others."""
        found = self._objects[handle]
        known: dict[str, Callable[[], int]] = {
            "shapeintparam_static": lambda: int(_carrier(found) is None),
            "shapeintparam_respondable": lambda: 1,
            "objintparam_visibility_layer": lambda: 1,
        }
        return int(self._read("getObjectInt32Param", _WHOLE, parameter, known, 0))

    getObjectInt32Parameter = getObjectIntParameter = getObjectIntParam = getObjectInt32Param

    def setObjectInt32Param(self, handle: Handle, parameter: int, _value: int) -> int:
        """Accept any whole number among an object's parameters and ignore it; return 1."""
        return self._set("setObjectInt32Param", handle, _WHOLE, parameter)

    setObjectInt32Parameter = setObjectIntParameter = setObjectIntParam = setObjectInt32Param

    def getObjectFloatParam(self, handle: Handle, parameter: int) -> float:
        """Return sim.shapefloatparam_mass (kg), sim.objfloatparam_abs_x_velocity, _y, _z (m/s) or _rot (rad/s)."""
        found = self._objects[handle]
        known: dict[str, Callable[[], float]] = {
            "shapefloatparam_mass": lambda: self.getShapeMass(handle),
            "objfloatparam_abs_x_velocity": lambda: found.velocity()[0][0],
            "objfloatparam_abs_y_velocity": lambda: found.velocity()[0][1],
            "objfloatparam_abs_z_velocity": lambda: found.velocity()[0][2],
            "objfloatparam_abs_rot_velocity": lambda: sum(one * one for one in found.velocity()[1]) ** 0.5,
            "objfloatparam_size_factor": lambda: 1.0,
        }
        return float(self._read("getObjectFloatParam", _FLOAT, parameter, known, 0.0))

    getObjectFloatParameter = getObjectFloatParam

    def setObjectFloatParam(self, handle: Handle, parameter: int, _value: Number) -> int:
        """Accept any number among an object's parameters and ignore it; return 1."""
        return self._set("setObjectFloatParam", handle, _FLOAT, parameter)

    setObjectFloatParameter = setObjectFloatParam

    def _read(
        self, function: str, kinds: tuple[str, ...], parameter: int, known: Mapping[str, Callable[[], Any]], other: Any
    ) -> Any:
        names = _names(kinds, parameter)
        for name in names:
            if name in known:
                return known[name]()
        self._ignored.say(function, f"{names[0]} is not known here: {other} is returned")
        return other

    def _set(self, function: str, handle: int, kinds: tuple[str, ...], parameter: int) -> int:
        self._objects[handle]
        self._ignored.say(function, f"{_names(kinds, parameter)[0]} is accepted and ignored")
        return 1


def _carrier(found: SceneObject | None) -> SceneObject | None:
    """Return the object with a body that carries an object, itself perhaps."""
    while found is not None and found.body is None:
        found = found.parent
    return found


def _names(kinds: tuple[str, ...], parameter: int) -> list[str]:
    """Return the constants' names of a parameter; raises WrongValue, ValueError for none."""
    if not isinstance(parameter, (int, float)):
        raise WrongValue("the number of a parameter is expected, such as sim.shapeintparam_static")
    found = [name for name, value in CONSTANTS.items() if value == parameter and name.startswith(kinds)]
    if not found:
        known = [name for name in CONSTANTS if name.startswith(kinds)]
        raise ValueError(f"no parameter of an object is {parameter:g}; {near_names(kinds[0], known)}")
    return found
