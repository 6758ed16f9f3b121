#!/usr/bin/env python3
"""Fly the drone from outside, step by step: lead its green sphere round a circle, and plot how the drone follows.

    roslaunch drone_sim drone.launch remote_api:=true script:=target
    python3 fly_outside.py --plot circle.png

Needs nothing but CoppeliaSim's own client and matplotlib: pip install coppeliasim-zmqremoteapi-client matplotlib
"""

import argparse
import math

from coppeliasim_zmqremoteapi_client import RemoteAPIClient
from matplotlib import pyplot

RADIUS, HEIGHT, TURN = 1.0, 1.5, 12.0  # m, m, s


def on_circle(time):
    """Return where the sphere is to be, in m, after so many seconds: it climbs, then goes round."""
    climb = min(time / 3.0, 1.0)
    angle = 2 * math.pi * max(0.0, time - 3.0) / TURN
    return [RADIUS * math.sin(angle), RADIUS * (1 - math.cos(angle)), 0.8 + climb * (HEIGHT - 0.8)]


def fly(sim, seconds):
    """Return the positions of the sphere and of the drone after every step."""
    drone, sphere = sim.getObject("/Quadcopter/base"), sim.getObject("/target")
    led, flown = [], []
    sim.setStepping(True)  # from now on, only sim.step() moves anything
    sim.startSimulation()
    try:
        while (time := sim.getSimulationTime()) < seconds - 1e-9:
            sim.setObjectPosition(sphere, on_circle(time))
            sim.step()
            led.append(sim.getObjectPosition(sphere))
            flown.append(sim.getObjectPosition(drone))
    finally:
        sim.stopSimulation()
    return led, flown


def plot(led, flown, file):
    """Draw both from above, and their heights."""
    figure, (above, height) = pyplot.subplots(1, 2, figsize=(10, 4.5), constrained_layout=True)
    for name, places in (("sphere", led), ("drone", flown)):
        x, y, z = zip(*places)
        above.plot(x, y, label=name)
        height.plot(z, label=name)
    above.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    height.set(xlabel="step", ylabel="z [m]")
    above.legend()
    figure.savefig(file) if file else pyplot.show()


def main(arguments=None):
    """Connect, fly, plot; return both paths."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", type=int, default=23000)
    parser.add_argument("--seconds", type=float, default=3.0 + TURN, help="of simulated time")
    parser.add_argument("--plot", metavar="FILE", help="a picture instead of a window")
    options = parser.parse_args(arguments)
    sim = RemoteAPIClient(port=options.port).require("sim")
    led, flown = fly(sim, options.seconds)
    print(f"{len(flown)} steps; at the end the drone is {math.dist(led[-1], flown[-1]):.2f} m from the sphere")
    plot(led, flown, options.plot)
    return led, flown


if __name__ == "__main__":
    main()
