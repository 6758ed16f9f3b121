"""Make the floor, and the ground around it."""

from __future__ import annotations

import pybullet

from drone_sim.shapes.visual import GROUND
from drone_sim.world.own_files import OwnFiles

_TILE = 2.0  # m covered by one texture
_THICKNESS = 0.1  # m, below z = 0
_GROUND_REACH = 2000.0  # m from the origin, along either axis
_BELOW = 1e-3  # m that the ground is drawn below the floor, for PyBullet's own renderer to tell them apart


def create(client: int, files: OwnFiles, size: float, ground: bool) -> int:
    """Add a square floor with its top at z = 0, `size` metres a side; return its body id.

    With `ground`, bare ground surrounds it at the same height. It is of the same body, as its second visual shape:
    every body costs a step some 4 % of its time, whether anything comes near it or not.
    """
    half, depth = size / 2, _THICKNESS / 2
    boxes = [(half, half, 0.0, 0.0)]  # half lengths in x and y, and centre
    seen = [(_mesh(size), (1.0, 1.0, 1.0, 1.0), 0.0)]
    if ground:
        reach, wide = _GROUND_REACH, (_GROUND_REACH - half) / 2
        boxes += [(reach, wide, 0.0, half + wide), (reach, wide, 0.0, -half - wide)]
        boxes += [(wide, half, half + wide, 0.0), (wide, half, -half - wide, 0.0)]
        seen.append((_mesh(2 * reach), (*GROUND, 1.0), -_BELOW))
    solid = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * len(boxes),
        halfExtents=[[x, y, depth] for x, y, _, _ in boxes],
        collisionFramePositions=[[x, y, -depth] for _, _, x, y in boxes],
        physicsClientId=client,
    )
    visual = pybullet.createVisualShapeArray(
        shapeTypes=[pybullet.GEOM_MESH] * len(seen),
        fileNames=[files.write(mesh, ".obj") for mesh, _, _ in seen],
        rgbaColors=[color for _, color, _ in seen],
        visualFramePositions=[[0, 0, z] for _, _, z in seen],
        physicsClientId=client,
    )
    return int(pybullet.createMultiBody(0, solid, visual, physicsClientId=client))


def _mesh(size: float) -> bytes:
    """Return a square whose texture repeats every _TILE metres, centred, as an OBJ file."""
    half, reach = size / 2, size / 2 / _TILE
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    lines = [f"v {x * half} {y * half} 0" for x, y in corners]
    lines += [f"vt {x * reach} {y * reach}" for x, y in corners]
    lines += ["vn 0 0 1", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1", ""]
    return "\n".join(lines).encode()
