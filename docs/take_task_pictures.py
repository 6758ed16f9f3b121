"""Take the pictures of tasks/: each task as a camera beside it sees it, after some seconds of its solution.

PYTHONPATH=src .venv/bin/python docs/take_task_pictures.py [TASK...]
"""

import math
import sys
from typing import NamedTuple

import numpy as np
from matplotlib import image

from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.run.simulation import Simulation

WIDTH, HEIGHT, FOV = 480, 270, 1.05  # px, px, rad
FRAME = 4  # px, white around what a drone's camera sees


class View(NamedTuple):
    """When (s) to look, from where, at what (m, world); which of the drone's cameras stands in the corner."""

    at: float
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    camera: str = ""


VIEWS = {
    "hover": View(6, (-1.6, -0.9, 1.7), (0, 0, 1.05)),
    "steps": View(2.0, (-1.0, -1.9, 2.0), (0.9, 0.1, 1.4)),
    "stability": View(14.3, (8.7, -1.1, 5.3), (10, 0, 4.9)),
    "gates": View(9, (-3.5, -5, 6), (4.2, 3, 0.8)),
    "gates_vision": View(5.5, (-2.2, -3.6, 3.6), (2.6, 0.4, 0.5), "front"),
    "line": View(9, (-1.5, -4.8, 3.4), (0, 0, 0), "floor"),
    "pad": View(7, (-2.4, -2.4, 3.2), (0, 0, 0.7), "floor"),
    "chase": View(9, (-2.4, -1.6, 2.6), (2.8, -1.6, 0.9), "front"),
    "count": View(6, (-3.9, -2.9, 4.2), (0.2, 0.3, 0), "front"),
    "formation": View(9, (1.6, -3.4, 2.6), (3.6, 0, 0.9)),
}


def main():
    """Take the pictures of the tasks that are named, or of all."""
    for name in sys.argv[1:] or VIEWS:
        path = tasks.find(name).parent / "picture.png"
        image.imsave(path, picture(plans.read(tasks.find(name)), VIEWS[name]))
        print(f"wrote {path}")


def picture(plan, view):
    """Return the picture (HEIGHT, WIDTH, 3) uint8 of a task."""
    parameters = plan.parameters()
    simulation = Simulation(parameters, script=plan.script_of(None))
    timeline = plan.timeline_of(parameters)
    for step in range(round(view.at / parameters.time_step)):
        timeline.apply(step, simulation.vehicles)
        simulation.step()
    for vehicle in simulation.vehicles.values():
        vehicle.propulsion.blades.show()
    intrinsics = Intrinsics(WIDTH, HEIGHT, FOV, 0.02, 100.0)
    drawn = simulation.vision.picture("color", intrinsics, looking(view.eye, view.target)).copy()
    if view.camera:
        small = simulation.vehicles[plan.vehicle_of(parameters)].cameras[view.camera].take()
        rows, columns = small.shape[:2]
        drawn[: rows + 2 * FRAME, : columns + 2 * FRAME] = 255
        drawn[FRAME : FRAME + rows, FRAME : FRAME + columns] = small
    simulation.close()
    return drawn


def looking(eye, target):
    """Return the pose (4, 4), world from optical frame, of a camera that looks from one place at another, level."""
    forward = np.subtract(target, eye) / math.dist(target, eye)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(forward, right), forward, eye
    return pose


if __name__ == "__main__":
    main()
