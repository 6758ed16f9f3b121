"""World poses of the objects of a V-REP file, the flags that they inherit from models, and detection of its floor.

V-REP's floor is a model of flat shapes whose top is at z = 0; drone_sim's floor replaces it.
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
    """An object with its transforms from its own frame to the world and from its children's frame to the world."""

    object: VrepObject
    above: Placed | None
    matrix: Matrix
    below: Matrix
    flags: int  # model flags of all models that contain it
    visible_layers: int
    name: str = ""  # in the written scene
    children: list[Placed] = field(default_factory=list)

    @property
    def wanted_name(self) -> str:
        """Its name in the file, its alias if it has no name."""
        return self.object.name or self.object.alias or f"object_{self.object.handle}"

    @property
    def top(self) -> Placed:
        """The root object of its tree, possibly itself."""
        return self if self.above is None else self.above.top

    @property
    def alias(self) -> str:
        """Its alias if it differs from its name, '' otherwise."""
        alias = label(self.object.alias)
        return alias if alias != self.name else ""

    @property
    def local(self) -> Matrix:
        """Its pose in its parent's child frame."""
        return self.object.pose.matrix

    @property
    def is_dynamic(self) -> bool:
        """Whether it is a shape moved by the dynamics."""
        shape = self.object.shape
        return shape is not None and shape.is_dynamic and not self.flags & NOT_DYNAMIC

    @property
    def is_respondable(self) -> bool:
        """Whether it is a shape that other shapes collide with."""
        shape = self.object.shape
        return shape is not None and shape.is_respondable and not self.flags & NOT_RESPONDABLE

    @property
    def is_visible(self) -> bool:
        """Whether it is in a visible layer, and no model hides it."""
        return bool(self.object.layers & self.visible_layers) and not self.flags & INVISIBLE

    @property
    def runs_scripts(self) -> bool:
        """Whether the models that contain it allow scripts to run."""
        return not self.flags & WITHOUT_SCRIPTS

    @property
    def is_force_sensor(self) -> bool:
        """Whether it is a force sensor, which is a rigid link."""
        return isinstance(self.object.of, Other) and self.object.of.kind == "force sensor"

    def subtree(self, without: Collection[Placed] = ()) -> Iterator[Placed]:
        """Yield it and its descendants, except the objects `without` and their descendants."""
        yield self
        for child in self.children:
            if child not in without:
                yield from child.subtree(without)

    def between(self, ancestor: Placed) -> list[Placed]:
        """Return the objects between this one and an ancestor, both excluded, from this one upwards."""
        objects, current = [], self.above
        while current is not None and current is not ancestor:
            objects.append(current)
            current = current.above
        return objects


def placed(file: VrepFile) -> list[Placed]:
    """Return the objects of a file, parents before children."""
    by_handle: dict[int, Placed] = {}
    for item in file.objects:
        above = by_handle.get(item.parent)
        flags = item.model_flags if item.is_model else 0
        parent_frame = IDENTITY
        if above is not None:
            flags |= above.flags
            parent_frame = above.below
        matrix = frames.multiply(parent_frame, item.pose.matrix)
        below = frames.multiply(matrix, motion(item.of)) if isinstance(item.of, VrepJoint) else matrix
        node = Placed(item, above, matrix, below, flags, file.settings.visible_layers)
        by_handle[item.handle] = node
        if above is not None:
            above.children.append(node)
    return list(by_handle.values())


def motion(joint: VrepJoint) -> Matrix:
    """Return the transform of a joint's position, from its children's frame to its own frame."""
    if joint.kind == "spherical":
        return joint.turn.matrix
    if joint.kind == "prismatic":
        return frames.from_rpy((0.0, 0.0, joint.position), (0.0, 0.0, 0.0))
    slide = joint.lead * joint.position / math.tau if joint.kind == "screw" else 0.0
    return frames.from_rpy((0.0, 0.0, slide), (0.0, 0.0, joint.position))


_FLOOR_NAMES = ("ResizableFloor", "DefaultFloor", "Floor", "resizableFloor")
_LEVEL_TOLERANCE = 2e-3  # m: the largest distance of a floor's top from z = 0
_MAX_FLOOR_SIZE = 1e4  # m


def floor_parts(objects: Sequence[Placed]) -> list[Placed]:
    """Return the objects that drone_sim's floor replaces: roots of floors, and their flat descendants."""
    parts = []
    for root in objects:
        is_named = plain(root.object.name).startswith(_FLOOR_NAMES) or root.object.alias in _FLOOR_NAMES
        if root.above is None and is_named and _is_level(root, with_children=True):
            parts += [part for part in root.subtree() if part is root or _is_level(part)]
    return parts


def floor_size(parts: Sequence[Placed]) -> float:
    """Return the side (m) of the square around the origin that covers these parts of floors."""
    vertices = np.concatenate([_vertices(part) for part in parts])
    return min(2 * float(np.abs(vertices[:, :2]).max()), _MAX_FLOOR_SIZE)


def _is_level(node: Placed, with_children: bool = False) -> bool:
    """Return whether a static shape (or one of its children, if `with_children`) has its top at z = 0."""
    candidates = [node, *node.children] if with_children else [node]
    return any(not candidate.is_dynamic and _top_distance(candidate) < _LEVEL_TOLERANCE for candidate in candidates)


def _top_distance(node: Placed) -> float:
    """Return the distance (m) of a shape's top from z = 0; infinity if the object is not a shape."""
    vertices = _vertices(node)
    return abs(float(vertices[:, 2].max())) if len(vertices) else math.inf


def _vertices(node: Placed) -> np.ndarray:
    """Return a shape's vertices, (n, 3), m, in the world frame."""
    meshes = node.object.shape.meshes if node.object.shape is not None else ()
    return np.concatenate([np.zeros((0, 3)), *(moved(mesh.vertices, node.matrix) for mesh in meshes)])
