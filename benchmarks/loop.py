"""The simulation's loop without ROS, beside a bare PyBullet loop that only applies the forces and steps."""

import os
import time
from typing import Any, Callable, Dict, List

import pybullet

from drone_sim import frames, parameters
from drone_sim.drone import PROPELLERS
from drone_sim.simulation import Simulation
from drone_sim.state import Pose
from drone_sim.world import World

Row = Dict[str, Any]
STEP = 0.05  # s
SUB_STEPS = 10


def factor(name: str, step: Callable[[], Any], seconds: float) -> Row:
    """Time `step` (50 ms of simulated time) for a while; the factor is its share of the median time."""
    times = []
    for _ in range(5):
        step()
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        start = time.perf_counter()
        step()
        times.append(time.perf_counter() - start)
    times.sort()
    median, low, high = (times[int(len(times) * share)] for share in (0.5, 0.1, 0.9))
    return {"name": name, "factor": STEP / median, "p10": STEP / high, "p90": STEP / low, "step_us": 1e6 * median}


def bare(seconds: float) -> Row:
    """The floor of any PyBullet drone: the same body and floor, four thrusts and torques, a step; nothing read."""
    world = World(STEP / SUB_STEPS, -9.81)
    settings = parameters.load()
    world.add_floor(settings.scene.floor.size, settings.scene.floor.texture)
    simulation = Simulation(settings)
    body = world.add_rigid_body(simulation.drone.body, Pose(settings.drone.position))
    places = [frames.position(simulation.drone.body.links[f"propeller_{place}"]) for place, _ in PROPELLERS]
    simulation.close()
    client = world._client  # the bare loop is the one thing that goes behind the world's back
    thrust = [0.0, 0.0, 0.52 * 9.81 / 4]

    def step() -> None:
        for _ in range(SUB_STEPS):
            for place, (_, turn) in zip(places, PROPELLERS):
                pybullet.applyExternalForce(body, -1, thrust, place, pybullet.LINK_FRAME, client)
                pybullet.applyExternalTorque(body, -1, [0, 0, turn * 0.01], pybullet.LINK_FRAME, client)
            pybullet.stepSimulation(client)

    row = factor("bare PyBullet: forces and steps", step, seconds)
    world.close()
    return row


def ours(name: str, seconds: float, cameras: List[str]) -> Row:
    """The whole loop: script, propellers, dynamics, sensing, and the pictures of the cameras named."""
    simulation = Simulation(parameters.load())
    for camera in cameras:
        simulation.cameras[camera].watched = lambda: True
    row = factor(name, simulation.step, seconds)
    simulation.close()
    return row


def compare(seconds: float = 3.0) -> List[Row]:
    """Return the rows, measured on one core."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        floor = bare(seconds)
        rows = [
            ours("drone_sim, no camera", seconds, []),
            ours("drone_sim, front camera", seconds, ["front"]),
            ours("drone_sim, front and track camera", seconds, ["front", "track"]),
        ]
    finally:
        os.sched_setaffinity(0, cores)
    for row in [floor, *rows]:
        row["of_bare"] = row["factor"] / floor["factor"]
    return [floor, *rows]
