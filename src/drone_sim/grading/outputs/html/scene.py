"""The objects of a scene as boxes for the replay."""

from __future__ import annotations

from typing import Any

import numpy as np

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import SceneParameters
from drone_sim.shapes.compound import Part, parts_of
from drone_sim.shapes.shape import DrawnShape

_DEFAULT_SIDE = 0.2  # m, of the box of a shape that only PyBullet can measure
_MAX_DEPTH = 32  # parents of an object that are followed
_DIGITS = 4


def scene_of(scene: SceneParameters) -> dict[str, Any]:
    """Return the floor's side (m), and the bounding box of every visible shape at its start pose.

    A box has the `name` that scripts use, the unique name of its `object`, `corners` (8 points, m, world; bit 0, 1, 2
    of the index is the side along x, y, z) and a `color` (0 to 1).
    """
    entries = {entry.name: entry for entry in scene.objects if entry.name}
    boxes = []
    for entry in scene.objects:
        if isinstance(entry, ObjectParameters) and entry.visible:
            matrix = _world_matrix(entry, entries)
            names = {"name": entry.shown, "object": entry.name}
            boxes += [{**names, **_box(part, matrix)} for part in parts_of(entry.to_shape(), entry.color)]
    return {"floor": scene.floor.size, "boxes": boxes}


def _world_matrix(entry: EntryParameters, entries: dict[str, EntryParameters]) -> Matrix:
    matrix, parent = entry.local, entry.parent
    for _ in range(_MAX_DEPTH):
        if parent not in entries:
            break
        matrix = frames.multiply(entries[parent].local, matrix)
        parent = entries[parent].parent
    return matrix


def _box(part: Part, world: Matrix) -> dict[str, Any]:
    matrix = frames.multiply(world, part.local)
    low, high = _bounds(part)
    corners = [
        frames.transform(matrix, [(high if index >> axis & 1 else low)[axis] for axis in range(3)])
        for index in range(8)
    ]
    return {
        "corners": [[round(float(value), _DIGITS) for value in corner] for corner in corners],
        "color": [round(float(value), 3) for value in part.color[:3]],
    }


def _bounds(part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest coordinates (3,) of a shape in its frame, in m."""
    try:
        surfaces = list(part.shape.triangles()) if isinstance(part.shape, DrawnShape) else []
    except (OSError, ValueError):  # the flight has reported it
        surfaces = []
    corners = [surface.corners.reshape(-1, 3) for surface in surfaces if len(surface.corners)]
    if not corners:
        return np.full(3, -_DEFAULT_SIDE / 2), np.full(3, _DEFAULT_SIDE / 2)
    points = np.concatenate(corners)
    return points.min(axis=0), points.max(axis=0)
