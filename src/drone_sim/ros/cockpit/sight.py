"""Where a browser looks from: freely, from behind the drone, or with one of its cameras."""

from __future__ import annotations

from typing import Any

import numpy as np
from geometry_msgs.msg import Transform

from drone_sim.mechanics import frames

FREE, BEHIND = "free", "behind the drone"
_BACK, _UP = 1.6, 0.7  # m: where the one behind is, in the level frame of the drone
_AHEAD = 0.4  # m, where it looks at
_STILL = 1e-4  # m


class Sight:
    """How the browsers look; the same for all that are open."""

    def __init__(self) -> None:
        """Begin behind the drone."""
        self.choice = BEHIND

    def follow(self, clients: Any, track: Transform | None) -> None:
        """Move the browsers' eyes with the drone, where that is chosen."""
        if self.choice == FREE or track is None:
            return
        at, turn = track.translation, track.rotation
        matrix = frames.from_quaternion((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
        eye, aim = (np.array(frames.transform(matrix, point)) for point in ((-_BACK, 0, _UP), (_AHEAD, 0, 0)))
        for camera in (client.camera for client in clients):
            if max(np.linalg.norm(camera.position - eye), np.linalg.norm(camera.look_at - aim)) > _STILL:
                with camera.client.atomic():
                    camera.position = eye
                    camera.look_at = aim
