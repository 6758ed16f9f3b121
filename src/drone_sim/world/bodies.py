"""Make PyBullet bodies of the objects of a scene that stand still, and of URDFs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pybullet

from drone_sim.mechanics.state import Pose
from drone_sim.shapes.bullet import Geometry, UrdfFile
from drone_sim.shapes.shape import SceneShape
from drone_sim.world.own_files import OwnFiles


def create(client: int, files: OwnFiles, shape: SceneShape, pose: Pose, *, moves: bool, color: Sequence[float]) -> int:
    """Add an object without its texture; return its body id. Only a URDF `moves`, by its own masses.

    Raises ValueError, in one line, for a file that cannot be read.
    """
    position, orientation = pose
    try:
        told = shape.for_bullet(files, moves)
        if isinstance(told, UrdfFile):
            return _load(client, told, pose, moves)
        solid = pybullet.createCollisionShape(physicsClientId=client, **_collision(told))
        seen = pybullet.createVisualShape(
            getattr(pybullet, told.type), rgbaColor=color, physicsClientId=client, **told.visual
        )
        return pybullet.createMultiBody(0, solid, seen, position, orientation, physicsClientId=client)
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


def _collision(told: Geometry) -> dict[str, Any]:
    flags = {"flags": getattr(pybullet, told.flags)} if told.flags else {}
    return {"shapeType": getattr(pybullet, told.type), **told.collision, **flags}
