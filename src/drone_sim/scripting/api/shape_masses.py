"""`sim`: mass, inertia and geometry of the scene's shapes."""

from __future__ import annotations

from typing import Any

import numpy as np

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.inertia import Inertia, turned
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.types import Handle, Number, Numbers, ThreeNumbers, TwelveNumbers, WrongValue, numbers
from drone_sim.shapes.mass import principal

_LEAST_MASS = _LEAST_MOMENT = 1e-7  # kg; m² (moment divided by mass); as in V-REP
_NONE = CONSTANTS["primitiveshape_none"]
_COMPOUND, _PURE, _CONVEX = 1, 2, 4  # bits from getShapeGeomInfo
_PRIMITIVES = {
    word: CONSTANTS[f"primitiveshape_{vreps}"]
    for word, vreps in (("box", "cuboid"), ("sphere", "spheroid"), ("cylinder", "cylinder"), ("capsule", "capsule"))
}


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
        operations = self._services.operations
        if operations is None:
            raise ValueError("there is no scene")
        xx, xy, xz, _, yy, yz, _, _, zz = numbers(tensor, 9)  # only the upper triangle counts, as in V-REP
        inertia = Inertia((xx, xy, xz, xy, yy, yz, xz, yz, zz), IDENTITY)
        found = principal(turned(inertia, frame), np.array(frames.position(frame)))
        entry = {
            "moments": [max(moment, _LEAST_MOMENT * mass) for moment in found.moments],
            "position": list(frames.position(found.frame)),
            "rpy": list(frames.to_rpy(found.frame)),
        }
        change = operations.change
        self._services.outside(lambda: change(int(handle), mass=mass, inertia=entry))

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
            return (bits | _COMPOUND if forms else 0), _NONE, [0.0] * 4
        ((word, size),) = forms
        if not bits:
            return 0, _NONE, [0.0] * 4
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
