"""Make PyBullet bodies of the floor, of the objects of a scene that stand still, and of URDFs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import pybullet

from drone_sim.mechanics.state import Pose
from drone_sim.shapes.shape import Geometry, SceneShape, UrdfFile
from drone_sim.shapes.visual import GROUND
from drone_sim.world.bullet_files import BulletFiles

TILE = 2.0  # m covered by one texture
_THICKNESS = 0.1  # m, below z = 0
GROUND_REACH = 2000.0  # m from the origin, along either axis
_BELOW = 1e-3  # m that the ground is drawn below the floor, for PyBullet's own renderer to tell them apart


# Number of the collision and of the visual shape of what was made, by what it was made of: PyBullet frees neither when
# a body goes.
Made = dict[tuple[str, str], tuple[int, int]]


def create(
    client: int, files: BulletFiles, shape: SceneShape, pose: Pose, *, moves: bool, color: Sequence[float], made: Made
) -> int:
    """Add an object without its texture; return its body id. Only a URDF `moves`, by its own masses.

    Other equal shapes share the PyBullet shapes in `made`. Raises ValueError, in one line, for a file that cannot be
    read.
    """
    position, orientation = pose
    try:
        told = shape.for_bullet(files, moves)
        if isinstance(told, UrdfFile):
            return _load(client, told, pose, moves)
        key = repr(told), repr(color)
        if key not in made:
            solid = pybullet.createCollisionShape(physicsClientId=client, **_collision(told))
            seen = pybullet.createVisualShape(
                getattr(pybullet, told.type), rgbaColor=color, physicsClientId=client, **told.visual
            )
            made[key] = solid, seen
        return pybullet.createMultiBody(0, *made[key], position, orientation, physicsClientId=client)
    except pybullet.error as error:
        raise ValueError(f"{shape}: PyBullet cannot make it ({error})") from None


def _load(client: int, told: UrdfFile, pose: Pose, moves: bool) -> int:
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE  # what PyBullet would derive from the bounds is not right
    body = pybullet.loadURDF(told.path, *pose, useFixedBase=not moves, flags=flags, physicsClientId=client)
    links = [pybullet.getBodyInfo(body, client)[0]]
    links += [pybullet.getJointInfo(body, number, client)[12] for number in range(pybullet.getNumJoints(body, client))]
    for number, link in enumerate(links, start=-1):
        moments = told.moments[link.decode()]
        pybullet.changeDynamics(body, number, localInertiaDiagonal=moments, physicsClientId=client)
    return body


def load_rigid_body(client: int, files: BulletFiles, xml: str, pose: Pose) -> int:
    """Add a merged URDF with its root link at a pose; return its body id."""
    path = files.urdf_of(xml)
    # The merged inertia is right; what PyBullet would derive from the collision shapes' bounds is not.
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    number = pybullet.loadURDF(path, pose.position, pose.orientation, flags=flags, physicsClientId=client)
    os.unlink(path)  # or there would be one more file for every vehicle that has come
    return int(number)


def set_material(client: int, body: int) -> None:
    """Let a body be of V-REP's Bullet material: friction 1, no restitution, no damping (PyBullet's default damps)."""
    pybullet.changeDynamics(
        body,
        -1,
        lateralFriction=1,
        restitution=0,
        linearDamping=0,
        angularDamping=0,
        activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        physicsClientId=client,
    )


def _collision(told: Geometry) -> dict[str, Any]:
    flags = {"flags": getattr(pybullet, told.flags)} if told.flags else {}
    return {"shapeType": getattr(pybullet, told.type), **told.collision, **flags}


# ---- the floor, and the ground around it


def create_floor(client: int, files: BulletFiles, size: float, ground: bool) -> int:
    """Add a square floor with its top at z = 0, `size` metres a side; return its body id.

    With `ground`, bare ground surrounds it at the same height. It is of the same body, as its second visual shape:
    every body costs a step some 4 % of its time, whether anything comes near it or not.
    """
    half, depth = size / 2, _THICKNESS / 2
    boxes = [(half, half, 0.0, 0.0)]  # half lengths in x and y, and centre
    seen = [(_mesh(size), (1.0, 1.0, 1.0, 1.0), 0.0)]
    if ground:
        reach, wide = GROUND_REACH, (GROUND_REACH - half) / 2
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
    """Return a square whose texture repeats every TILE metres, centred, as an OBJ file."""
    half, reach = size / 2, size / 2 / TILE
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    lines = [f"v {x * half} {y * half} 0" for x, y in corners]
    lines += [f"vt {x * reach} {y * reach}" for x, y in corners]
    lines += ["vn 0 0 1", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1", ""]
    return "\n".join(lines).encode()
