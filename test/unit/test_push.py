"""The impulse and the duration of a push, and how it ends."""

import numpy as np
import pytest

from drone_sim.forces.pushes import Push

ZERO = (0.0, 0.0, 0.0)


@pytest.fixture(name="floating")
def _floating(new_simulation):
    """Return a simulation without gravity whose drone is at rest with its propellers off."""
    return new_simulation({"gravity": 0.0, "drone": {"position": [0, 0, 5]}}, python="def sysCall_init(): pass\n")


def step(simulation, count):
    for _ in range(count):
        simulation.step()


def test_a_force_changes_the_velocity_by_its_impulse(floating):
    drone = floating.drone
    drone.pushes.add(Push((1.0, -2.0, 0.5), ZERO, 0.2))
    step(floating, 20)
    gained = np.array([1.0, -2.0, 0.5]) * 0.2 / drone.body.mass
    assert drone.body.state.linear_velocity == pytest.approx(gained, abs=1e-12)
    assert drone.body.state.angular_velocity == pytest.approx(ZERO, abs=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_torque_changes_the_angular_velocity_by_its_impulse(floating, axis):
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
def test_a_push_lasts_whole_steps(floating, duration, steps):
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


def test_reset_ends_a_push(floating):
    floating.drone.pushes.add(Push((1.0, 0.0, 0.0), (0.0, 0.0, 0.1), 10.0))
    floating.drone.reset()
    step(floating, 5)
    assert floating.drone.body.state.linear_velocity == ZERO
    assert floating.drone.body.state.angular_velocity == ZERO


SCENE = """
objects:
  - {name: Ball, shape: sphere, size: [0.2], position: [5, 0, 2], mass: 2}
  - {name: Post, shape: box, size: [0.2, 0.2, 2], position: [3, 0, 1]}
  - {name: Hinge, kind: joint, type: revolute, parent: Post, mode: passive}
  - {name: Rod, shape: box, size: [1, 0.1, 0.1], parent: Hinge, position: [0, 0, 0], mass: 0.6}
"""
INERTIA = 0.6 * (1 + 0.01) / 12  # kg m², of the rod about z
PUSHES = """
def sysCall_actuation():
    ball, post, rod = (sim.getObjectHandle(name) for name in ("Ball", "Post", "Rod"))
    sim.addForceAndTorque(ball, [9, 9, 9], [9, 9, 9])
    sim.addForce(ball + sim.handleflag_resetforcetorque, [0, 0.1, 0], [1, 0, 0])
    sim.addForceAndTorque(ball, [1, 0, 0], [0, 0, 0.1])
    sim.addForceAndTorque(post, [1, 0, 0], [0, 0, 1])
    sim.addForceAndTorque(rod, [9, 0, 0], [0, 0, 0.3])
    sim.addForceAndTorque(rod + sim.handleflag_resettorque, [0, 0, 0], [0, 0, 0.1])
    sim.addForceAndTorque(sim.getObject("/Quadcopter"), [9, 9, 9], [0, 0, 0.001])
    sim.addForceAndTorque(sim.getObject("/Quadcopter") + sim.handleflag_resetforce, [0.52, 0, 0])
"""


def test_forces_of_scripts_act_on_shapes_and_can_be_reset(new_simulation):
    """A force lasts one step, so that the velocities grow in proportion to the steps."""
    simulation = new_simulation({"gravity": 0.0}, scene=SCENE, python=PUSHES)
    things, drone = simulation.scene.things(), simulation.drone
    for count in (1, 2):
        simulation.step()
        ball, rod = things["Ball"].velocity(), things["Rod"].velocity()
        assert ball[0] == pytest.approx((count * 2 / 2 * 0.05, 0, 0), abs=1e-9)
        assert ball[1] == pytest.approx((0, 0, 0), abs=1e-9), "-0.1 N m from the force and 0.1 N m as a torque"
        assert rod[1] == pytest.approx((0, 0, count * 0.1 / INERTIA * 0.05), rel=1e-3)
        assert drone.body.state.linear_velocity[0] == pytest.approx(count * 0.52 / drone.body.mass * 0.05, rel=0.05)
        assert drone.body.state.angular_velocity[2] > 0
    assert not any(map(any, things["Post"].velocity()))
    assert not simulation.world.shape_forces.sums
