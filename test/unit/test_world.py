"""The world's dynamics compared with closed-form solutions, and its rays and contacts."""

import math

import numpy as np
import pybullet
import pytest
from carried import BODY, FLOOR, SUB_STEP

from drone_sim.files.resources import package_path
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose
from drone_sim.mechanics.wrench import Wrench
from drone_sim.shapes.box import Box
from drone_sim.shapes.sphere import Sphere
from drone_sim.world import World

TILTED = frames.to_quaternion(frames.from_rpy((0, 0, 0), (0.7, -0.4, 2.0)))


@pytest.fixture(name="space")
def _space():
    world = World(SUB_STEP, gravity=0.0)
    yield world
    world.close()


def wrench(force=(0, 0, 0), torque=(0, 0, 0), point=(0, 0, 0)):
    made = Wrench()
    made.add(force, torque, point)
    return made


def test_free_fall_without_drag():
    world = World(SUB_STEP, gravity=-9.81)
    drone = world.add_rigid_body(BODY, Pose((1, 2, 50), TILTED))
    world.advance({drone: Wrench()}, 200)
    # Bullet's semi-implicit Euler: z = z0 - g dt^2 n (n + 1) / 2, v = -g n dt
    assert world.state(drone).linear_velocity == pytest.approx((0, 0, -9.81), abs=1e-9)
    assert world.state(drone).position == pytest.approx((1, 2, 50 - 9.81 * SUB_STEP**2 * 200 * 201 / 2), abs=1e-6)
    world.close()


def test_force_at_the_centre_of_mass_causes_no_rotation(space):
    drone = space.add_rigid_body(BODY, Pose((0, 0, 1), TILTED))
    space.advance({drone: wrench(force=(1.0, -2.0, 3.0))}, 10)
    assert space.state(drone).angular_velocity == pytest.approx((0, 0, 0), abs=1e-12)
    assert space.state(drone).linear_velocity == pytest.approx(np.array([1, -2, 3]) / 0.52 * 0.05, abs=1e-9)


@pytest.mark.parametrize(
    "force, torque, point",
    [((0, 0, 0), (1e-3, -2e-3, 3e-3), (0, 0, 0)), ((0.1, 0.2, -0.3), (0, 0, 0), (0.09, -0.09, 0.001))],
    ids=["a torque", "a force off the centre"],
)
def test_rotation_follows_from_the_inertia_in_the_world_frame(space, force, torque, point):
    drone = space.add_rigid_body(BODY, Pose((0, 0, 1), TILTED))
    space.advance({drone: wrench(force, torque, point)}, 1)
    turn = np.reshape(Pose((0, 0, 0), TILTED).matrix, (3, 4))[:, :3]
    total_torque = np.cross(turn @ point, force) + torque  # the point turns with the body
    expected = np.linalg.inv(turn @ BODY.inertia @ turn.T) @ total_torque * SUB_STEP
    assert space.state(drone).angular_velocity == pytest.approx(expected, rel=1e-5)


def test_pose_of_the_root_link_is_returned_as_set(space):
    drone = space.add_rigid_body(BODY, Pose((0, 0, 1)))
    space.set_pose(drone, Pose((0.1, -0.2, 0.3), TILTED))
    assert space.state(drone).position == pytest.approx((0.1, -0.2, 0.3), abs=1e-12)
    assert space.state(drone).orientation == pytest.approx(TILTED, abs=1e-12)


def test_velocity_of_the_root_link_is_measured_at_its_origin(space):
    drone = space.add_rigid_body(BODY, Pose((0, 0, 1)))
    space.advance({drone: wrench(torque=(1e-3, 0, 0))}, 1)
    spin = space.state(drone).angular_velocity[0]
    below_centre = BODY.centre_of_mass[2]
    assert space.state(drone).linear_velocity == pytest.approx((0, spin * below_centre, 0), abs=1e-9)


def test_the_drone_lands_on_the_floor(space):
    world = World(SUB_STEP, gravity=-9.81)
    world.add_floor(10.0, str(package_path() / "urdf" / "floor.png"))
    drone = world.add_rigid_body(BODY, Pose((0, 0, 0.3)))
    world.advance({drone: Wrench()}, 400)
    # It rests on the four propeller cylinders and the stick: lowest point 0.01 m below the root.
    assert world.state(drone).position[2] == pytest.approx(0.010, abs=0.003)
    assert math.hypot(*world.state(drone).linear_velocity) < 1e-3
    world.close()


