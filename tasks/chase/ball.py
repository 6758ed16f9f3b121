"""The ball of the task: round an oval, up and down a little, beginning slowly."""

import math

# ruff: noqa: F821 -- `sim` and `self` are there when a child script runs

CENTRE, RADII = (5.0, 0.0, 1.0), (3.0, 3.0, 0.2)  # m
TURN, SLOW = 0.17, 4.0  # rad/s; s until it is that fast


def sysCall_init():
    """Find the ball."""
    self.ball = sim.getObject(".")


def sysCall_actuation():
    """Move it to where it is at this time."""
    t = sim.getSimulationTime()
    angle = TURN * (t - SLOW * (1 - math.exp(-t / SLOW)))
    x, y, z = CENTRE
    place = [x - RADII[0] * math.cos(angle), y - RADII[1] * math.sin(angle), z + RADII[2] * math.sin(2 * angle)]
    sim.setObjectPosition(self.ball, -1, place)
