"""Where the browsers look from: freely, from behind the drone, or with one of its cameras."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from drone_sim.mechanics import frames
from drone_sim.ros.cockpit.scene.frames import Frames

FREE, BEHIND = "free", "behind the drone"
_TRACK = "Track_base"
_BACK, _UP = 1.6, 0.7  # m: where the one behind is, in the level frame of the drone
_AHEAD = 0.4  # m, where it looks at
_STILL = 1e-4  # m


class Sight:
    """How the browsers look; the same for all that are open."""

    def __init__(self) -> None:
        """Begin behind the drone."""
        self.choice = BEHIND

    @staticmethod
    def choices(known: Frames, prefix: str) -> tuple[str, ...]:
        """Return what may be chosen for the vehicle whose frames begin with a prefix."""
        return BEHIND, FREE, *(frame for frame in known.eyes if frame.startswith(prefix))

    def follow(self, clients: Iterable[Any], known: Frames, prefix: str) -> None:
        """Move the browsers' eyes with the drone, where that is chosen."""
        if self.choice == FREE:
            return
        behind = self.choice == BEHIND
        matrix = known.place(f"{prefix}{_TRACK}" if behind else self.choice)
        if matrix is None:
            return
        eye = np.array(frames.transform(matrix, (-_BACK, 0, _UP) if behind else (0, 0, 0)))
        aim = np.array(frames.transform(matrix, (_AHEAD, 0, 0) if behind else (0, 0, 1)))
        up = frames.rotate(matrix, (0, 0, 1) if behind else (0, -1, 0))
        for camera in (client.camera for client in clients):
            if max(np.linalg.norm(camera.position - eye), np.linalg.norm(camera.look_at - aim)) > _STILL:
                with camera.client.atomic():
                    camera.up_direction = up
                    camera.position = eye
                    camera.look_at = aim
