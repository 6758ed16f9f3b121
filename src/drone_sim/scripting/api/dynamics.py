"""`sim`: dynamics and parameters of objects (getObjectInt32Param and others), and masses of the scene's shapes.

As in V-REP 3.x, a motor that is on runs at the target velocity without control, and to the target position with
control.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.inertia import Inertia, turned
from drone_sim.mechanics.joint import KINEMATIC, PASSIVE, POSITION, VELOCITY, Joint
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.message_text import near_names
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.sensors import Detector
from drone_sim.scripting.api.types import Handle, Number, Numbers, ThreeNumbers, TwelveNumbers, WrongValue, numbers
from drone_sim.scripting.api.vision import Eye
from drone_sim.shapes.mass import principal

Getters = Mapping[str, Callable[[], float]]
Setters = Mapping[str, Callable[[float], None]]
_NO_INERTIA = Inertia((0.0,) * 9, IDENTITY)
_EVERYTHING = (CONSTANTS["handle_all"], CONSTANTS["handle_scene"])
_COLOR_CODED = 2  # render mode in which colours are handles
_INTEGER = ("objintparam_", "shapeintparam_", "jointintparam_", "visionintparam_", "proxintparam_")
_FLOAT = ("objfloatparam_", "shapefloatparam_", "jointfloatparam_", "visionfloatparam_")
_LEAST_MASS = _LEAST_MOMENT = 1e-7  # kg; m² (moment divided by mass); as in V-REP
_NO_PRIMITIVE = CONSTANTS["primitiveshape_none"]
_COMPOUND, _PURE, _CONVEX = 1, 2, 4  # bits from getShapeGeomInfo
_PRIMITIVES = {
    word: CONSTANTS[f"primitiveshape_{vreps}"]
    for word, vreps in (("box", "cuboid"), ("sphere", "spheroid"), ("cylinder", "cylinder"), ("capsule", "capsule"))
}


@runtime_checkable
class Freezable(Protocol):
    """A shape of the scene, which can be made static or dynamic."""

    @property
    def is_static(self) -> bool:
        """Whether the shape is static, that is, not moved by the dynamics."""

    def set_static(self, static: bool) -> None:
        """Make the shape static or dynamic. Raises ValueError."""


def readable(found: SceneObject) -> Getters:
    """Return getters of an object's parameters by the parameters' names."""
    if isinstance(found, Joint):
        control = found.control
        return {
            "jointintparam_motor_enabled": lambda: control.mode not in (KINEMATIC, PASSIVE),
            "jointintparam_ctrl_enabled": lambda: control.mode == POSITION,
            "jointfloatparam_velocity": lambda: found.velocity_along,
            "jointfloatparam_upper_limit": lambda: found.limits[1] if found.limits else 0.0,
        }
    if isinstance(found, Eye):
        return {
            "visionintparam_resolution_x": lambda: found.width,
            "visionintparam_resolution_y": lambda: found.height,
            "visionintparam_render_mode": lambda: _COLOR_CODED if found.color_coded else 0,
            "visionintparam_entity_to_render": lambda: found.entity,
            "visionintparam_perspective_operation": lambda: found.orthographic_size is None,
            "visionfloatparam_near_clipping": lambda: found.near,
            "visionfloatparam_far_clipping": lambda: found.far,
            "visionfloatparam_perspective_angle": lambda: found.angle,
        }
    if isinstance(found, Detector):
        return {"proxintparam_entity_to_detect": lambda: found.entity}
    return {"shapeintparam_static": lambda: found.is_static} if isinstance(found, Freezable) else {}


def settable(found: SceneObject) -> Setters:
    """Return setters of an object's parameters by the parameters' names."""
    if isinstance(found, Joint) and found.control.mode != KINEMATIC:
        mode = found.control.mode
        with_control = POSITION if mode == POSITION else VELOCITY
        without_control = VELOCITY if mode == POSITION else mode
        return {
            "jointintparam_motor_enabled": lambda on: found.change(mode=with_control if on else PASSIVE),
            "jointintparam_ctrl_enabled": lambda on: found.change(mode=POSITION if on else without_control),
        }
    if isinstance(found, Freezable) and not getattr(found, "is_held", False):
        return {"shapeintparam_static": lambda static: found.set_static(bool(static))}
    return {}


@runtime_checkable
class Massive(Protocol):
    """An object that may have a mass."""

    def inertia(self) -> Inertia | None:
        """Return its inertia, None without a mass."""


class Dynamics(Functions):
    """Dynamics of an object: its mass, whether it moves, and parameters for that."""

    @sim("345")
    def resetDynamicObject(self, handle: Handle) -> None:
        """Stop the body that carries an object (sim.handle_all: every body); it then starts from rest at its place."""
        handles = list(self._objects) if handle in _EVERYTHING else [handle]
        carriers = map(_carrier, map(self._objects.__getitem__, handles))
        for body in {id(body): body for body in carriers if body is not None}.values():
            if not getattr(body, "is_held", False):  # a body that is held moves with its parent
                body.put(body.matrix())

    @sim("45")
    def isDynamicallyEnabled(self, handle: Handle) -> bool:
        """Return whether the dynamics moves an object, or its carrier."""
        return _carrier(self._objects[handle]) is not None

    @sim("45")
    def getShapeMass(self, handle: Handle) -> float:
        """Return the mass of a shape in kg; 0 if the dynamics does not move it."""
        found = self._objects[handle]
        return float(getattr(found, "mass", 0.0)) or self._services.masses().get(found.name, 0.0)

    @sim("345")
    def getShapeMassAndInertia(
        self, handle: Handle, transform: TwelveNumbers | None = None
    ) -> tuple[float, list[float], list[float]]:
        """Return a shape's mass (kg), inertia about its center of mass (kg m², 9 numbers), and this center (m) (3.x).

        They are in the frame of `transform`, or the world frame without one. If the dynamics does not move the shape,
        mass and inertia are zero.
        """
        inertia = self._inertia(handle) or _NO_INERTIA
        place = frames.multiply(self._objects[handle].matrix(), inertia.frame)
        if transform is not None:
            place = frames.multiply(frames.invert(numbers(transform, 12)), place)
        tensor = list(map(float, turned(inertia, place).ravel()))
        return self.getShapeMass(handle), tensor, list(frames.position(place))

    @sim("45")
    def getShapeInertia(self, handle: Handle) -> tuple[Numbers, TwelveNumbers]:
        """Return a shape's inertia about its center of mass (kg m², 9 numbers), and the frame of these (4.x).

        The frame is a transform in the shape's frame. Inertia and mass of a propeller's shape are without its blades.
        """
        inertia = self._inertia(handle)
        if inertia is None:
            raise ValueError(
                f"'{self._objects[handle].name}' is not moved by the dynamics, because it is static or has no mass"
            )
        return list(inertia.tensor), list(inertia.frame)

    def _inertia(self, handle: int) -> Inertia | None:
        """Return the inertia of a shape, None without a mass."""
        found = self._objects[handle]
        return found.inertia() if isinstance(found, Massive) else self._services.inertias().get(found.name)

    # ---- parameters of objects

    @sim("5", getObjectIntParam="")
    def getObjectInt32Param(self, handle: Handle, parameter: int) -> int:
        """Return a parameter of an object, 0 for an unknown parameter.

        All objects have sim.shapeintparam_static (0 or 1), _respondable and sim.objintparam_visibility_layer.
        """
        return self.getObjectInt32Parameter(handle, parameter)[1]

    @sim("345", getObjectIntParameter="35")
    def getObjectInt32Parameter(self, handle: Handle, parameter: int) -> tuple[int, int]:
        """Return 1 and the value of getObjectInt32Param; 0 and 0 for an unknown parameter."""
        found = self._objects[handle]
        known: dict[str, Callable[[], float]] = {
            "shapeintparam_static": lambda: int(_carrier(found) is None),
            "shapeintparam_respondable": lambda: 1,
            "objintparam_visibility_layer": lambda: 1,
            **readable(found),
        }
        value = self._read("getObjectInt32Param", _INTEGER, parameter, known)
        return (0, 0) if value is None else (1, int(value))

    @sim("5", setObjectInt32Parameter="345", setObjectIntParam="", setObjectIntParameter="3")
    def setObjectInt32Param(self, handle: Handle, parameter: int, value: int) -> int:
        """Set a parameter of the scene's objects: sim.shapeintparam_static, sim.jointintparam_motor_enabled and others.

        Other parameters are accepted and ignored. Return 1.
        """
        return self._set("setObjectInt32Param", handle, _INTEGER, parameter, value)

    @sim("5")
    def getObjectFloatParam(self, handle: Handle, parameter: int) -> float:
        """Return sim.shapefloatparam_mass (kg), sim.objfloatparam_abs_x_velocity, _y, _z (m/s) or _rot (rad/s).

        The scene's shapes also have sim.objfloatparam_objbbox_min_x and others (m, in the shape). An unknown parameter
        is 0.
        """
        return self.getObjectFloatParameter(handle, parameter)[1]

    @sim("345")
    def getObjectFloatParameter(self, handle: Handle, parameter: int) -> tuple[int, float]:
        """Return 1 and the value of getObjectFloatParam; 0 and 0 for an unknown parameter."""
        found, velocities, operations = self._objects[handle], self._context.velocities, self._services.operations
        known: dict[str, Callable[[], float]] = {
            "shapefloatparam_mass": lambda: self.getShapeMass(handle),
            "objfloatparam_abs_x_velocity": lambda: velocities.velocity(handle)[0][0],
            "objfloatparam_abs_y_velocity": lambda: velocities.velocity(handle)[0][1],
            "objfloatparam_abs_z_velocity": lambda: velocities.velocity(handle)[0][2],
            "objfloatparam_abs_rot_velocity": lambda: math.hypot(*velocities.rotation(handle)),
            "objfloatparam_size_factor": lambda: operations.factors(handle)[0] if operations is not None else 1.0,
            **(self._corners(handle) if isinstance(found, Freezable) else {}),
            **readable(found),
        }
        value = self._read("getObjectFloatParam", _FLOAT, parameter, known)
        return (0, 0.0) if value is None else (1, float(value))

    @sim("5", setObjectFloatParameter="345")
    def setObjectFloatParam(self, handle: Handle, parameter: int, value: Number) -> int:
        """Accept any float parameter of an object and ignore it; return 1."""
        return self._set("setObjectFloatParam", handle, _FLOAT, parameter, value)

    def _read(self, function: str, kinds: tuple[str, ...], parameter: int, known: Getters) -> float | None:
        names = _names(kinds, parameter)
        for name in names:
            if name in known:
                return known[name]()
        self._ignored.log(function, f"{names[0]} is not supported: 0 is returned")
        return None

    def _corners(self, handle: int) -> Getters:
        """Return getters of the corners of the box around a shape of the scene, along the shape's axes."""
        operations = self._services.operations
        if operations is None:
            return {}

        def corner(axis: int, factor: float) -> float:
            size, centre = operations.box(handle)
            return centre[axis] + factor * size[axis]

        ends = {"min": -0.5, "max": 0.5}
        return {
            f"objfloatparam_objbbox_{end}_{name}": functools.partial(corner, axis, factor)
            for end, factor in ends.items()
            for axis, name in enumerate("xyz")
        }

    def _set(self, function: str, handle: int, kinds: tuple[str, ...], parameter: int, value: float) -> int:
        found, names = self._objects[handle], _names(kinds, parameter)
        known = dict(settable(found))
        operations = self._services.operations
        if operations is not None and isinstance(found, Freezable):  # a shape of the scene
            known["shapeintparam_respondable"] = lambda on: operations.change(handle, respondable=bool(on))
        if isinstance(found, Detector):
            known["proxintparam_entity_to_detect"] = lambda entity: self._look_for(found, int(entity))
        if isinstance(found, Eye):
            known["visionintparam_entity_to_render"] = lambda entity: self._look_for(found, int(entity))
            # All other modes render the same picture.
            known["visionintparam_render_mode"] = lambda mode: setattr(found, "color_coded", mode == _COLOR_CODED)
        for name in names:
            if name in known:
                known[name](*numbers((value,), 1))
                return 1
        self._ignored.log(function, f"{names[0]} is accepted and ignored")
        return 1

    def _look_for(self, sensor: Detector | Eye, entity: int) -> None:
        self._names_of(entity)  # raises ValueError if it does not exist
        sensor.entity = entity


