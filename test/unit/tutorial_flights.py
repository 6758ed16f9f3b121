"""Flights of docs/tutorial's scripts, for the tests of the tutorial."""

import contextlib
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from drone_sim.forces.pushes import Push
from drone_sim.offline import timeline
from drone_sim.offline.fly import settings
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
TEXT = (DOCS / "tutorial.md").read_text(encoding="utf-8")
STAGES = {path.stem: path for path in sorted((DOCS / "tutorial").glob("[0-9]_*.py"))}
CONTROLLERS = [name for name in STAGES if name[0] < "8"]  # these contain the whole control law; stage 8 builds on it


@contextlib.contextmanager
def flying(stage, *assignments, backend=None):
    # A script that imports OpenCV may take longer than the default limit on a busy machine.
    values = parameters.load(settings(("script_time_limit=60", *assignments)))
    simulation = Simulation(values, script=str(STAGES[stage]) if stage in STAGES else stage, backend=backend)
    try:
        yield simulation
    finally:
        simulation.close()


def fly(simulation, seconds, commands=None):
    """Return x y z, velocities, yaw and propellers after each step, as arrays by name."""
    states, yaws, propellers = [], [], []
    for step in range(round(seconds / simulation.parameters.time_step)):
        if commands is not None:
            commands.apply(step, simulation.vehicles)
        simulation.step()
        states.append([number for part in simulation.drone.body.state for number in part])
        yaws.append(math.atan2(simulation.drone.body.matrix[4], simulation.drone.body.matrix[0]))
        propellers.append(simulation.drone.propulsion.particle_velocities)
    columns = np.array(states).T
    names = ["x", "y", "z", "qx", "qy", "qz", "qw", "vx", "vy", "vz", "wx", "wy", "wz"]
    flight = SimpleNamespace(**dict(zip(names, columns)))
    flight.states, flight.yaw, flight.propellers = np.array(states), np.array(yaws), np.array(propellers)
    return flight


def fly_timeline(stage, name, *assignments, seconds=None):
    with flying(stage, *assignments) as simulation:
        commands = timeline.read(str(DOCS / "tutorial" / name), simulation.parameters)
        return fly(simulation, seconds or commands.end + 5, commands)


def at(values, seconds):
    return values[round(seconds / 0.05) - 1]


def push(drone, force=(0, 0, 0), torque=(0, 0, 0), seconds=0.2):
    drone.pushes.add(Push(force, torque, seconds))
