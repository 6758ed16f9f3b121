"""Where the objects of a file stand in the world, and what the models that they are part of say of them.

V-REP's floor is a model of flat shapes that end at z = 0; ours takes its place.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from drone_sim.importing.folder import label
from drone_sim.importing.shapes import moved
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.object_names import plain
from drone_sim.vrep_files.model import (
    INVISIBLE,
    NOT_DYNAMIC,
    NOT_RESPONDABLE,
    WITHOUT_SCRIPTS,
    Other,
    VrepFile,
    VrepJoint,
    VrepObject,
)


@dataclass(eq=False)
class Placed:
    """An object in its place: world from its frame, and world from the frame of what hangs on it."""

    object: VrepObject
    above: Placed | None
    matrix: Matrix
    below: Matrix
    flags: int  # of all models that it is part of
    visible_layers: int
    name: str = ""  # in the scene that is written
    children: list[Placed] = field(default_factory=list)

    @property
    def wanted_name(self) -> str:
        """Its name in the file."""
        return self.object.name or self.object.alias or f"object_{self.object.handle}"

    @property
    def top(self) -> Placed:
        """The root object of its tree; it may be itself."""
        return self if self.above is None else self.above.top

    @property
    def alias(self) -> str:
        """Its alias where that says more than its name, '' otherwise."""
        alias = label(self.object.alias)
        return alias if alias != self.name else ""

    @property
    def local(self) -> Matrix:
        """Its pose in the frame in which it hangs."""
        return self.object.pose.matrix

    @property
    def is_dynamic(self) -> bool:
        """Whether it is a shape that the dynamics moves."""
        shape = self.object.shape
        return shape is not None and shape.is_dynamic and not self.flags & NOT_DYNAMIC

    @property
    def is_respondable(self) -> bool:
        """Whether it is a shape that others collide with."""
        shape = self.object.shape
        return shape is not None and shape.is_respondable and not self.flags & NOT_RESPONDABLE

    @property
    def is_visible(self) -> bool:
        """Whether it lies in a layer that is shown."""
        return bool(self.object.layers & self.visible_layers) and not self.flags & INVISIBLE

    @property
    def runs_scripts(self) -> bool:
        """Whether the models that it is part of let scripts run."""
        return not self.flags & WITHOUT_SCRIPTS

    @property
    def is_force_sensor(self) -> bool:
        """Whether it is a rigid link."""
        return isinstance(self.object.of, Other) and self.object.of.kind == "force sensor"

    def subtree(self, without: Collection[Placed] = ()) -> Iterator[Placed]:
        """Yield it and all that hangs on it, but for some objects and what hangs on those."""
        yield self
        for child in self.children:
            if child not in without:
                yield from child.subtree(without)

    def between(self, ancestor: Placed) -> list[Placed]:
        """Return what lies between an ancestor and this, from below upwards, without the two."""
        found, here = [], self.above
        while here is not None and here is not ancestor:
            found.append(here)
            here = here.above
        return found


def placed(file: VrepFile) -> list[Placed]:
    """Return the objects of a file, a parent before its children."""
    by_handle: dict[int, Placed] = {}
    for one in file.objects:
        above = by_handle.get(one.parent)
        flags = one.model_flags if one.is_model else 0
        base = IDENTITY
        if above is not None:
            flags |= above.flags
            base = above.below
        matrix = frames.multiply(base, one.pose.matrix)
        below = frames.multiply(matrix, motion(one.of)) if isinstance(one.of, VrepJoint) else matrix
        made = Placed(one, above, matrix, below, flags, file.settings.visible_layers)
        by_handle[one.handle] = made
        if above is not None:
            above.children.append(made)
    return list(by_handle.values())


def motion(joint: VrepJoint) -> Matrix:
    """Return the transform that a joint's position makes, between its own frame and what hangs on it."""
    if joint.kind == "spherical":
        return joint.turn.matrix
    if joint.kind == "prismatic":
        return frames.from_rpy((0.0, 0.0, joint.position), (0.0, 0.0, 0.0))
    slid = joint.lead * joint.position / math.tau if joint.kind == "screw" else 0.0
    return frames.from_rpy((0.0, 0.0, slid), (0.0, 0.0, joint.position))


_NAMES = ("ResizableFloor", "DefaultFloor", "Floor", "resizableFloor")
_LEVEL = 2e-3  # m: a floor's top is as near as that to z = 0
_LARGEST = 1e4  # m


def floor_parts(objects: Sequence[Placed]) -> list[Placed]:
    """Return the objects that our floor takes the place of: roots of floors, and what is flat below them."""
    parts = []
    for root in objects:
        is_named = plain(root.object.name).startswith(_NAMES) or root.object.alias in _NAMES
        if root.above is None and is_named and _is_level(root, with_children=True):
            parts += [one for one in root.subtree() if one is root or _is_level(one)]
    return parts


def floor_size(parts: Sequence[Placed]) -> float:
    """Return the side (m) of the square, centred on the origin, that covers the parts of floors."""
    vertices = np.concatenate([_vertices(one) for one in parts])
    return min(2 * float(np.abs(vertices[:, :2]).max()), _LARGEST)


def _is_level(one: Placed, with_children: bool = False) -> bool:
    """Tell whether a shape that stands still has its top at z = 0, it or a child right below it."""
    several = [one, *one.children] if with_children else [one]
    return any(not each.is_dynamic and _top(each) < _LEVEL for each in several)


def _top(one: Placed) -> float:
    """Return how far from z = 0 the top of a shape is, m; infinity for what is no shape."""
    vertices = _vertices(one)
    return abs(float(vertices[:, 2].max())) if len(vertices) else math.inf


def _vertices(one: Placed) -> np.ndarray:
    """Return where the corners of a shape are, (n, 3), m, world."""
    meshes = one.object.shape.meshes if one.object.shape is not None else ()
    return np.concatenate([np.zeros((0, 3)), *(moved(mesh.vertices, one.matrix) for mesh in meshes)])
