"""Puts the balls somewhere, others for each place that the drone starts from, and says how far off its count is."""

import math
import random

PLACES = [(2 * math.pi * number / 11, 2.3 + 0.4 * (number % 2)) for number in range(11)]  # rad, m from the middle
RADIUS, AWAY = 0.15, (40, 40, -5)  # m: of a ball; where those are that are not there
NOTHING_SAID = 99  # no count is that far off
END = 24.9  # s, just before the flight ends
RED, OTHERS = [f"Red{number}" for number in range(1, 8)], ["Blue", "Green", "Yellow", "Violet"]


def sysCall_init():
    """Put the balls where they lie in this flight."""
    sim.setIntegerSignal("miscounted", NOTHING_SAID)  # from now on, the signal is this script's
    self.is_judged = False
    chance = random.Random(repr(sim.getObjectPosition(sim.getObject("/Quadcopter"), -1)))
    places = chance.sample(PLACES, len(PLACES))
    self.there = chance.randint(2, len(RED))
    for name in RED[: self.there] + OTHERS:
        angle, far = places.pop()
        put(name, far * math.cos(angle), far * math.sin(angle), RADIUS)
    for name in RED[self.there :]:
        put(name, *AWAY)


def put(name, x, y, z):
    """Put a ball at a place (m)."""
    sim.setObjectPosition(sim.getObject("/" + name), -1, [x, y, z])


def sysCall_sensing():
    """Compare the last number that the drone has said by the end, once: no script can try out what is right."""
    counted = sim.getIntegerSignal("counted")
    if not self.is_judged and counted is not None and sim.getSimulationTime() >= END:
        self.is_judged = True
        sim.setIntegerSignal("miscounted", counted - self.there)