def test_two_worlds_are_independent(space):
    other = World(SUB_STEP, gravity=-9.81)
    here = space.add_rigid_body(BODY, Pose((0, 0, 1)))
    there = other.add_rigid_body(BODY, Pose((0, 0, 1)))
    other.advance({there: Wrench()}, 10)
    assert space.state(here).position == pytest.approx((0, 0, 1), abs=1e-12)
    other.close()
    other.close()
    assert space.state(here).position == pytest.approx((0, 0, 1), abs=1e-12)


@pytest.mark.parametrize("speed", [2, 10, 20, 40, 150])
@pytest.mark.parametrize("gap", [0.0, 0.03, 0.07, 0.11])
@pytest.mark.parametrize("thrown", ["drone", "box"])
@pytest.mark.parametrize("onto", ["wall", "floor"])
def test_fast_body_does_not_tunnel_and_does_not_rebound(space, thrown, onto, gap, speed):
    along = np.array((1.0, 0.0, 0.0) if onto == "wall" else (0.0, 0.0, -1.0))
    end = np.array((2.0, 0.0, 2.0) if onto == "wall" else (0.0, 0.0, 0.0))
    if onto == "wall":
        space.add_object(Box((0.1, 4.0, 4.0)), Pose(tuple(end + 0.05 * along)))
    else:
        space.add_floor(10.0, "")
    start = Pose(tuple(end - (2.0 - gap) * along))
    body = (
        space.add_rigid_body(BODY, start) if thrown == "drone" else space.add_object(Box((0.2,) * 3), start, mass=1.0)
    )
    space.set_velocity(body, tuple(speed * along), (0.0, 0.0, 0.0))
    states = []
    for _ in range(300):
        space.advance({body: Wrench()}, 1)
        states.append(space.state(body))
    assert max((np.array(one.position) - end) @ along for one in states) < 0.01, "its centre stays in front of the face"
    assert min(np.array(one.linear_velocity) @ along for one in states) > -0.01 * speed


