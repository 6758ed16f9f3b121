"""`sim`: how the mass of a shape of the scene lies in it, and of what form it is."""

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

_LEAST_MASS = _LEAST_MOMENT = 1e-7  # kg; m², of a moment over the mass: as V-REP has them
_NONE = CONSTANTS["primitiveshape_none"]
_COMPOUND, _PURE, _CONVEX = 1, 2, 4  # of what getShapeGeomInfo returns
_PRIMITIVES = {
    word: CONSTANTS[f"primitiveshape_{vreps}"]
    for word, vreps in (("box", "cuboid"), ("sphere", "spheroid"), ("cylinder", "cylinder"), ("capsule", "capsule"))
}


class ShapeMasses(Functions):
    """Mass and inertia of shapes of the scene, and their forms."""

    @sim("345")
    def setShapeMassAndInertia(
        self,
        handle: Handle,
        mass: Number,
        inertiaMatrix: Numbers,
        centerOfMass: ThreeNumbers,
        transform: TwelveNumbers | None = None,
    ) -> int:
        """Set the mass (kg) of a shape, its inertia (kg m², 9 numbers) about the center of mass, and this center (m).

        Both in the frame of `transform`, the world's without one (3.x). What is static stays static. Return 1.
        """
        (kilograms,) = numbers((mass,), 1)
        place = IDENTITY if transform is None else numbers(transform, 12)
        frame = frames.multiply(frames.invert(self._objects[handle].matrix()), place)
        self._set(handle, max(kilograms, _LEAST_MASS), inertiaMatrix, _moved(frame, numbers(centerOfMass, 3)))
        return 1

    @sim("45")
    def setShapeInertia(self, handle: Handle, inertiaMatrix: Numbers, transform: TwelveNumbers) -> int:
        """Set the inertia (kg m², 9 numbers) of a shape, in a frame whose origin is the center of mass.

        That frame is in the shape's own (4.x). Return 1.
        """
        mass = float(getattr(self._objects[handle], "mass", 0.0))
        if not mass:
            raise ValueError(f"'{self._objects[handle].name}' has no mass of its own: give it one with setShapeMass")
        self._set(handle, mass, inertiaMatrix, numbers(transform, 12))
        return 1

    def _set(self, handle: int, mass: float, tensor: Numbers, frame: Matrix) -> None:
        operations = self._surroundings.operations
        if operations is None:
            raise ValueError("there is no scene")
        xx, xy, xz, _, yy, yz, _, _, zz = numbers(tensor, 9)  # as V-REP reads it: what is below the diagonal is above
        inertia = Inertia((xx, xy, xz, xy, yy, yz, xz, yz, zz), IDENTITY)
        found = principal(turned(inertia, frame), np.array(frames.position(frame)))
        said = {
            "moments": [max(one, _LEAST_MOMENT * mass) for one in found.moments],
            "position": list(frames.position(found.frame)),
            "rpy": list(frames.to_rpy(found.frame)),
        }
        change = operations.change
        self._surroundings.outside(lambda: change(int(handle), mass=mass, inertia=said))

    @sim("345")
    def getShapeGeomInfo(self, handle: Handle) -> tuple[int, int, list[float]]:
        """Return the form of a shape: bits, the form, its full sizes along x, y and z (m), and 0.

        Bits are 1 a compound, 2 of simple forms, 4 convex. The form is sim.primitiveshape_cuboid, _spheroid, _cylinder
        or _capsule; _none, without extents, for compounds, meshes and the shapes of vehicles.
        """
        found = self._objects[handle]
        if found.kind != "shape":
            raise WrongValue(f"'{found.name}' is not a shape")
        operations = self._surroundings.operations
        forms = operations.forms(int(handle)) if operations is not None else []
        bits = _PURE if forms and all(word in _PRIMITIVES for word, _ in forms) else 0
        if len(forms) != 1:
            return (bits | _COMPOUND if forms else 0), _NONE, [0.0] * 4
        ((word, size),) = forms
        if not bits:
            return 0, _NONE, [0.0] * 4
        return bits | _CONVEX, _PRIMITIVES[word], [*_extents(word, size), 0.0]


def _moved(frame: Matrix, place: Any) -> Matrix:
    """Return a frame with its origin at a place in it."""
    x, y, z = frames.transform(frame, place)
    return (*frame[:3], x, *frame[4:7], y, *frame[8:11], z)


def _extents(word: str, size: tuple[float, ...]) -> list[float]:
    if word == "box":
        return list(size)
    across = 2 * size[0]
    return [across, across, {"sphere": across, "cylinder": size[-1], "capsule": size[-1] + across}[word]]
