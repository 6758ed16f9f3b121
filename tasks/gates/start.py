"""To begin with: the tutorial's controller, flying straight ahead, and where the first gate is."""

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are


def sysCall_init():
    """Begin as the tutorial's script does; find the first gate."""
    tutorial.sysCall_init()
    self.gate = sim.getObjectPosition(sim.getObject("/Gate[0]"), -1)  # m, world: its middle


def sysCall_sensing():
    """Say what to fly: vx and vy in m/s, ahead and to the left, rz in rad/s. The tutorial's script flies it."""
    ahead = self.gate[0] - sim.getObjectPosition(self.d, -1)[0]  # m
    self.vx, self.vy, self.rz = 0.5 if ahead > 0 else 0, 0, 0
    self.zref = self.gate[2]  # m, the height that it holds
    tutorial.sysCall_sensing()
