"""Rotation of rigid bodies: without the gyroscopic term ω × Iω as in V-REP, or with it by Euler's equations."""

import contextlib

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY
from drone_sim.mechanics.state import Pose
from drone_sim.mechanics.wrench import Wrench
from drone_sim.shapes.box import Box
from drone_sim.shapes.compound import Part
from drone_sim.shapes.mass import inertia_of
from drone_sim.shapes.shape import WHITE
from drone_sim.world import World
from drone_sim.world.assemblies import Link, LinkJoint

SUB_STEP = 0.005  # s
TUMBLE = (4.0, 7.0, 4.0)  # rad/s, magnitude 9
MASS = 1.0  # kg
BOX = Box((0.1, 0.3, 0.5))  # m
MOMENTS = np.array([0.34, 0.26, 0.10]) * MASS / 12  # kg m²


@contextlib.contextmanager
def tumbling(gyroscopic, add, sub_step=SUB_STEP):
    """Yield a world without gravity and the number of a tumbling body in it."""
    world = World(sub_step, gravity=0.0, gyroscopic=gyroscopic)
    try:
        body = add(world)
        world.set_velocity(body, (0.0, 0.0, 0.0), TUMBLE)
        yield world, body
    finally:
        world.close()


def add_box(world):
    return world.add_object(BOX, Pose((0.0, 0.0, 1.0)), mass=MASS)


def add_box_on_a_hinge(world):
    """Add an assembly of a small light box and the box, with a fixed joint at their common centre."""
    parts = [Part(BOX, IDENTITY, WHITE)]
    small = [Part(Box((0.01, 0.01, 0.01)), IDENTITY, WHITE)]
    joint = LinkJoint(0, IDENTITY, "fixed", None, 0.0)
    links = [
        Link(small, mass=0.01, inertia=inertia_of(small, 0.01)),
        Link(parts, mass=MASS, inertia=inertia_of(parts, MASS), joint=joint),
    ]
    return world.add_assembly(links, Pose((0.0, 0.0, 1.0)), ["", ""])[0]


def rotation_state(world, body):
    """Return angular velocity (rad/s), angular momentum (N m s) and energy (J) of the box in the world frame."""
    _, orientation, _, velocity = world.state(body)
    turn = np.reshape(frames.from_quaternion((0, 0, 0), orientation), (3, 4))[:, :3]
    momentum = turn @ (MOMENTS * (turn.T @ velocity))
    return np.array(velocity), momentum, momentum @ velocity / 2


@pytest.mark.parametrize("pushes", [[False] * 20, [True] * 20, [True, False] * 2], ids=["never", "ever", "at times"])
@pytest.mark.parametrize("add", [add_box, add_box_on_a_hinge])
def test_without_the_gyroscopic_term_angular_velocity_is_constant_as_in_vrep(add, pushes):
    with tumbling(False, add) as (world, body):
        for pushed in pushes:
            world.advance({body: Wrench()} if pushed else {}, 100)
        assert rotation_state(world, body)[0] == pytest.approx(TUMBLE, abs=1e-8)


@pytest.mark.parametrize("pushed", [False, True])
def test_the_gyroscopic_term_conserves_momentum_and_energy_over_10_s(pushed):
    with tumbling(True, add_box) as (world, body):
        _, momentum, energy = rotation_state(world, body)
        for _ in range(20):
            world.advance({body: Wrench()} if pushed else {}, 100)
            _, momentum_now, energy_now = rotation_state(world, body)
            assert momentum_now == pytest.approx(momentum, abs=1e-5 * np.linalg.norm(momentum))
            assert energy_now == pytest.approx(energy, rel=0.01)


@pytest.mark.parametrize("add", [add_box, add_box_on_a_hinge])
def test_with_the_gyroscopic_term_a_tumbling_body_follows_euler_s_equations(add):
    def euler(_, rate):
        return -np.cross(rate, MOMENTS * rate) / MOMENTS

    with tumbling(True, add, sub_step=SUB_STEP / 20) as (world, body):
        world.advance({}, 2000)
        velocity, *_ = rotation_state(world, body)
        turn = np.reshape(frames.from_quaternion((0, 0, 0), world.state(body).orientation), (3, 4))[:, :3]
        expected = solve_ivp(euler, (0, 100 * SUB_STEP), TUMBLE, rtol=1e-9, atol=1e-12).y[:, -1]
        assert turn.T @ velocity == pytest.approx(expected, abs=0.02 * np.linalg.norm(expected))
