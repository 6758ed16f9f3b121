"""Creation of PyBullet bodies: the floor, static objects of a scene, URDFs."""

from __future__ import annotations

import os
from collections.abc import Sequence

import pybullet

from drone_sim.mechanics.state import Pose
from drone_sim.shapes.plane import Plane
from drone_sim.shapes.shape import SceneShape, UrdfFile
from drone_sim.shapes.visual import GROUND
from drone_sim.world.bullet_files import BulletFiles

TILE = 2.0  # m covered by one texture
_THICKNESS = 0.1  # m, below z = 0
GROUND_REACH = 2000.0  # m from the origin, along either axis


# PyBullet's numbers of created collision and visual shapes, by what they were created from. They are reused, since
# PyBullet frees neither when a body is removed.
Made = dict[tuple[str, str], tuple[int, int]]


def create(
    client: int, files: BulletFiles, shape: SceneShape, pose: Pose, *, moves: bool, color: Sequence[float], made: Made
) -> int:
    """Create an object without its texture; return its body id. Only a URDF `moves`, with its own masses.

    Equal shapes share the PyBullet shapes in `made`. Raises ValueError, in one line, for a file that cannot be read.
    """
    position, orientation = pose
    try:
        geometry = shape.for_bullet(files, moves)
        if isinstance(geometry, UrdfFile):
            return _load(client, geometry, pose, moves)
        key = repr(geometry), repr(color)
        if key not in made:
            kind = getattr(pybullet, geometry.type)
            flags = {"flags": getattr(pybullet, geometry.flags)} if geometry.flags else {}
            made[key] = (
                pybullet.createCollisionShape(kind, physicsClientId=client, **geometry.collision, **flags),
                pybullet.createVisualShape(kind, rgbaColor=color, physicsClientId=client, **geometry.visual),
            )
        return pybullet.createMultiBody(0, *made[key], position, orientation, physicsClientId=client)
    except pybullet.error as error:
        raise ValueError(f"{shape}: PyBullet cannot create it ({error})") from None


def _load(client: int, urdf: UrdfFile, pose: Pose, moves: bool) -> int:
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE  # PyBullet would derive a wrong one from the bounds
    body = pybullet.loadURDF(urdf.path, *pose, useFixedBase=not moves, flags=flags, physicsClientId=client)
    links = [pybullet.getBodyInfo(body, client)[0]]
    links += [pybullet.getJointInfo(body, number, client)[12] for number in range(pybullet.getNumJoints(body, client))]
    for number, link in enumerate(links, start=-1):
        moments = urdf.moments[link.decode()]
        pybullet.changeDynamics(body, number, localInertiaDiagonal=moments, physicsClientId=client)
    return body


def load_rigid_body(client: int, files: BulletFiles, xml: str, pose: Pose) -> int:
    """Create the body of a merged URDF with its root link at a pose; return its body id."""
    path = files.urdf_of(xml)
    # The merged inertia is correct; PyBullet would derive a wrong one from the bounds of the collision shapes.
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    number = pybullet.loadURDF(path, pose.position, pose.orientation, flags=flags, physicsClientId=client)
    os.unlink(path)  # otherwise every new vehicle would leave a file
    return int(number)


def set_material(client: int, body: int) -> None:
    """Give a body V-REP's Bullet material: friction 1, no restitution, no damping (PyBullet damps by default)."""
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


# ---- the floor, and the ground around it


def floor_planes(size: float, ground: bool) -> list[Plane]:
    """Return what is drawn of a floor of `size` metres a side, at z = 0: the floor, and the ground around it.

    They share the floor's edge and do not overlap. Without `ground`, or if the floor is as large, there is no ground.
    """
    floor, reach = Plane(size, TILE), 2 * GROUND_REACH
    return [floor, Plane(reach, TILE, hole=size)] if ground and size < reach else [floor]


def create_floor(client: int, files: BulletFiles, planes: Sequence[Plane]) -> int:
    """Create the body of `floor_planes`; return its body id.

    The ground is the second visual shape of the floor's body: each body costs a step some 4 % of its time, even if
    nothing is near it.
    """
    half, depth = planes[0].size / 2, _THICKNESS / 2
    boxes = [(half, half, 0.0, 0.0)]  # half lengths in x and y, and centre
    for ground in planes[1:]:
        outer, width = ground.size / 2, (ground.size / 2 - half) / 2
        boxes += [(outer, width, 0.0, half + width), (outer, width, 0.0, -half - width)]
        boxes += [(width, half, half + width, 0.0), (width, half, -half - width, 0.0)]
    collision = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * len(boxes),
        halfExtents=[[x, y, depth] for x, y, _, _ in boxes],
        collisionFramePositions=[[x, y, -depth] for _, _, x, y in boxes],
        physicsClientId=client,
    )
    visual = pybullet.createVisualShapeArray(
        shapeTypes=[pybullet.GEOM_MESH] * len(planes),
        fileNames=[files.write(_mesh(plane), ".obj") for plane in planes],
        rgbaColors=[(1.0, 1.0, 1.0, 1.0), (*GROUND, 1.0)][: len(planes)],
        physicsClientId=client,
    )
    return int(pybullet.createMultiBody(0, collision, visual, physicsClientId=client))


def _mesh(plane: Plane) -> bytes:
    """Return a plane with its texture coordinates as an OBJ file."""
    (part,) = plane.triangles()
    assert part.uv is not None, "a plane has texture coordinates"
    lines = [f"v {x} {y} {z}" for x, y, z in part.corners.reshape(-1, 3)]
    lines += [f"vt {u} {v}" for u, v in part.uv.reshape(-1, 2)]
    lines += ["vn 0 0 1"]
    lines += [f"f {n}/{n}/1 {n + 1}/{n + 1}/1 {n + 2}/{n + 2}/1" for n in range(1, 3 * len(part.corners), 3)]
    return "\n".join([*lines, ""]).encode()
