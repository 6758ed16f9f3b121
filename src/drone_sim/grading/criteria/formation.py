"""Formation: how far the vehicle is from a place beside another vehicle, or an object, that moves."""

from __future__ import annotations

from typing import Literal

import numpy as np

from drone_sim.config.types import Label, Point
from drone_sim.grading.criteria.criterion import DistanceCriterion, FlightPart
from drone_sim.grading.result import Outcome


class Formation(DistanceCriterion):
    """`to` is a vehicle's name, or an object's as scripts find it; `offset` (m) is where the vehicle is to be from it.

    The offset is along the axes of the world, or, with `turns`, of the other's level frame, which turns with its yaw.
    """

    kind: Literal["formation"]
    to: Label
    offset: Point = (0.0, 0.0, 0.0)
    turns: bool = False

    @property
    def others(self) -> tuple[str, ...]:
        """What it asks for."""
        return (self.to,)

    def _judged(self, part: FlightPart) -> Outcome:
        poses = part.poses(self.to)
        offsets = np.tile(self.offset, (len(poses), 1))
        if self.turns:
            x, y, z, w = poses[:, 3:7].T
            yaw = np.arctan2(2 * (x * y + z * w), 1 - 2 * (y * y + z * z))
            ahead, aside, _ = self.offset
            offsets[:, 0] = np.cos(yaw) * ahead - np.sin(yaw) * aside
            offsets[:, 1] = np.sin(yaw) * ahead + np.cos(yaw) * aside
        gaps = part.places() - poses[:, :3] - offsets
        what = f"its place beside {self.to}" if any(self.offset) else self.to
        return self._outcome_of(np.linalg.norm(self._along(gaps), axis=1), part.times, what)
