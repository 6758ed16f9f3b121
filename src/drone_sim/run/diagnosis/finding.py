"""What a diagnosis compares, counters of the simulation, and what it finds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player

_MAX_AGE = 3.0  # s of real time; older counts are not compared
OK, WARN, ERROR = 0, 1, 2  # levels of diagnostic_msgs/DiagnosticStatus


class Problem(NamedTuple):
    """Unexpected condition, with a text that also says what to do about it."""

    level: int
    what: str


class Finding(NamedTuple):
    """Name, worst level, one-line message, and values by name, as in DiagnosticStatus."""

    name: str
    level: int
    message: str
    values: Mapping[str, str]


def finding(name: str, fine: str, problems: Sequence[Problem], values: Mapping[str, str]) -> Finding:
    """Return a finding with the worst problem first; its message is `fine` if there are no problems."""
    level = max((problem.level for problem in problems), default=OK)
    worst_first = sorted(problems, key=lambda problem: -problem.level)
    return Finding(name, level, "; ".join(problem.what for problem in worst_first) or fine, values)


def numbers(values: Sequence[float], digits: int = 2) -> str:
    """Return numbers separated by spaces, with `digits` decimals and no minus sign before a zero."""
    return " ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)


# ---- counters


class Counts(NamedTuple):
    """Counters since a run began, or their differences between two diagnoses while the simulation was flying."""

    run: int
    state: str
    asked: float  # real-time factor requested
    seconds: float  # of real time; of a single count, with an arbitrary zero
    steps: int
    late: int  # steps
    pictures: int
    drawing: float  # s of real time
    shown: Mapping[tuple[str, str], int]  # number of pictures of each subscribed camera, by vehicle and camera
    clipped: Mapping[str, int]  # by vehicle, steps with a propeller at its limit


def count(player: Player, pacer: Pacer, at: float) -> Counts:
    """Return the present counts; `at` is the real time in s."""
    simulation = player.simulation
    vehicles, vision = simulation.vehicles, simulation.vision
    shown = {
        (name, key): camera.shown
        for name, vehicle in vehicles.items()
        for key, camera in vehicle.cameras.items()
        if camera.watched()
    }
    return Counts(
        run=simulation.run,
        state=player.state,
        asked=simulation.parameters.real_time_factor,
        seconds=at,
        steps=simulation.steps,
        late=pacer.overruns,
        pictures=vision.pictures,
        drawing=vision.seconds,
        shown=shown,
        clipped={name: vehicle.propulsion.law.clipped for name, vehicle in vehicles.items()},
    )


def between(before: Counts | None, now: Counts) -> Counts | None:
    """Return the differences between two counts; None if they cannot be compared."""
    if before is None or before[:3] != now[:3] or now.state != "flying":
        return None
    if not 0 < now.seconds - before.seconds < _MAX_AGE or now.steps < before.steps:  # a snapshot was restored
        return None
    return now._replace(
        seconds=now.seconds - before.seconds,
        steps=now.steps - before.steps,
        late=now.late - before.late,
        pictures=now.pictures - before.pictures,
        drawing=now.drawing - before.drawing,
        shown={key: now.shown[key] - before.shown[key] for key in now.shown if key in before.shown},
        clipped={name: now.clipped[name] - before.clipped.get(name, 0) for name in now.clipped},
    )
