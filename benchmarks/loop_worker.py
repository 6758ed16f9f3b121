"""A process that `against` starts once for each checkout: it times steps of one flight whenever a line comes in.

It uses only what every version of drone_sim has. A step takes 50 ms of simulated time.
"""

import statistics
import sys
import time
from collections.abc import Callable
from typing import NamedTuple

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

STEPS = 20  # timed at once
LEG = 60  # steps that the drone flies one way


class Flight(NamedTuple):
    """A simulation, and a function that takes one step of it."""

    simulation: Simulation
    step: Callable[[], None]


def hover() -> Flight:
    """Return the flight of a drone that hovers."""
    simulation = Simulation(parameters.load())
    return Flight(simulation, simulation.step)


def turns() -> Flight:
    """Return the flight of a drone that flies to and fro at up to 5 m/s, and turns at 1 rad/s."""
    simulation = Simulation(parameters.load())
    ways = [Twist(Vector3(x=speed), Vector3(z=1.0)) for speed in (5.0, -5.0)]

    def step() -> None:
        if simulation.steps % LEG == 0:
            simulation.drone.commands.receive(ways[simulation.steps // LEG % 2])
        simulation.step()

    return Flight(simulation, step)


def wind() -> Flight:
    """Return the flight of a drone that hovers in wind and gusts, with an IMU."""
    weather = {"wind": [2.0, 1.0, 0.0], "gusts": {"deviation": [0.5, 0.5, 0.2]}}
    simulation = Simulation(parameters.load({"weather": weather, "sensors": {"imu": {"kind": "imu", "rate": 200.0}}}))
    return Flight(simulation, simulation.step)


FLIGHTS = {"hover": hover, "turns": turns, "wind": wind}


def main() -> None:
    """Time STEPS steps of the flight that is named for every line of the standard input; print the median (s)."""
    step = FLIGHTS[sys.argv[1]]().step
    for _ in range(LEG):
        step()
    print("ready", flush=True)
    for _ in sys.stdin:
        times = []
        for _ in range(STEPS):
            start = time.perf_counter()
            step()
            times.append(time.perf_counter() - start)
        print(statistics.median(times), flush=True)


if __name__ == "__main__":
    main()
