"""Plans, results and tables made without a flight, for tests of the outputs of grading."""

import math

from drone_sim.grading import plan as plans
from drone_sim.grading.result import Outcome, Result
from drone_sim.offline.recording import Recording

EVIL = "<script>alert(1)</script>&\"'\x1b[31m\x07\0\x9b\u202e\ud800"
PLAN = """
title: Hover & <b>more</b>
duration: 4
criteria:
  - {kind: rise_time, of: vx, to: 1, at_most: 1, points: 2, name: forward}
  - {kind: no_contact}
"""
SCENE = """
drone: {position: [0, 0, 0.8]}
objects:
  - {name: "<i>Gate</i>", shape: box, size: [0.2, 1, 2], position: [2, 0, 1], color: [1, 0, 0]}
  - {name: Pole, shape: cylinder, size: [0.1, 1], position: [0, 0, 1], parent: "<i>Gate</i>"}
"""


def read_plan(folder, text=PLAN, scene=""):
    if scene:
        (folder / "scene.yaml").write_text(scene)
        text += "scene: scene.yaml\n"
    (folder / "steps.yaml").write_text(text)
    return plans.read(folder / "steps.yaml")


def outcome(name, passed, value=0.5, at=1.5, of=1.0, said="it rose in 0.5 s"):
    return Outcome(name, "rise_time", passed, value, "s", "at most 1 s", of if passed else 0.0, of, at, said)


def result(script="my.py", seed=0, passed=(True, True), error=None, changes=None, names=("forward", "no_contact")):
    outcomes = tuple(outcome(name, good, of=2.0 - at) for at, (name, good) in enumerate(zip(names, passed)))
    points, possible = (sum(getattr(entry, key) for entry in outcomes) for key in ("points", "of"))
    has_passed = error is None and all(entry.passed for entry in outcomes)
    return Result("steps", script, seed, changes or {}, has_passed, points, possible, 4.0, error, outcomes)


def write_table(path, seconds=4.0):
    """Write the table of a flight (m) on a circle of radius 1 about (1, 0) that climbs from 0.8."""
    with open(path, "w") as file:
        recording = Recording(file)
        for step in range(round(seconds / 0.05) + 1):
            recording.write_row((step * 0.05, *place(step * 0.05), 0, 0, 0, 1, *(0,) * 6, *(0,) * 4, *(5.3,) * 4))
    return path


def place(time):
    return 1 - math.cos(time), math.sin(time), 0.8 + 0.1 * time
