"""What stands in the scene, as boxes for the replay."""

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

_UNKNOWN = 0.2  # m, sides of the box for a shape that only PyBullet can measure
_DEEPEST = 32  # parents above an object; deeper ones stand where they are in the last one's frame
_DIGITS = 4


def scene_of(scene: SceneParameters) -> dict[str, Any]:
    """Return the floor's side (m), and the bounding box of every visible shape where it stands at the start.

    A box has a `name`, `corners` (8 points, m, world; bit 0, 1, 2 of the index is the side along x, y, z) and a
    `color` (0 to 1).
    """
    entries = {one.name: one for one in scene.objects if one.name}
    boxes = []
    for one in scene.objects:
        if isinstance(one, ObjectParameters) and one.visible:
            world = _world(one, entries)
            boxes += [_box(one.shown, part, world) for part in parts_of(one.to_shape(), one.color)]
    return {"floor": scene.floor.size, "boxes": boxes}


def _world(entry: EntryParameters, entries: dict[str, EntryParameters]) -> Matrix:
    matrix, above = entry.local, entry.parent
    for _ in range(_DEEPEST):
        if above not in entries:
            break
        matrix = frames.multiply(entries[above].local, matrix)
        above = entries[above].parent
    return matrix


def _box(name: str, part: Part, world: Matrix) -> dict[str, Any]:
    matrix = frames.multiply(world, part.local)
    low, high = _bounds(part)
    corners = [
        frames.transform(matrix, [(high if index >> axis & 1 else low)[axis] for axis in range(3)])
        for index in range(8)
    ]
    return {
        "name": name,
        "corners": [[round(float(value), _DIGITS) for value in corner] for corner in corners],
        "color": [round(float(value), 3) for value in part.color[:3]],
    }


def _bounds(part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest corner (3,) of a shape in its frame, m."""
    try:
        surfaces = list(part.shape.triangles()) if isinstance(part.shape, DrawnShape) else []
    except (OSError, ValueError):  # the flight has said it
        surfaces = []
    corners = [surface.corners.reshape(-1, 3) for surface in surfaces if len(surface.corners)]
    if not corners:
        return np.full(3, -_UNKNOWN / 2), np.full(3, _UNKNOWN / 2)
    points = np.concatenate(corners)
    return points.min(axis=0), points.max(axis=0)