def _carrier(found: SceneObject | None) -> SceneObject | None:
    """Return the object itself or its nearest ancestor that has a body."""
    while found is not None and found.body is None:
        found = found.parent
    return found


def _names(kinds: tuple[str, ...], parameter: int) -> list[str]:
    """Return the names of the constants with a parameter's number. Raises WrongValue, ValueError."""
    if not isinstance(parameter, (int, float)):
        raise WrongValue("expected the number of a parameter, such as sim.shapeintparam_static")
    found = [name for name, value in CONSTANTS.items() if value == parameter and name.startswith(kinds)]
    if not found:
        known = [name for name in CONSTANTS if name.startswith(kinds)]
        raise ValueError(f"{parameter:g} is not a parameter of an object; {near_names(kinds[0], known)}")
    return found


# ---- masses of the scene's shapes


class ShapeMasses(Functions):
    """Mass, inertia and geometry of the scene's shapes."""

    @sim("345")
    def setShapeMassAndInertia(
        self,
        handle: Handle,
        mass: Number,
        inertiaMatrix: Numbers,
        centerOfMass: ThreeNumbers,
        transform: TwelveNumbers | None = None,
    ) -> int:
        """Set mass (kg), inertia about the center of mass (kg m², 9 numbers), and center of mass (m) of a shape.

        Both are in the frame of `transform`, or the world frame without one (3.x). A static shape stays static. Return
        1.
        """
        (kilograms,) = numbers((mass,), 1)
        place = IDENTITY if transform is None else numbers(transform, 12)
        frame = frames.multiply(frames.invert(self._objects[handle].matrix()), place)
        self._set(handle, max(kilograms, _LEAST_MASS), inertiaMatrix, _moved(frame, numbers(centerOfMass, 3)))
        return 1

    @sim("45")
    def setShapeInertia(self, handle: Handle, inertiaMatrix: Numbers, transform: TwelveNumbers) -> int:
        """Set the inertia (kg m², 9 numbers) of a shape, in a frame whose origin is the center of mass.

        `transform` is that frame in the shape's frame (4.x). Return 1.
        """
        mass = float(getattr(self._objects[handle], "mass", 0.0))
        if not mass:
            raise ValueError(f"'{self._objects[handle].name}' has no mass of its own: give it one with setShapeMass")
        self._set(handle, mass, inertiaMatrix, numbers(transform, 12))
        return 1

    def _set(self, handle: int, mass: float, tensor: Numbers, frame: Matrix) -> None:
        xx, xy, xz, _, yy, yz, _, _, zz = numbers(tensor, 9)  # only the upper triangle counts, as in V-REP
        inertia = Inertia((xx, xy, xz, xy, yy, yz, xz, yz, zz), IDENTITY)
        found = principal(turned(inertia, frame), np.array(frames.position(frame)))
        entry = {
            "moments": [max(moment, _LEAST_MOMENT * mass) for moment in found.moments],
            "position": list(frames.position(found.frame)),
            "rpy": list(frames.to_rpy(found.frame)),
        }
        self._do(lambda scene: scene.change(int(handle), mass=mass, inertia=entry))

    @sim("345")
    def getShapeGeomInfo(self, handle: Handle) -> tuple[int, int, list[float]]:
        """Return the geometry of a shape: bits, the kind, its full sizes along x, y and z (m), and 0.

        Bits: 1 compound, 2 made of primitives, 4 convex. The kind is sim.primitiveshape_cuboid, _spheroid, _cylinder or
        _capsule; for compounds, meshes and the shapes of vehicles, it is _none, and the sizes are 0.
        """
        found = self._objects[handle]
        if found.kind != "shape":
            raise WrongValue(f"'{found.name}' is not a shape")
        operations = self._services.operations
        forms = operations.forms(int(handle)) if operations is not None else []
        bits = _PURE if forms and all(word in _PRIMITIVES for word, _ in forms) else 0
        if len(forms) != 1:
            return (bits | _COMPOUND if forms else 0), _NO_PRIMITIVE, [0.0] * 4
        ((word, size),) = forms
        if not bits:
            return 0, _NO_PRIMITIVE, [0.0] * 4
        return bits | _CONVEX, _PRIMITIVES[word], [*_extents(word, size), 0.0]


def _moved(frame: Matrix, place: Any) -> Matrix:
    """Return a frame with its origin moved to a place in it."""
    x, y, z = frames.transform(frame, place)
    return (*frame[:3], x, *frame[4:7], y, *frame[8:11], z)


def _extents(word: str, size: tuple[float, ...]) -> list[float]:
    if word == "box":
        return list(size)
    across = 2 * size[0]
    return [across, across, {"sphere": across, "cylinder": size[-1], "capsule": size[-1] + across}[word]]
