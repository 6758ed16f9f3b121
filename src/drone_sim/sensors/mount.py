"""Where a sensor sits that has no link in the URDF."""

from __future__ import annotations

import math

from drone_sim.config.types import Angles, Checked, Label, Point
from drone_sim.mechanics.frames import Matrix, from_rpy, multiply

# An optical frame (z forward, x right, y down) in a frame with x forward, y left, z up: REP-103.
_OPTICAL = from_rpy((0.0, 0.0, 0.0), (-math.pi / 2, 0.0, -math.pi / 2))


class MountParameters(Checked):
    """A place in the frame of an object ('' is the vehicle's root): metres; rad, roll, pitch, yaw.

    Cameras look, and rays go, along its +x.
    """

    parent: Label = ""
    position: Point
    rpy: Angles

    @property
    def frame(self) -> Matrix:
        """Parent from the mounted frame: x forward, y left, z up."""
        return from_rpy(self.position, self.rpy)

    @property
    def optical(self) -> Matrix:
        """Parent from the optical frame of a camera that is mounted so: z forward, x right, y down."""
        return multiply(self.frame, _OPTICAL)
