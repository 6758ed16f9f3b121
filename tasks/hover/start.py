"""To begin with: the tutorial's controller, which holds a speed, and how far the wind has carried it."""

import math

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are


def sysCall_init():
    """Begin as the tutorial's script does; remember the place."""
    tutorial.sysCall_init()
    self.home = sim.getObjectPosition(self.d, -1)


def sysCall_sensing():
    """Say what to fly: vx and vy in m/s, ahead and to the left, rz in rad/s. The tutorial's script flies it."""
    here, heading = sim.getObjectPosition(self.d, -1), sim.getObjectOrientation(self.d, -1)[2]
    x, y = self.home[0] - here[0], self.home[1] - here[1]  # m, along the world's x and y
    ahead = math.cos(heading) * x + math.sin(heading) * y  # m, of the way back
    left = math.cos(heading) * y - math.sin(heading) * x
    self.vx, self.vy = 0 * ahead, 0 * left  # what should stand in place of the zeros?
    tutorial.sysCall_sensing()
