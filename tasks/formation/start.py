"""To begin with: the tutorial's controller, hovering, and where it should be beside its leader."""

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are


def sysCall_init():
    """Begin as the tutorial's script does; find the leader, and the own place beside it."""
    tutorial.sysCall_init()
    self.leader = sim.getObject("/Quadcopter[0]/base")
    self.offset = sim.getScriptSimulationParameter(sim.handle_self, "offset")  # m, ahead, left and up of the leader


def sysCall_sensing():
    """Say what to fly: vx and vy in m/s, ahead and to the left, rz in rad/s. The tutorial's script flies it."""
    place = sim.getObjectPosition(self.leader, -1)  # m, world; the offset is missing here
    there = sim.getInvertedMatrix(sim.getObjectMatrix(self.trackBase, -1))
    ahead, left, _ = sim.multiplyVector(there, place)  # m, from where the drone is
    self.vx, self.vy = 0 * ahead, 0 * left  # what should stand in place of the zeros?
    tutorial.sysCall_sensing()
