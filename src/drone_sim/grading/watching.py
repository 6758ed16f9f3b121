"""Watches a flight, step by step, for what its criteria ask for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from drone_sim.grading.flown import Flown, Said, Touch
from drone_sim.grading.plan import Plan
from drone_sim.grading.topics import Topics
from drone_sim.mechanics.frames import position, to_quaternion
from drone_sim.offline.recording import COLUMNS, Recording
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.control import STOP

_NOWHERE = (math.nan,) * 7


class Witness:
    """Keeps the rows of the graded vehicle, and beside them only what a criterion asks for."""

    def __init__(self, plan: Plan, simulation: Simulation, topics: Topics):
        """Take what is asked for, a simulation before its first step, and what carries its topics.

        Raises ValueError for a vehicle or object that is not there.
        """
        self._simulation = simulation
        self._duration = plan.duration
        own = plan.vehicle_of(simulation.parameters)
        self._vehicle = simulation.vehicles[own]
        self._recording = Recording(vehicle=own)
        self._contacts, self._body = simulation.world.contacts, self._vehicle.body.number  # asked ten times a step
        self._touches: list[Touch] = []
        self._touching: set[str] = set()  # in the step that is under way
        self._said: dict[str, list[Said]] = {}
        self._others: dict[str, list[tuple[float, ...]]] = {}
        self._each_step: list[Callable[[], None]] = [lambda: self._recording.add(simulation)]
        self._listen(plan, topics)

    def _listen(self, plan: Plan, topics: Topics) -> None:
        if any(one.sees_touches for one in plan.criteria):
            self._simulation.watch = self._look
            self._each_step.append(self._keep_touches)
        if any(one.sees_states for one in plan.criteria):
            self._follow("", lambda: str(self._vehicle.flight_state))
        for signal in dict.fromkeys(name for one in plan.criteria for name in one.signals):
            self._follow(signal, lambda name=signal: self._signal(name))  # type: ignore[misc]
        own = self._vehicle.bus.said
        for topic, full in topics.wanted.items():
            self._follow(topic, lambda name=full: topics.last.get(name, own.get(name)))  # type: ignore[misc]
        for other in dict.fromkeys(name for one in plan.criteria for name in one.others):
            self._check(other)
            self._others[other] = []
            self._each_step.append(lambda name=other: self._others[name].append(self._pose(name)))  # type: ignore[misc]

    def keep(self) -> None:
        """Keep what there is now: before the first step, and after each."""
        for keep in self._each_step:
            keep()

    @property
    def rows(self) -> np.ndarray:
        """The rows so far, (N, 22)."""
        return np.array(self._recording.rows).reshape(-1, len(COLUMNS))

    def flown(self) -> Flown | None:
        """Return the flight so far; None before there is any."""
        rows = self.rows
        if not len(rows):
            return None
        return Flown(
            rows,
            bool(rows[-1, 0] >= self._duration - 1e-9),
            tuple(self._touches),
            tuple(self._said.get("", ())),
            self._said,
            {name: np.array(poses) for name, poses in self._others.items()},
        )

    @property
    def is_over(self) -> bool:
        """Whether a script has stopped the simulation."""
        return self._simulation.asked == STOP

    # ---- what is asked for

    def _look(self, count: int) -> None:
        """See after a sub-step what the vehicle touches: a blow may be over before the step is."""
        if count and (touches := self._contacts(self._body)):
            names = self._simulation.shared.names
            self._touching.update(names.get(one.body, ("", ""))[0] for one in touches)

    def _keep_touches(self) -> None:
        if self._touching:
            now = self._simulation.time
            self._touches += [Touch(now, what) for what in sorted(self._touching)]
            self._touching.clear()

    def _follow(self, name: str, value: Callable[[], Any]) -> None:
        """Keep a value whenever it has become another."""
        kept = self._said[name] = []

        def look() -> None:
            now, last = value(), kept[-1].value if kept else None
            if now is not last and not _same(now, last):
                kept.append(Said(self._simulation.time, now))

        self._each_step.append(look)

    def _signal(self, name: str) -> Any:
        """Return what a signal of any kind says; None where there is none."""
        signals = self._simulation.shared.signals
        for get in (signals.getInt32Signal, signals.getFloatSignal, signals.getStringSignal):
            value = get(name)
            if value is not None:
                return value
        return None

    def _check(self, name: str) -> None:
        """Raise ValueError where no vehicle and no object has that name."""
        if name not in self._simulation.vehicles:
            self._simulation.shared.objects.handle(name)

    def _pose(self, name: str) -> tuple[float, ...]:
        """Return position (m) and quaternion (xyzw) of a vehicle or object, in the world; NaN once it is gone."""
        vehicle = self._simulation.vehicles.get(name)
        if vehicle is not None:
            return (*vehicle.state.position, *vehicle.state.orientation)
        objects = self._simulation.shared.objects
        if name not in objects:
            return _NOWHERE
        matrix = objects.matrix(objects.handle(name))
        return (*position(matrix), *to_quaternion(matrix))


def _same(first: Any, second: Any) -> bool:
    """Tell whether two values are equal; those that cannot be compared, such as arrays in messages, are not."""
    try:
        return bool(first == second)
    except Exception:
        return False
