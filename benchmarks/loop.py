"""The simulation's loop without ROS, beside a bare PyBullet loop that only applies the forces and steps."""

import statistics
import time
from collections.abc import Callable
from typing import Any

import pybullet
from tqdm import tqdm

from benchmarks.cores import one_core
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.state import Pose
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.types import QUADRICOPTER
from drone_sim.world import World

Row = dict[str, Any]
STEP = 0.05  # s
SUB_STEPS = 10


def race(steps: dict[str, Callable[[], Any]], rounds: int, seconds: float) -> list[Row]:
    """Time each `step` (50 ms of simulated time) by turns: the machine's own ups and downs hit all alike.

    The factor is from the median time; `of_bare` is the median, over the rounds, of the share of the first one.
    """
    times: dict[str, list[float]] = {name: [] for name in steps}
    shares: dict[str, list[float]] = {name: [] for name in steps}
    for _ in tqdm(range(rounds), desc="  rounds", leave=False):
        medians = {name: _times(step, seconds) for name, step in steps.items()}
        first = statistics.median(next(iter(medians.values())))
        for name, some in medians.items():
            times[name] += some
            shares[name].append(first / statistics.median(some))
    return [_row(name, sorted(times[name]), statistics.median(shares[name])) for name in steps]


def _times(step: Callable[[], Any], seconds: float) -> list[float]:
    times = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        start = time.perf_counter()
        step()
        times.append(time.perf_counter() - start)
    return times


def _row(name: str, times: list[float], share: float) -> Row:
    median, low, high = (times[int(len(times) * part)] for part in (0.5, 0.1, 0.9))
    spread = {"p10": STEP / high, "p90": STEP / low, "step_us": 1e6 * median}
    return {"name": name, "factor": STEP / median, **spread, "of_bare": share}


def _drone_alone() -> tuple[int, int, list[Vector]]:
    """Return PyBullet's client and body of a drone above its floor, and the places of its propellers."""
    world = World(STEP / SUB_STEPS, -9.81)
    settings = parameters.load()
    world.add_floor(settings.scene.floor.size, settings.scene.floor.texture)
    simulation = Simulation(settings)
    body = world.add_rigid_body(simulation.drone.body.rigid, Pose(settings.drone.position))
    places = [
        frames.position(simulation.drone.body.rigid.links[f"propeller_{place}"]) for place, _ in QUADRICOPTER.rotors
    ]
    simulation.close()
    return world._client, body, places  # the bare loops are the only ones that go behind the world's back


def bare() -> Callable[[], None]:
    """Return a step of the floor of any PyBullet drone: same body, four thrusts and torques, a step; nothing read."""
    client, body, places = _drone_alone()
    thrust = [0.0, 0.0, 0.52 * 9.81 / 4]

    def step() -> None:
        for _ in range(SUB_STEPS):
            for place, (_, turn) in zip(places, QUADRICOPTER.rotors):
                pybullet.applyExternalForce(body, -1, thrust, place, pybullet.LINK_FRAME, client)
                pybullet.applyExternalTorque(body, -1, [0, 0, turn * 0.01], pybullet.LINK_FRAME, client)
            pybullet.stepSimulation(client)

    return step


def least() -> Callable[[], None]:
    """Return a step of the PyBullet calls that each of our sub-steps needs: pose, force, torque, step."""
    client, body, _ = _drone_alone()
    thrust, torque = (0.0, 0.0, 0.52 * 9.81), (0.0, 0.0, 0.0)

    def step() -> None:
        for _ in range(SUB_STEPS):
            centre, _ = pybullet.getBasePositionAndOrientation(body, client)
            pybullet.applyExternalForce(body, -1, thrust, centre, pybullet.WORLD_FRAME, client)
            pybullet.applyExternalTorque(body, -1, torque, pybullet.WORLD_FRAME, client)
            pybullet.stepSimulation(client)

    return step


def ours(*cameras: str) -> Callable[[], None]:
    """Return a step of the whole loop: script, propellers, dynamics, sensing, and the pictures of the cameras named."""
    simulation = Simulation(parameters.load())
    for camera in cameras:
        simulation.drone.cameras[camera].viewers.add(lambda: True)
    return simulation.step


def compare(rounds: int = 10, seconds: float = 0.4) -> list[Row]:
    """Return the rows, measured on one core."""
    with one_core():
        steps = {
            "bare PyBullet: forces and steps": bare(),
            "drone_sim, no camera": ours(),
            "drone_sim, front camera": ours("front"),
            "drone_sim, front and track camera": ours("front", "track"),
        }
        return race(steps, rounds, seconds)
