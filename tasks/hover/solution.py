"""Hold a place in the wind: a loop of place around the tutorial's loops of speed, with an integral."""

import math

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

PLACE, SUM = 0.6, 0.15  # (m/s) per m, (m/s) per m and second
MOST = 1.0  # m/s


def sysCall_init():
    """Begin as the tutorial's script does; remember the place."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # twice the tutorial's: it swings less (its stage 4)
    self.home = sim.getObjectPosition(self.d, -1)
    self.against = [0, 0]  # m/s, world: what it takes to stand still in the wind


def sysCall_sensing():
    """Command the way back to the place; the tutorial's script flies it."""
    hold()
    tutorial.sysCall_sensing()


def hold():
    """Set the commands: along the own axes, as the tutorial's are."""
    here, heading = sim.getObjectPosition(self.d, -1), sim.getObjectOrientation(self.d, -1)[2]
    wanted = [0, 0]
    for axis in (0, 1):
        error = self.home[axis] - here[axis]
        self.against[axis] += SUM * error * self.dt
        wanted[axis] = min(max(PLACE * error + self.against[axis], -MOST), MOST)
    ahead, left = math.cos(heading), math.sin(heading)
    self.vx, self.vy = ahead * wanted[0] + left * wanted[1], ahead * wanted[1] - left * wanted[0]
