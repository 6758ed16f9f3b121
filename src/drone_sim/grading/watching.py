"""Watches a flight, step by step, for what its criteria ask for."""

from __future__ import annotations

from typing import Any

import numpy as np

from drone_sim.grading.flown import Flown, Said, Touch
from drone_sim.grading.plan import Plan
from drone_sim.offline.recording import Recording
from drone_sim.run.simulation import Simulation


class Witness:
    """Keeps the rows of the graded vehicle, and of others and beside them only what a criterion asks for."""

    def __init__(self, plan: Plan, simulation: Simulation):
        """Take what is asked for, and a simulation before its first step."""
        self._simulation = simulation
        self._vehicle = plan.vehicle_of(simulation.parameters)
        self._recording = Recording(vehicle=self._vehicle)
        self._touches: list[Touch] = []
        self._touching: set[str] = set()  # in the step that is under way
        if any(one.sees_touches for one in plan.criteria):
            simulation.watch = self._look

    def begin(self) -> None:
        """Keep the state before the first step."""
        self._recording.add(self._simulation)

    def add(self) -> None:
        """Keep what a step has brought."""
        self._recording.add(self._simulation)
        if self._touching:
            now = self._simulation.time
            self._touches += [Touch(now, what) for what in sorted(self._touching)]
            self._touching.clear()

    def _look(self, count: int) -> None:
        """See after a sub-step what the vehicle touches: a blow may be over before the step is."""
        if count:
            self._touching.update(self._simulation.vehicles[self._vehicle].touched())

    def flown(self) -> Flown:
        """Return the flight so far."""
        return Flown(np.array(self._recording.rows), tuple(self._touches))
