"""Pushes: world-fixed forces and torques that last for a while."""

from __future__ import annotations

from typing import NamedTuple

from drone_sim.forces.force import Force, PushedBody
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.mechanics.wrench import Wrench


class Push(NamedTuple):
    """A force (N) at the centre of mass and a torque (N m), world frame, for `duration` seconds."""

    force: Vector
    torque: Vector
    duration: float


class Pushes(Force):
    """The pushes that act at present; they add up."""

    def __init__(self, time_step: float):
        """Start without pushes; `time_step` in seconds."""
        self._time_step = time_step
        self.lasting: list[tuple[Push, int]] = []  # with the number of remaining steps

    def add(self, push: Push) -> None:
        """Start a push; its duration is rounded to whole steps, at least one."""
        self.lasting.append((push, max(1, round(push.duration / self._time_step))))

    def add_to(self, wrench: Wrench, body: PushedBody) -> None:
        for push, _ in self.lasting:
            wrench.add(push.force, push.torque, (0.0, 0.0, 0.0))
        self.lasting = [(push, steps - 1) for push, steps in self.lasting if steps > 1]

    def save_state(self) -> Restore:
        return saved(self, "lasting")
