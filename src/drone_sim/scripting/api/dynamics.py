"""`sim`: what the dynamics know of an object: masses, whether it moves, and parameters that say so."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

from drone_sim.mechanics import frames
from drone_sim.mechanics.inertia import Inertia, turned
from drone_sim.mechanics.object_tree import SceneObject
from drone_sim.scripting.api.calls import WrongValue, numbers
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.object_parameters import readable, settable
from drone_sim.scripting.api.types import Handle, Number, Numbers, TwelveNumbers
from drone_sim.wording import near_names

_NONE = Inertia((0.0,) * 9, frames.IDENTITY)
_EVERYTHING = (CONSTANTS["handle_all"], CONSTANTS["handle_scene"])
_WHOLE = ("objintparam_", "shapeintparam_", "jointintparam_", "visionintparam_", "proxintparam_")
_FLOAT = ("objfloatparam_", "shapefloatparam_", "jointfloatparam_", "visionfloatparam_")


@runtime_checkable
class Massive(Protocol):
    """A shape of the scene."""

    def inertia(self) -> Inertia | None:
        """Return how its mass lies in it, None where it has none."""


class Dynamics:
    """The functions on the dynamics of objects."""

    def __init__(self, host: Host, surroundings: Surroundings, ignored: Ignored):
        """Take the drone whose objects they are, the masses (kg) by name, and what says that something is ignored."""
        self._objects = host.objects
        self._masses = surroundings.masses
        self._inertias = surroundings.inertias
        self._ignored = ignored

    def resetDynamicObject(self, handle: Handle) -> None:
        """Let the body that carries an object (sim.handle_all: every body) begin anew where it is, at rest."""
        handles = list(self._objects) if handle in _EVERYTHING else [handle]
        bodies = {id(one): one for one in map(_carrier, (self._objects[one] for one in handles)) if one is not None}
        for one in bodies.values():
            if not getattr(one, "is_held", False):  # those go with what they hang on
                one.put(one.matrix())

    def isDynamicallyEnabled(self, handle: Handle) -> bool:
        """Return whether the dynamics move an object, or what carries it."""
        return _carrier(self._objects[handle]) is not None

    def getShapeMass(self, handle: Handle) -> float:
        """Return the mass of a shape in kg; 0 where the dynamics do not move it."""
        found = self._objects[handle]
        return float(getattr(found, "mass", 0.0)) or self._masses().get(found.name, 0.0)

    def getShapeMassAndInertia(
        self, handle: Handle, transform: TwelveNumbers | None = None
    ) -> tuple[float, list[float], list[float]]:
        """Return mass (kg), inertia about the centre of mass (kg m², 9 numbers), and that centre (m) of a shape (3.x).

        All in the frame of `transform`, the world's without one. What the dynamics do not move has 0 and nine zeros.
        """
        inertia = self._inertia(handle) or _NONE
        place = frames.multiply(self._objects[handle].matrix(), inertia.frame)
        if transform is not None:
            place = frames.multiply(frames.invert(numbers(transform, 12)), place)
        tensor = list(map(float, turned(inertia, place).ravel()))
        return self.getShapeMass(handle), tensor, list(frames.position(place))

    def getShapeInertia(self, handle: Handle) -> tuple[Numbers, TwelveNumbers]:
        """Return the inertia of a shape about its centre of mass (kg m², 9 numbers), and in which frame that is (4.x).

        The frame is a transform in the shape's own. A propeller's shape is without its blades, as its mass is.
        """
        inertia = self._inertia(handle)
        if inertia is None:
            raise ValueError(f"'{self._objects[handle].name}' has no mass that the dynamics move")
        return list(inertia.tensor), list(inertia.frame)

    def _inertia(self, handle: int) -> Inertia | None:
        """Return how the mass of a shape lies in it, None where there is none."""
        found = self._objects[handle]
        return found.inertia() if isinstance(found, Massive) else self._inertias().get(found.name)

    # ---- parameters of objects

    def getObjectInt32Param(self, handle: Handle, parameter: int) -> int:
        """Return what object_parameters.py has of an object, or what any object has; 0 for others.

        Those are sim.shapeintparam_static (0 or 1), _respondable and sim.objintparam_visibility_layer.
        """
        found = self._objects[handle]
        known: dict[str, Callable[[], float]] = {
            "shapeintparam_static": lambda: int(_carrier(found) is None),
            "shapeintparam_respondable": lambda: 1,
            "objintparam_visibility_layer": lambda: 1,
            **readable(found),
        }
        return int(self._read("getObjectInt32Param", _WHOLE, parameter, known, 0))

    getObjectInt32Parameter = getObjectIntParameter = getObjectIntParam = getObjectInt32Param

    def setObjectInt32Param(self, handle: Handle, parameter: int, value: int) -> int:
        """Set a parameter of the scene's objects: sim.shapeintparam_static, sim.jointintparam_motor_enabled and others.

        Any other is accepted and ignored. Return 1.
        """
        return self._set("setObjectInt32Param", handle, _WHOLE, parameter, value)

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
            **readable(found),
        }
        return float(self._read("getObjectFloatParam", _FLOAT, parameter, known, 0.0))

    getObjectFloatParameter = getObjectFloatParam

    def setObjectFloatParam(self, handle: Handle, parameter: int, value: Number) -> int:
        """Accept any number among an object's parameters and ignore it; return 1."""
        return self._set("setObjectFloatParam", handle, _FLOAT, parameter, value)

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

    def _set(self, function: str, handle: int, kinds: tuple[str, ...], parameter: int, value: float) -> int:
        known, names = settable(self._objects[handle]), _names(kinds, parameter)
        for name in names:
            if name in known:
                known[name](*numbers((value,), 1))
                return 1
        self._ignored.say(function, f"{names[0]} is accepted and ignored")
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
