"""A click on a vehicle pushes it, away from who looks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from geometry_msgs.msg import Vector3, WrenchStamped

from drone_sim.ros.cockpit.scene.frames import ROOT


def push(publish: Callable[[WrenchStamped], None], direction: Sequence[float], strength: float) -> None:
    """Push with so many N in a direction of the world."""
    message = WrenchStamped()
    message.header.frame_id = ROOT
    along = np.asarray(direction, dtype=float)
    message.wrench.force = Vector3(*(along / np.linalg.norm(along) * strength))
    publish(message)
