"""Rays and contacts of the world."""

import math

import numpy as np
import pybullet
import pytest
from carried import BODY, FLOOR, SUB_STEP

from drone_sim.mechanics.state import Pose
from drone_sim.mechanics.wrench import Wrench
from drone_sim.shapes.box import Box
from drone_sim.shapes.sphere import Sphere
from drone_sim.world import World

THINGS = {  # shape, position, mass
    "ground": (Box((20.0, 20.0, 0.2)), (0, 0, -0.1), 0.0),
    "box": (Box((1.0, 1.0, 0.2)), (0, 0, 0.1), 5.0),
    "ball": (Sphere((0.2,)), (0.1, 0, 0.4), 1.0),
}


def add(world, name):
    shape, position, mass = THINGS[name]
    return world.add_object(shape, Pose(position), mass=mass)


@pytest.fixture(name="world")
def _world():
    world = World(SUB_STEP, gravity=-9.81)
    yield world
    world.close()


def test_a_ray_meets_the_nearest_of_many_in_whatever_order_they_came(world):
    balls = {x: world.add_object(Sphere((0.2,)), Pose((x, 0, 0))) for x in (5, 2, 4, 1, 3)}
    hit = world.queries.ray((0, 0, 0), (10, 0, 0))
    assert (hit.body, hit.distance, hit.normal) == (balls[1], pytest.approx(0.8, abs=1e-9), (-1, 0, 0))
    hit = world.queries.ray((0, 0, 0), (10, 0, 0), ignoring=balls[1])
    assert (hit.body, hit.distance) == (balls[2], pytest.approx(1.8, abs=1e-9))
    assert world.queries.ray((0, 1, 0), (10, 1, 0)) is None
    assert world.queries.ray((0, 0, 0), (0.7, 0, 0)) is None


def test_a_ray_that_begins_in_something_is_met_at_once_by_a_surface_against_it(world):
    ball = world.add_object(Sphere((1.0,)), Pose((0, 0, 0)))
    start, end = (0.1, 0.2, 0.01), (0.3, 0.2, -4.0)
    length = math.dist(start, end)
    against = pytest.approx([(a - b) / length for a, b in zip(start, end)], abs=1e-12)
    assert world.queries.ray(start, end) == (ball, 0.0, against)
    (met,) = world.queries.rays([(start, end)], lambda *_: True)
    assert (met.body, met.normal) == (ball, against)


def test_a_ray_goes_through_the_body_that_is_ignored(world):
    floor = world.add_floor(10.0, FLOOR)
    drone = world.add_rigid_body(BODY, Pose((0, 0, 1.0)))
    for x in (0.0, 0.09):  # through the stick, and through a propeller
        assert world.queries.ray((x, x, 2), (x, x, -1)).body == drone
        hit = world.queries.ray((x, x, 2), (x, x, -1), ignoring=drone)
        assert (hit.body, hit.distance) == (floor, pytest.approx(2.0, abs=1e-9))
    assert world.queries.ray((0, 0, 2), (0, 0, 0.5), ignoring=drone) is None


def test_a_ray_meets_what_has_been_moved_where_it_is_now(world):
    ball = add(world, "ball")
    world.set_pose(ball, Pose((3, 0, 0)))
    assert world.queries.ray((0, 0, 0), (10, 0, 0)).distance == pytest.approx(2.8, abs=1e-9)


def test_contacts_carry_the_weight(world):
    box, ball, floor = add(world, "box"), add(world, "ball"), world.add_floor(10.0, FLOOR)
    world.advance({}, 300)
    by_body = {floor: np.zeros(3), ball: np.zeros(3)}
    for touch in world.queries.contacts(box):
        by_body[touch.body] += touch.force
        assert touch.normal == pytest.approx((0, 0, 1 if touch.body == floor else -1), abs=1e-4)
        assert touch.point[2] == pytest.approx(0.0 if touch.body == floor else 0.2, abs=1e-3)
    assert by_body[floor] == pytest.approx([0, 0, 6 * 9.81], rel=1e-4, abs=1e-3)
    assert by_body[ball] == pytest.approx([0, 0, -9.81], rel=1e-4, abs=1e-3)
    assert world.queries.contacts(ball)[0].force == pytest.approx((0, 0, 9.81), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("first", ["box", "ground"])
def test_friction_is_in_the_force_whichever_body_came_first(world, first):
    made = {name: add(world, name) for name in sorted(["box", "ground"], reverse=first == "ground")}
    world.advance({}, 100)
    pushed = Wrench()
    pushed.add((80.0, 40.0, 0.0), (0, 0, 0), (0, 0, 0))
    before = np.array(world.state(made["box"]).linear_velocity)
    world.advance({made["box"]: pushed}, 1)
    gained = (np.array(world.state(made["box"]).linear_velocity) - before) / SUB_STEP
    by_newton = 5.0 * (gained - [0, 0, -9.81]) - [80, 40, 0]
    force = np.sum([touch.force for touch in world.queries.contacts(made["box"])], axis=0)
    back = np.sum([touch.force for touch in world.queries.contacts(made["ground"])], axis=0)
    assert abs(by_newton[0]) > 10
    assert force == pytest.approx(by_newton, abs=1e-6)
    assert back == pytest.approx(-by_newton, abs=1e-6)


def test_what_is_near_and_does_not_push_is_no_contact(world):
    ball = add(world, "ball")
    add(world, "ground")
    world.set_pose(ball, Pose((0, 0, 0.203)))
    world.advance({}, 1)
    assert pybullet.getContactPoints(ball, physicsClientId=world._client)
    assert world.queries.contacts(ball) == []
