"""Fly at an offset from the leader, in its track frame: as fast as that place moves, and towards it."""

import math

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

PLACE, FASTEST = 0.6, 1.5  # (m/s) per m, m/s
TURN = 1.0  # (rad/s) per rad


def sysCall_init():
    """Begin as the tutorial's script does; find the leader, and where to be."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # twice the tutorial's: it swings less (its stage 4)
    self.leader = sim.getObject("/Quadcopter[0]/base")
    self.offset = sim.getScriptSimulationParameter(sim.handle_self, "offset")


def sysCall_sensing():
    """Command the speed of the place, and a part of what is missing; then fly as the tutorial does."""
    follow()
    tutorial.sysCall_sensing()


def follow():
    """Set the commands: along the own axes, as the tutorial's are."""
    x, y, z = sim.getObjectPosition(self.leader, -1)
    (vx, vy, _), (_, _, turning) = sim.getObjectVelocity(self.leader)
    heading = sim.getObjectOrientation(self.leader, -1)[2]
    ahead, left = turned(self.offset[0], self.offset[1], heading)
    here, own = sim.getObjectPosition(self.d, -1), sim.getObjectOrientation(self.d, -1)[2]
    # A place on a turning frame moves across the way to it.
    wanted_x = vx - turning * left + PLACE * (x + ahead - here[0])
    wanted_y = vy + turning * ahead + PLACE * (y + left - here[1])
    share = min(1, FASTEST / max(math.hypot(wanted_x, wanted_y), 1e-9))
    self.vx, self.vy = turned(share * wanted_x, share * wanted_y, -own)
    self.vz, self.zref = 0, z + self.offset[2]
    self.rz = turning + TURN * math.remainder(heading - own, 2 * math.pi)


def turned(x, y, angle):
    """Return a level vector, turned about the vertical (rad)."""
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y
