"""The drone that is followed: to the left round a circle of 3 m, up and down a little, after a rest."""

import math

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup, sysCall_init  # called as they are

REST, SPEED, RADIUS = 2.0, 0.5, 3.0  # s, m/s, m
SWING, PERIOD = 0.1, 15.0  # m/s, s: up and down


def sysCall_sensing():
    """Command the circle; the tutorial's script flies it."""
    t = sim.getSimulationTime() - REST
    if t >= 0:
        self.vx, self.rz = SPEED, SPEED / RADIUS
        self.vz = SWING * math.cos(2 * math.pi * t / PERIOD)
    tutorial.sysCall_sensing()
