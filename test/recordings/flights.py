"""Flights that CoppeliaSim recorded, repeated via the remote API."""

from __future__ import annotations

import csv
import queue
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drone_sim.importing.cache import imported_scene
from drone_sim.remote.standalone import play
from drone_sim.run import parameters

MASS, GRAVITY, ARM = 0.52, 9.81, 0.13  # kg, m/s², m: of the recorded program
MAX_THRUST = 1.5 * MASS * GRAVITY  # N
HORIZON = 10  # steps
STATE_COST = (0.3, 0.3, 3.0, 0.01, 0.01, 0.1, 0.25, 0.25, 0.1, 0.0, 0.0, 0.0)
CONTROL_COST = (0.1, 0.4, 0.4, 0.1)
LOWEST, HIGHEST = (-MASS * GRAVITY, -0.015, -0.015, -1.0), (1.0, 0.015, 0.015, 1.0)
PID = {"kp": 0.8, "ki": 0.1, "kd": 1.15}
STATE = ("x", "y", "z", "vx", "vy", "vz", "roll", "pitch", "yaw", "p", "q", "r")
FORCES, TARGET = ("f0", "f1", "f2", "f3"), ("target_x", "target_y", "target_z")


class Recording(NamedTuple):
    """Log of CoppeliaSim, one row for each step: time (s), state (m, m/s, rad, rad/s), forces (N), target (m)."""

    times: np.ndarray
    states: np.ndarray
    forces: np.ndarray
    targets: np.ndarray


def read(path: Path) -> Recording:
    """Read a recording. Raises OSError, KeyError and ValueError."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    table = [np.stack([columns[name] for name in names], axis=1) for names in (STATE, FORCES, TARGET)]
    return Recording(columns["time"], *table)


@contextmanager
def simulation(scene: Path) -> Iterator[Any]:
    """Yield `sim` of CoppeliaSim's client, connected to a waiting simulation of a CoppeliaSim scene file."""
    from coppeliasim_zmqremoteapi_client import RemoteAPIClient

    values = {"scene_file": str(imported_scene(scene)), "real_time_factor": 0, "remote_api": {"port": 0}}
    ports: queue.Queue[int] = queue.Queue()
    end_event = threading.Event()
    work = (parameters.load(values), end_event.is_set, lambda server: ports.put(server.port))
    simulator = threading.Thread(target=play, args=work)
    simulator.start()
    try:
        yield RemoteAPIClient(port=ports.get(timeout=60)).require("sim")
    finally:
        end_event.set()
        simulator.join()


class Controller:
    """Controller of the recorded program: its model predictive controller and PID, imported from its folder."""

    def __init__(self, folder: Path, time_step: float):
        """Import the modules from `folder`; `time_step` is in s."""
        sys.path.insert(0, str(folder))
        try:
            from MPC_controller import mpc_controller
            from PID_Controller import PIDController
        finally:
            sys.path.remove(str(folder))
        self._solve = mpc_controller
        self._pid = PIDController(**PID, dt=time_step)
        slope = np.zeros((12, 12))
        slope[[0, 1, 2, 6, 7, 8], [3, 4, 5, 9, 10, 11]] = 1.0
        slope[3, 7], slope[4, 6] = GRAVITY, -GRAVITY
        effect = np.zeros((12, 4))
        effect[5, 0] = 1.0 / MASS
        effect[[9, 10, 11], [1, 2, 3]] = 1.0  # the program's model uses torques as angular accelerations
        self._model = np.eye(12) + slope * time_step, effect * time_step
        self._costs = np.diag(STATE_COST), np.diag(CONTROL_COST)

    def forces(self, state: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Return the thrust of each propeller (N)."""
        reference = np.concatenate((target, np.zeros(9)))
        limits = np.array(LOWEST), np.array(HIGHEST)
        control, _ = self._solve(
            state, *self._model, reference, HORIZON, *self._costs, *limits, pid_controller=self._pid
        )
        thrust = min(control[0] + MASS * GRAVITY, MAX_THRUST)
        roll, pitch, yaw = control[1] / (2 * ARM), control[2] / (2 * ARM), control[3] / 4
        return thrust / 4 + np.array((roll - pitch - yaw, roll + pitch + yaw, pitch - roll - yaw, yaw - roll - pitch))


def closed_loop(folder: Path, recording: Recording) -> Any:
    """Return a function that gives a step's forces by the recorded program's law, along the body's current axis."""
    controller = Controller(folder, recording.times[1])

    def choose(index: int, state: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        return np.outer(controller.forces(state, recording.targets[index]), rotation[:, 2])

    return choose


def open_loop(recording: Recording) -> Any:
    """Return a function that gives the recorded forces along the body's current axis."""
    return lambda index, _state, rotation: np.outer(recording.forces[index], rotation[:, 2])


def recorded_attitude(recording: Recording) -> Any:
    """Return a function that gives the recorded forces along the recorded body's axis."""

    def choose(index: int, _state: np.ndarray, _turn: np.ndarray) -> np.ndarray:
        return np.outer(recording.forces[index], axis(recording.states[index, 6:9]))

    return choose


def axis(angles: np.ndarray) -> np.ndarray:
    """Return the body's z axis in the world under V-REP's Euler angles α β γ (rad): Rx(α) Ry(β) Rz(γ)."""
    (sin_a, sin_b, _), (cos_a, cos_b, _) = np.sin(angles), np.cos(angles)
    return np.array((sin_b, -sin_a * cos_b, cos_a * cos_b))


def fly(sim: Any, recording: Recording, choose: Any) -> np.ndarray:
    """Fly as long as the recording from its start; return the state before each step, in the recording's format."""
    drone = sim.getObject("/Quadcopter")
    propellers = [sim.getObject(f"/Quadcopter/propeller[{index}]/respondable") for index in range(4)]
    sim.setObjectPosition(drone, -1, recording.states[0, :3].tolist())
    sim.setStepping(True)
    sim.startSimulation()
    states = []
    for index in range(len(recording.times)):
        linear, angular = sim.getObjectVelocity(drone)
        place, angles = sim.getObjectPosition(drone, -1), sim.getObjectOrientation(drone, -1)
        states.append(np.array((*place, *linear, *angles, *angular)))
        rotation = np.reshape(sim.getObjectMatrix(drone, -1), (3, 4))[:, :3]
        for propeller, force in zip(propellers, choose(index, states[-1], rotation)):
            sim.addForceAndTorque(propeller, force.tolist(), [0, 0, 0])
        sim.step()
    sim.stopSimulation()
    return np.array(states)
