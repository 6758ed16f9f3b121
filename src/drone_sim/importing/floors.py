"""V-REP's floor, which is ours: a model of flat shapes that end at z = 0."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from drone_sim.importing.meshes import moved
from drone_sim.importing.placing import Placed
from drone_sim.mechanics.object_names import plain

_NAMES = ("ResizableFloor", "DefaultFloor", "Floor", "resizableFloor")
_LEVEL = 2e-3  # m: a floor's top is as near as that to z = 0
_LARGEST = 1e4  # m


def floor_parts(objects: Sequence[Placed]) -> list[Placed]:
    """Return the objects that our floor takes the place of: roots of floors, and what is flat below them."""
    parts = []
    for root in objects:
        if root.above is None and _is_called_floor(root) and _is_level(root, with_children=True):
            parts += [one for one in root.subtree() if one is root or _is_level(one)]
    return parts


def floor_size(parts: Sequence[Placed]) -> float:
    """Return the side (m) of the square, centred on the origin, that covers the parts of floors."""
    vertices = np.concatenate([_vertices(one) for one in parts])
    return min(2 * float(np.abs(vertices[:, :2]).max()), _LARGEST)


def _is_called_floor(one: Placed) -> bool:
    return plain(one.object.name).startswith(_NAMES) or one.object.alias in _NAMES


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
