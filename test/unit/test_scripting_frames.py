"""Frame conversions and velocities, compared with their definitions."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drone_sim.mechanics import frames
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.state import State

ANGLE = st.floats(-math.pi, math.pi)
LENGTH = st.floats(-100, 100)
POINT = st.tuples(LENGTH, LENGTH, LENGTH)
ANGLES = st.tuples(ANGLE, ANGLE, ANGLE)


def rotation_about(axis, angle):
    """Return the rotation matrix by Rodrigues' formula, independent of any Euler convention."""
    x, y, z = axis
    c, s, v = math.cos(angle), math.sin(angle), 1 - math.cos(angle)
    return (
        x * x * v + c, x * y * v - z * s, x * z * v + y * s, 0.0,
        y * x * v + z * s, y * y * v + c, y * z * v - x * s, 0.0,
        z * x * v - y * s, z * y * v + x * s, z * z * v + c, 0.0,
    )  # fmt: skip


@given(POINT, ANGLES)
def test_euler_angles_rotate_about_body_x_then_y_then_z(position, angles):
    x, y, z = (rotation_about(axis, angle) for axis, angle in zip(((1, 0, 0), (0, 1, 0), (0, 0, 1)), angles))
    expected = list(frames.multiply(frames.multiply(x, y), z))
    expected[3], expected[7], expected[11] = position
    assert frames.from_euler(position, angles) == pytest.approx(expected, abs=1e-12)


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_euler_angles_survive_the_round_trip_through_a_matrix(alpha, beta, gamma):
    result = frames.to_euler(frames.from_euler((0, 0, 0), (alpha, beta, gamma)))
    for ours, theirs in zip(result, (alpha, beta, gamma)):
        assert math.remainder(ours - theirs, 2 * math.pi) == pytest.approx(0, abs=1e-9)


@given(ANGLE, st.sampled_from([-math.pi / 2, math.pi / 2]), ANGLE)
def test_rotation_survives_the_round_trip_at_the_euler_singularity(alpha, beta, gamma):
    turned = frames.from_euler((0, 0, 0), (alpha, beta, gamma))
    result = frames.to_euler(turned)
    assert result[2] == 0
    assert frames.from_euler((0, 0, 0), result) == pytest.approx(turned, abs=1e-9)


@given(POINT, ANGLES)
def test_pose_survives_the_round_trip_through_a_quaternion(position, angles):
    m = frames.from_euler(position, angles)
    quaternion = frames.to_quaternion(m)
    assert math.hypot(*quaternion) == pytest.approx(1) and quaternion[3] >= 0
    assert frames.from_quaternion(position, quaternion) == pytest.approx(m, abs=1e-12)


@given(ANGLES, ANGLES)
def test_products_of_quaternions_are_products_of_rotations(a, b):
    first, second = frames.from_euler((0, 0, 0), a), frames.from_euler((0, 0, 0), b)
    product = frames.multiply_quaternions(frames.to_quaternion(first), frames.to_quaternion(second))
    assert frames.from_quaternion((0, 0, 0), product) == pytest.approx(frames.multiply(first, second), abs=1e-12)


@given(POINT, ANGLES, POINT)
def test_inverse_undoes_the_transform(position, angles, point):
    m = frames.from_euler(position, angles)
    assert frames.multiply(frames.invert(m), m) == pytest.approx(frames.IDENTITY, abs=1e-11)
    assert frames.transform(frames.invert(m), frames.transform(m, point)) == pytest.approx(point, abs=1e-10)


class Turning:
    """A moving body that rotates about the vertical axis through its origin."""

    def __init__(self, position, velocity, rate):
        self.state = State(position, (0.0, 0.0, 0.0, 1.0), velocity, (0.0, 0.0, rate))
        self.matrix = self.state.matrix


@given(POINT, POINT, LENGTH, POINT)
def test_velocity_of_a_child_object_follows_its_rotating_body(position, velocity, rate, arm):
    objects = ObjectTree()
    objects.add("body", body=Turning(position, velocity, rate))
    objects.add("frame", "body", frames.from_euler(arm, (0.1, 0.2, 0.3)))
    objects.add("tip", "frame")
    linear, angular = objects[objects.handle("tip")].velocity()
    x, y, _ = arm
    assert angular == (0, 0, rate)
    expected = (velocity[0] - rate * y, velocity[1] + rate * x, velocity[2])
    assert linear == pytest.approx(expected, abs=1e-9)


@given(POINT, ANGLES, POINT, ANGLES)
def test_relative_matrices_chain(first, first_angles, second, second_angles):
    objects = ObjectTree()
    a = objects.add("a", None, frames.from_euler(first, first_angles))
    b = objects.add("b", None, frames.from_euler(second, second_angles))
    chained = frames.multiply(objects.matrix(b), objects.matrix(a, b))
    assert chained == pytest.approx(objects.matrix(a), abs=1e-9)
    objects.set_matrix(a, b, frames.IDENTITY)
    assert objects.matrix(a) == pytest.approx(objects.matrix(b), abs=1e-12)
    objects.set_parent(a, b, True)
    assert objects.matrix(a) == pytest.approx(objects.matrix(b), abs=1e-9)
