"""What is counted all the time, read now and then: what happened in between is the difference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player

_FRESH = 3.0  # s of real time; what is older says nothing of now
Key = tuple[str, str]  # a vehicle, and one of its cameras


class Since(NamedTuple):
    """Counts since a run began, or the differences between two looks, if the simulation was flying at both."""

    seconds: float  # of real time
    steps: int
    late: int  # steps
    pictures: int
    drawing: float  # s of real time
    shown: Mapping[Key, int]  # pictures, of the cameras that somebody looks at
    clipped: Mapping[str, int]  # steps in which a vehicle's propellers were at a limit


class Counts(NamedTuple):
    """What is counted, at a moment, and in which state."""

    run: int
    state: str
    asked: float  # the real-time factor
    since: Since  # any moment; seconds count from anywhere


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
    since = Since(
        seconds=at,
        steps=simulation.steps,
        late=pacer.overruns,
        pictures=vision.pictures,
        drawing=vision.seconds,
        shown=shown,
        clipped={name: vehicle.propulsion.law.clipped for name, vehicle in vehicles.items()},
    )
    return Counts(simulation.run, player.state, simulation.parameters.real_time_factor, since)


def between(before: Counts | None, now: Counts) -> Since | None:
    """Return the differences between two looks; None where they cannot be compared."""
    if before is None or before[:3] != now[:3] or now.state != "flying":
        return None
    old, new = before.since, now.since
    if not 0 < new.seconds - old.seconds < _FRESH or new.steps < old.steps:  # a snapshot came back
        return None
    return Since(
        seconds=new.seconds - old.seconds,
        steps=new.steps - old.steps,
        late=new.late - old.late,
        pictures=new.pictures - old.pictures,
        drawing=new.drawing - old.drawing,
        shown={key: new.shown[key] - old.shown[key] for key in new.shown if key in old.shown},
        clipped={name: new.clipped[name] - old.clipped.get(name, 0) for name in new.clipped},
    )
