"""Make PyBullet bodies of the objects of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pybullet

from drone_sim.mechanics.state import Pose
from drone_sim.shapes.bullet import Geometry, UrdfFile
from drone_sim.shapes.shape import SceneShape
from drone_sim.world.own_files import OwnFiles


def create(client: int, files: OwnFiles, shape: SceneShape, pose: Pose, *, mass: float, color: Sequence[float]) -> int:
    """Add an object without its texture; return its body id.

    Raises ValueError, in one line, for a file that cannot be read.
    """
    position, orientation = pose
    try:
        told = shape.for_bullet(files, moves=mass != 0)
        if isinstance(told, UrdfFile):
            return pybullet.loadURDF(told.path, position, orientation, useFixedBase=mass == 0, physicsClientId=client)
        solid = pybullet.createCollisionShape(physicsClientId=client, **_collision(told))
        seen = pybullet.createVisualShape(
            getattr(pybullet, told.type), rgbaColor=color, physicsClientId=client, **told.visual
        )
        return pybullet.createMultiBody(mass, solid, seen, position, orientation, physicsClientId=client)
    except pybullet.error as error:
        raise ValueError(f"{shape}: PyBullet cannot make it ({error})") from None


def _collision(told: Geometry) -> dict[str, Any]:
    flags = {"flags": getattr(pybullet, told.flags)} if told.flags else {}
    return {"shapeType": getattr(pybullet, told.type), **told.collision, **flags}
