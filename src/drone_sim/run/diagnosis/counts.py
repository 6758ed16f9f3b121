"""What is counted all the time, read now and then: what happened in between is the difference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player

_FRESH = 3.0  # s of real time; what is older says nothing of now
Key = tuple[str, str]  # a vehicle, and one of its cameras


class Counts(NamedTuple):
    """As they are at a moment."""

    at: float  # s of real time
    run: int
    state: str
    asked: float  # the real-time factor
    steps: int
    late: int  # steps
    pictures: int
    drawing: float  # s of real time
    shown: Mapping[Key, int]  # pictures, of the cameras that somebody looks at
    clipped: Mapping[str, int]  # steps in which a vehicle's propellers were at a limit


class Since(NamedTuple):
    """What has been between two looks of the same run, at both of which it flew."""

    seconds: float  # of real time
    steps: int
    late: int
    pictures: int
    drawing: float
    shown: Mapping[Key, int]  # of the cameras that were looked at all the time
    clipped: Mapping[str, int]


def count(player: Player, pacer: Pacer, at: float) -> Counts:
    """Return the counts; `at` is the real time in s."""
    simulation = player.simulation
    vehicles = simulation.vehicles
    shown = {
        (name, camera): one.shown
        for name, vehicle in vehicles.items()
        for camera, one in vehicle.cameras.items()
        if one.watched()
    }
    vision = simulation.vision
    return Counts(
        at=at,
        run=simulation.run,
        state=player.state,
        asked=simulation.parameters.real_time_factor,
        steps=simulation.steps,
        late=pacer.overruns,
        pictures=vision.pictures,
        drawing=vision.seconds,
        shown=shown,
        clipped={name: vehicle.propulsion.law.clipped for name, vehicle in vehicles.items()},
    )


def between(before: Counts | None, now: Counts) -> Since | None:
    """Return what has been in between; None where nothing can be said of it."""
    if before is None or before.run != now.run or not 0 < now.at - before.at < _FRESH:
        return None
    if before.asked != now.asked:
        return None
    if (before.state, now.state) != ("flying", "flying") or now.steps < before.steps:  # a snapshot came back
        return None
    return Since(
        seconds=now.at - before.at,
        steps=now.steps - before.steps,
        late=now.late - before.late,
        pictures=now.pictures - before.pictures,
        drawing=now.drawing - before.drawing,
        shown={key: now.shown[key] - before.shown[key] for key in now.shown if key in before.shown},
        clipped={name: now.clipped[name] - before.clipped.get(name, 0) for name in now.clipped},
    )
