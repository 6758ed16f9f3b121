"""A push: the impulse it gives, how long it lasts, what ends it."""

import numpy as np
import pytest

from drone_sim.forces.pushes import Push
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

ZERO = (0.0, 0.0, 0.0)


@pytest.fixture(name="floating")
def _floating(tmp_path):
    """Give a drone at rest without weight and with its propellers off."""
    script = tmp_path / "idle.py"
    script.write_text("def sysCall_init(): pass\n")
    simulation = Simulation(parameters.load({"gravity": 0.0, "drone": {"position": [0, 0, 5]}}), script=str(script))
    yield simulation
    simulation.close()


def step(simulation, count):
    for _ in range(count):
        simulation.step()


def test_force_gives_its_impulse(floating):
    drone = floating.drone
    drone.pushes.add(Push((1.0, -2.0, 0.5), ZERO, 0.2))
    step(floating, 20)
    gained = np.array([1.0, -2.0, 0.5]) * 0.2 / drone.body.mass
    assert drone.body.state.linear_velocity == pytest.approx(gained, abs=1e-12)
    assert drone.body.state.angular_velocity == pytest.approx(ZERO, abs=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_torque_gives_its_angular_impulse(floating, axis):
    drone, torque = floating.drone, np.zeros(3)
    torque[axis] = 2e-4
    drone.pushes.add(Push(ZERO, torque.tolist(), 0.1))
    step(floating, 2)
    expected = np.linalg.solve(drone.body.rigid.inertia, torque) * 0.1
    state = drone.body.state
    assert state.angular_velocity == pytest.approx(expected, rel=1e-9, abs=1e-12)
    centre = state.linear_velocity + np.cross(state.angular_velocity, drone.body.rigid.centre_of_mass)
    assert centre == pytest.approx(ZERO, abs=1e-4)  # it turns about its centre of mass


@pytest.mark.parametrize("duration, steps", [(0.2, 4), (0.15, 3), (0.001, 1), (0.06, 1), (0.09, 2)])
def test_it_lasts_whole_steps(floating, duration, steps):
    floating.drone.pushes.add(Push((1.0, 0.0, 0.0), ZERO, duration))
    gained, before = [], 0.0
    for _ in range(8):
        floating.step()
        now = floating.drone.body.state.linear_velocity[0]
        gained.append(now - before)
        before = now
    impulse = 0.05 / floating.drone.body.mass
    assert gained == pytest.approx([impulse] * steps + [0.0] * (8 - steps), abs=1e-12)


def test_pushes_add_up(floating):
    floating.drone.pushes.add(Push((1.0, 0.0, 0.0), ZERO, 0.1))
    step(floating, 1)
    floating.drone.pushes.add(Push((1.0, 0.0, 0.0), ZERO, 0.1))
    step(floating, 10)
    assert floating.drone.body.state.linear_velocity[0] == pytest.approx(0.2 / floating.drone.body.mass, abs=1e-12)


def test_reset_ends_it(floating):
    floating.drone.pushes.add(Push((1.0, 0.0, 0.0), (0.0, 0.0, 0.1), 10.0))
    floating.drone.reset()
    step(floating, 5)
    assert floating.drone.body.state.linear_velocity == ZERO
    assert floating.drone.body.state.angular_velocity == ZERO
