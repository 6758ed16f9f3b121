"""V-REP's particle law against its closed form, and world-fixed forces against their definition."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drone_sim.forces.propellers import PARTICLE_VELOCITY, ParticleLaw, Propellers
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose
from drone_sim.mechanics.wrench import Wrench
from drone_sim.run import parameters
from drone_sim.shapes.box import Box
from drone_sim.world import World

NEWTONS_PER_PARTICLE = 8500 * math.pi * 0.005**3 / (6 * 0.05)  # per m/s, at dt = 0.05 s


def law(name="3.x"):
    return ParticleLaw(parameters.load({"propellers": {"law": name}}).propellers, 0.05)


def particles(name, steps):
    one = law(name)
    return [one.emit() / NEWTONS_PER_PARTICLE for _ in range(steps)]


def test_3x_carries_the_fraction_of_a_particle():
    assert particles("3.x", 6) == pytest.approx([21, 22, 21, 22, 21, 22])


def test_4x_drops_the_fraction_of_a_particle():
    assert particles("4.x", 6) == pytest.approx([21] * 6)


@pytest.mark.parametrize("name, newtons, hover", [("3.x", 0.23922, 5.331), ("4.x", 0.23366, 5.458)])
def test_thrust_per_velocity_and_hover(name, newtons, hover):
    one = law(name)
    mean = sum(one.emit() for _ in range(200)) / 200
    assert mean == pytest.approx(newtons, abs=5e-6)
    assert 0.52 * 9.81 / (4 * mean) == pytest.approx(hover, abs=5e-4)


@given(st.lists(st.floats(-10, 10), min_size=4, max_size=4), st.tuples(*[st.floats(-3, 3)] * 3))
def test_propellers_push_along_their_axes_and_turn_against_their_rotation(velocities, angles):
    """Two upright propellers, one that leans to the front, one to the side."""
    axes = [(0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 0.6, 0.8)]
    points = [(0.1, 0.1, 0.0), (-0.1, 0.1, 0.01), (-0.1, -0.1, 0.0), (0.1, -0.1, 0.02)]
    rotations = [-1, 1, -1, 1]
    body = frames.from_euler((0, 0, 0), angles)
    wrench, commands = Wrench(), [{PARTICLE_VELOCITY: velocity} for velocity in velocities]
    propellers = Propellers(parameters.load().propellers, axes, points, rotations, 0.05, commands)
    propellers.add_to(wrench, SimpleNamespace(matrix=body))
    force, torque = np.zeros(3), np.zeros(3)
    for velocity, axis, point, rotation in zip(velocities, axes, points, rotations):
        thrust = np.multiply(frames.rotate(body, axis), 21 * NEWTONS_PER_PARTICLE * velocity)
        force += thrust
        torque += np.multiply(frames.rotate(body, axis), rotation * 0.002 * velocity)
        torque += np.cross(frames.rotate(body, point), thrust)
    assert wrench.force == pytest.approx(tuple(force), abs=1e-9)
    assert wrench.torque_under(frames.to_quaternion(body)) == pytest.approx(tuple(torque), abs=1e-9)


vectors = st.tuples(*[st.floats(-5, 5)] * 3)


@given(st.lists(st.tuples(vectors, vectors, vectors), max_size=5), st.tuples(*[st.floats(-3, 3)] * 3))
def test_wrench_is_the_sum_of_forces_at_points_that_turn_with_the_body(forces, angles):
    turn = frames.from_euler((0, 0, 0), angles)
    wrench = Wrench()
    force, torque = np.zeros(3), np.zeros(3)
    for f, t, point in forces:
        wrench.add(f, t, point)
        force += f
        torque += np.add(t, np.cross(frames.rotate(turn, point), f))
    assert wrench.force == pytest.approx(tuple(force), abs=1e-9)
    assert wrench.torque_under(frames.to_quaternion(turn)) == pytest.approx(tuple(torque), abs=1e-9)


@given(st.lists(st.tuples(vectors, vectors, vectors), min_size=1, max_size=3), st.tuples(*[st.floats(-3, 3)] * 3))
@settings(max_examples=20, deadline=None)
def test_the_angular_velocity_of_a_body_follows_from_the_wrench(forces, angles):
    """A cube of 1 kg and 1 m, from rest, through one sub-step: its moment of inertia is 1/6 kg m² about any axis."""
    wrench = Wrench()
    for one in forces:
        wrench.add(*one)
    turn = frames.to_quaternion(frames.from_euler((0, 0, 0), angles))
    world = World(0.005, 0.0)
    body = world.add_object(Box((1.0, 1.0, 1.0)), Pose((0.0, 0.0, 0.0), turn), mass=1.0)
    world.advance({body: wrench}, 1)
    angular = world.state(body).angular_velocity
    world.close()
    assert angular == pytest.approx([6 * 0.005 * one for one in wrench.torque_under(turn)], rel=1e-3, abs=1e-9)
