"""Fly through the gates in order: to a place before each, then to one behind it."""

import itertools
import math

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

BEFORE, BEHIND = -1.0, 0.6  # m from the gate's middle, along the way through it
NEAR = 0.25  # m: so near, a place is reached
APPROACH, FASTEST = 0.8, 0.9  # 1/s, m/s
TURN, CLIMB = 1.0, 0.5  # (rad/s) per rad, m/s


def sysCall_init():
    """Begin as the tutorial's script does; look up where to fly."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # twice the tutorial's: it swings less (its stage 4)
    self.places = [place for gate in gates() for place in around(gate)]


def gates():
    """Yield the handle of each gate, in order."""
    for number in itertools.count():
        gate = sim.getObject(f"/Gate[{number}]", {"noError": True})
        if gate == -1:
            return
        yield gate


def around(gate):
    """Return the places before and behind a gate: x, y, z (m), heading (rad)."""
    x, y, z = sim.getObjectPosition(gate, -1)
    heading = sim.getObjectOrientation(gate, -1)[2]
    ahead, aside = math.cos(heading), math.sin(heading)
    return [[x + way * ahead, y + way * aside, z, heading] for way in (BEFORE, BEHIND)]


def sysCall_sensing():
    """Command the way to the next place; the tutorial's script flies it."""
    if len(self.places) > 1 and is_reached(self.places[0]):
        self.places.pop(0)
    go_to(*self.places[0])
    tutorial.sysCall_sensing()


def is_reached(place):
    """Tell whether the drone is there."""
    return math.dist(sim.getObjectPosition(self.d, -1), place[:3]) < NEAR


def go_to(x, y, z, heading):
    """Fly towards a place, the slower the nearer; turn to the heading, rise to the height."""
    here, own = sim.getObjectPosition(self.d, -1), sim.getObjectOrientation(self.d, -1)[2]
    there = sim.getInvertedMatrix(sim.getObjectMatrix(self.trackBase, -1))
    ahead, left, _ = sim.multiplyVector(there, [x, y, here[2]])
    distance = math.hypot(ahead, left)
    speed = min(APPROACH, FASTEST / distance) if distance else 0
    self.vx, self.vy = speed * ahead, speed * left
    self.rz = TURN * math.remainder(heading - own, 2 * math.pi)
    rise = CLIMB * self.dt
    self.zref += min(max(z - self.zref, -rise), rise)