def test_setting_a_velocity_makes_pictures_outdated_because_of_motion_blur(space):
    body = space.add_rigid_body(BODY, Pose((0.0, 0.0, 1.0)))
    before = space.pictures.changes
    space.set_velocity(body, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert space.pictures.changes != before


def test_force_of_a_sub_step_acts_during_all_of_its_parts(space):
    """The sub-steps of a fast body that slides along a wall are divided."""
    space.add_object(Box((0.1, 100.0, 4.0)), Pose((0.16, 0.0, 2.0)))
    gained = []
    for x in (0.0, -50.0):  # beside the wall, 1 cm off, and far from it
        body = space.add_object(Box((0.2,) * 3), Pose((x, 0.0, 2.0)), mass=1.0)
        space.set_velocity(body, (0.0, 1.0, 0.0), (0.0, 0.0, 0.0))
        push = wrench(force=(-1.0, 0.0, 2.0))
        space.advance({body: Wrench()}, 20, lambda _count, body=body, push=push: space.apply(body, push))
        gained.append(space.state(body).linear_velocity)
    assert gained[0] == pytest.approx((-0.1, 1.0, 0.2), abs=1e-9)
    assert gained[0] == pytest.approx(gained[1], abs=1e-9)


# ---- rays and contacts


OBJECTS = {  # shape, position, mass
    "ground": (Box((20.0, 20.0, 0.2)), (0, 0, -0.1), 0.0),
    "box": (Box((1.0, 1.0, 0.2)), (0, 0, 0.1), 5.0),
    "ball": (Sphere((0.2,)), (0.1, 0, 0.4), 1.0),
}


def add(world, name):
    shape, position, mass = OBJECTS[name]
    return world.add_object(shape, Pose(position), mass=mass)


@pytest.fixture(name="world")
def _world():
    world = World(SUB_STEP, gravity=-9.81)
    yield world
    world.close()


def test_ray_hits_the_nearest_body_in_any_order_of_creation(world):
    balls = {x: world.add_object(Sphere((0.2,)), Pose((x, 0, 0))) for x in (5, 2, 4, 1, 3)}
    hit = world.queries.ray((0, 0, 0), (10, 0, 0))
    assert (hit.body, hit.distance, hit.normal) == (balls[1], pytest.approx(0.8, abs=1e-9), (-1, 0, 0))
    hit = world.queries.ray((0, 0, 0), (10, 0, 0), ignoring=balls[1])
    assert (hit.body, hit.distance) == (balls[2], pytest.approx(1.8, abs=1e-9))
    assert world.queries.ray((0, 1, 0), (10, 1, 0)) is None
    assert world.queries.ray((0, 0, 0), (0.7, 0, 0)) is None


def test_ray_that_starts_inside_a_body_hits_it_at_zero_distance(world):
    ball = world.add_object(Sphere((1.0,)), Pose((0, 0, 0)))
    start, end = (0.1, 0.2, 0.01), (0.3, 0.2, -4.0)
    length = math.dist(start, end)
    against = pytest.approx([(a - b) / length for a, b in zip(start, end)], abs=1e-12)
    assert world.queries.ray(start, end) == (ball, 0.0, against)
    (met,) = world.queries.rays([(start, end)], lambda *_: True)
    assert (met.body, met.normal) == (ball, against)


def test_ray_passes_through_an_ignored_body(world):
    floor = world.add_floor(10.0, FLOOR)
    drone = world.add_rigid_body(BODY, Pose((0, 0, 1.0)))
    for x in (0.0, 0.09):  # through the stick, and through a propeller
        assert world.queries.ray((x, x, 2), (x, x, -1)).body == drone
        hit = world.queries.ray((x, x, 2), (x, x, -1), ignoring=drone)
        assert (hit.body, hit.distance) == (floor, pytest.approx(2.0, abs=1e-9))
    assert world.queries.ray((0, 0, 2), (0, 0, 0.5), ignoring=drone) is None


def test_ray_hits_a_moved_body_at_its_new_pose(world):
    ball = add(world, "ball")
    world.set_pose(ball, Pose((3, 0, 0)))
    assert world.queries.ray((0, 0, 0), (10, 0, 0)).distance == pytest.approx(2.8, abs=1e-9)


def test_contacts_carry_the_weight(world):
    box, ball, floor = add(world, "box"), add(world, "ball"), world.add_floor(10.0, FLOOR)
    world.advance({}, 300)
    by_body = {floor: np.zeros(3), ball: np.zeros(3)}
    for contact in world.queries.contacts(box):
        by_body[contact.body] += contact.force
        assert contact.normal == pytest.approx((0, 0, 1 if contact.body == floor else -1), abs=1e-4)
        assert contact.point[2] == pytest.approx(0.0 if contact.body == floor else 0.2, abs=1e-3)
    assert by_body[floor] == pytest.approx([0, 0, 6 * 9.81], rel=1e-4, abs=1e-3)
    assert by_body[ball] == pytest.approx([0, 0, -9.81], rel=1e-4, abs=1e-3)
    assert world.queries.contacts(ball)[0].force == pytest.approx((0, 0, 9.81), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("first", ["box", "ground"])
def test_contact_force_includes_friction_in_any_order_of_bodies(world, first):
    made = {name: add(world, name) for name in sorted(["box", "ground"], reverse=first == "ground")}
    world.advance({}, 100)
    pushed = Wrench()
    pushed.add((80.0, 40.0, 0.0), (0, 0, 0), (0, 0, 0))
    before = np.array(world.state(made["box"]).linear_velocity)
    world.advance({made["box"]: pushed}, 1)
    gained = (np.array(world.state(made["box"]).linear_velocity) - before) / SUB_STEP
    by_newton = 5.0 * (gained - [0, 0, -9.81]) - [80, 40, 0]
    force = np.sum([contact.force for contact in world.queries.contacts(made["box"])], axis=0)
    reaction = np.sum([contact.force for contact in world.queries.contacts(made["ground"])], axis=0)
    assert abs(by_newton[0]) > 10
    assert force == pytest.approx(by_newton, abs=1e-6)
    assert reaction == pytest.approx(-by_newton, abs=1e-6)


def test_close_body_without_force_is_not_a_contact(world):
    ball = add(world, "ball")
    add(world, "ground")
    world.set_pose(ball, Pose((0, 0, 0.203)))
    world.advance({}, 1)
    assert pybullet.getContactPoints(ball, physicsClientId=world._client)
    assert world.queries.contacts(ball) == []
