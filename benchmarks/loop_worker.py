"""A process that `against` starts once for each checkout: it times steps of one flight whenever a line comes in.

It uses only what every version of drone_sim has. A step takes 50 ms of simulated time.
"""

import statistics
import sys
import time
from collections.abc import Callable

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

STEPS = 400  # timed at once
LEG = 60  # steps that the drone flies one way


def hover() -> Callable[[], None]:
    """Return the step of a drone that hovers."""
    return Simulation(parameters.load()).step


def turns() -> Callable[[], None]:
    """Return the step of a drone that flies to and fro at up to 5 m/s, and turns at 1 rad/s."""
    simulation = Simulation(parameters.load())
    ways = [Twist(Vector3(x=speed), Vector3(z=1.0)) for speed in (5.0, -5.0)]

    def step() -> None:
        if simulation.steps % LEG == 0:
            simulation.drone.commands.receive(ways[simulation.steps // LEG % 2])
        simulation.step()

    return step


def wind() -> Callable[[], None]:
    """Return the step of a drone that hovers in wind and gusts, with an IMU."""
    weather = {"wind": [2.0, 1.0, 0.0], "gusts": {"deviation": [0.5, 0.5, 0.2]}}
    return Simulation(parameters.load({"weather": weather, "sensors": {"imu": {"kind": "imu", "rate": 200.0}}})).step


FLIGHTS = {"hover": hover, "turns": turns, "wind": wind}


def main() -> None:
    """Time STEPS steps of the flight that is named for every line of the standard input; print the median (s)."""
    step = FLIGHTS[sys.argv[1]]()
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
