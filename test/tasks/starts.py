"""Displacements of the drone, and whether the built-in script returns to rest from them."""

import itertools
import logging
import math
from pathlib import Path

from drone_sim.grading import flight
from drone_sim.grading import plan as plans
from drone_sim.mechanics import frames

PLAN = Path(__file__).resolve().with_name("starts.yaml")
ALL = list(
    itertools.product(
        (0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0),  # m, above the height to hold
        (0.0, 0.3, 0.6, 0.9, 1.2),  # rad, tilt
        (0.0, math.pi / 4, math.pi / 2, 0.9 * math.pi),  # rad, azimuth of the axis of the tilt
    )
)


def returns(start, changes):
    """Return whether the built-in script brings the drone to rest; `changes` are parameters."""
    logging.disable(logging.WARNING)
    above, tilt, azimuth = start
    half = math.sin(tilt / 2)
    turn = half * math.cos(azimuth), half * math.sin(azimuth), 0.0, math.cos(tilt / 2)
    rpy = frames.to_rpy(frames.from_quaternion((0, 0, 0), turn))
    entry = {"at": 0, "pose": {"position": [10, 0, 5 + above], "rpy": list(rpy)}}
    return flight.grade(plans.read(PLAN).model_copy(update={"timeline": [entry]}), "", 0, changes).passed
