"""Puts the pads somewhere, elsewhere for each place that the drone starts from."""

import math
import random

FAR, APART = (0.7, 1.0), (1.2, math.pi)  # m from the origin; rad between the two


def sysCall_init():
    """Put the pads where they lie in this flight."""
    chance = random.Random(repr(sim.getObjectPosition(sim.getObject("/Quadcopter"), -1)))
    first = chance.uniform(-math.pi, math.pi)
    second = first + chance.choice((-1, 1)) * chance.uniform(*APART)
    for name, angle in (("/Pad7", first), ("/Pad23", second)):
        pad, far = sim.getObject(name), chance.uniform(*FAR)
        height = sim.getObjectPosition(pad, -1)[2]
        sim.setObjectPosition(pad, -1, [far * math.cos(angle), far * math.sin(angle), height])
        sim.setObjectOrientation(pad, -1, [0, 0, chance.uniform(-math.pi, math.pi)])
