"""Counters of the simulation, and their differences between two diagnoses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player

_MAX_AGE = 3.0  # s of real time; older counts are not compared
Key = tuple[str, str]  # vehicle, camera


class Since(NamedTuple):
    """Counts since a run began, or differences between two diagnoses while the simulation was flying."""

    seconds: float  # of real time
    steps: int
    late: int  # steps
    pictures: int
    drawing: float  # s of real time
    shown: Mapping[Key, int]  # number of pictures of each subscribed camera
    clipped: Mapping[str, int]  # by vehicle, steps with a propeller at its limit


class Counts(NamedTuple):
    """Counts at one time, and the state in which they were taken."""

    run: int
    state: str
    asked: float  # real-time factor requested
    since: Since  # since the run began; `seconds` has an arbitrary zero


def count(player: Player, pacer: Pacer, at: float) -> Counts:
    """Return the present counts; `at` is the real time in s."""
    simulation = player.simulation
    vehicles = simulation.vehicles
    shown = {
        (name, key): camera.shown
        for name, vehicle in vehicles.items()
        for key, camera in vehicle.cameras.items()
        if camera.watched()
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
    """Return the differences between two counts; None if they cannot be compared."""
    if before is None or before[:3] != now[:3] or now.state != "flying":
        return None
    old, new = before.since, now.since
    if not 0 < new.seconds - old.seconds < _MAX_AGE or new.steps < old.steps:  # a snapshot was restored
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
