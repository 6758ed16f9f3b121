"""Mass and inertia of scene objects, compared with closed forms and with the motion of the objects."""

import math

import numpy as np
import pytest
import trimesh

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, from_rpy, to_quaternion
from drone_sim.mechanics.state import Pose
from drone_sim.mechanics.wrench import Wrench
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.modules import make_sim
from drone_sim.shapes.box import Box
from drone_sim.shapes.capsule import Capsule
from drone_sim.shapes.compound import Part
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.mass import inertia_of
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.shape import WHITE
from drone_sim.shapes.solid import hull_of
from drone_sim.shapes.sphere import Sphere
from drone_sim.shapes.urdf import Urdf
from drone_sim.world import World

SUB_STEP = 0.005
MASS = 2.0
CAPSULE = trimesh.creation.capsule(0.4, 0.1, count=[200, 200])  # fine enough to count as round
FORMS = {  # principal moments for 2 kg, from textbooks; the capsule's from an integral over its surface
    "box": (Box((0.3, 0.4, 0.5)), MASS / 12 * np.array([0.41, 0.34, 0.25])),
    "cylinder": (Cylinder((0.2, 0.6)), MASS * np.array([0.04 / 4 + 0.36 / 12, 0.04 / 4 + 0.36 / 12, 0.04 / 2])),
    "sphere": (Sphere((0.3,)), MASS * 2 / 5 * 0.09 * np.ones(3)),
    "capsule": (Capsule((0.1, 0.4)), np.diag(CAPSULE.moment_inertia) * MASS / CAPSULE.volume),
}
LINK = """<robot name="r"><link name="a"><inertial>{inertial}</inertial>
  <collision><origin xyz="0 0 0.5"/><geometry><box size="0.1 0.1 1"/></geometry></collision></link>{more}</robot>"""
INERTIAL = "<origin xyz='0.1 0 0'/><mass value='3'/><inertia ixx='.2' iyy='.3' izz='.4' ixy='.05' ixz='0' iyz='0'/>"
ANTENNA = """<link name="antenna"/><joint name="j" type="fixed"><parent link="a"/><child link="antenna"/>
  <origin xyz="0 0 5"/></joint>"""


@pytest.fixture(name="world")
def _world():
    world = World(SUB_STEP, 0.0)
    yield world
    world.close()


@pytest.fixture(name="pole")
def _pole(tmp_path):
    """Return the mesh of a 1 m pole whose origin is at its foot."""
    pole = trimesh.creation.box((0.1, 0.1, 1.0), trimesh.transformations.translation_matrix((0, 0, 0.5)))
    pole.export(str(tmp_path / "pole.stl"))
    return Mesh(str(tmp_path / "pole.stl"))


def urdf(folder, inertial, more=""):
    """Return a URDF whose first link is a 1 m pole that stands on its origin."""
    (folder / "one.urdf").write_text(LINK.format(inertial=inertial, more=more))
    return Urdf(str(folder / "one.urdf"))


def angular_velocity_after(world, body, torque):
    """Return the angular velocity after one sub-step with a torque (N m, world frame), from rest."""
    wrench = Wrench()
    wrench.add((0, 0, 0), torque, (0, 0, 0))
    world.advance({body: wrench}, 1)
    return np.array(world.state(body).angular_velocity)


@pytest.mark.parametrize("word", FORMS)
def test_moments_of_inertia_equal_the_closed_forms(word):
    shape, moments = FORMS[word]
    computed = inertia_of([Part(shape, IDENTITY, WHITE)], MASS)
    assert computed.moments == pytest.approx(moments, rel=5e-4 if word == "capsule" else 1e-9)
    assert computed.frame == pytest.approx(IDENTITY, abs=1e-12)


@pytest.mark.parametrize("word", FORMS)
def test_a_torque_accelerates_a_shape_according_to_its_inertia(world, word):
    shape, moments = FORMS[word]
    for axis in range(3):
        body = world.add_object(shape, Pose((0, 0, 5 * axis)), mass=MASS)
        expected = SUB_STEP * np.eye(3)[axis] / moments[axis]
        assert angular_velocity_after(world, body, np.eye(3)[axis]) == pytest.approx(expected, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_hull_has_volume_centroid_and_inertia_of_qhulls(scale):
    for seed in range(5):
        points = scale * np.random.default_rng(seed).normal(size=(300, 3))
        ours, theirs = hull_of([points.reshape(-1, 3, 3)]), trimesh.convex.convex_hull(points)
        assert ours.volume == pytest.approx(theirs.volume, rel=1e-9)
        np.testing.assert_allclose(ours.centroid, theirs.center_mass, atol=1e-9 * scale)
        np.testing.assert_allclose(ours.inertia, theirs.moment_inertia, rtol=1e-9, atol=1e-9 * scale**5)


def test_the_centre_of_mass_of_a_mesh_is_that_of_its_hull(world, pole):
    body = world.add_object(pole, Pose((0, 0, 0)), mass=MASS)
    assert world.inertial_frame(body)[3::4] == pytest.approx((0, 0, 0.5), abs=1e-6)
    assert np.diag(np.reshape(world.inertia(body).tensor, (3, 3))) == pytest.approx(
        MASS / 12 * np.array([1.01, 1.01, 0.02]), rel=1e-5
    )


def test_a_mesh_pole_that_is_tilted_too_far_falls_over(pole):
    """At a tilt of atan(0.05 / 0.5) = 5.7 degrees its centre of mass is above its edge."""
    for degrees, stands in ((5, True), (7, False)):
        world = World(SUB_STEP, -9.81)
        world.add_floor(10.0, "")
        turn = from_rpy((0, 0, 0), (np.radians(degrees), 0, 0))
        body = world.add_object(pole, Pose((0, 0, 0.05 * np.sin(np.radians(degrees))), to_quaternion(turn)), mass=MASS)
        world.advance({}, 800)
        upright = world.state(body).matrix[10]
        assert upright == pytest.approx(1.0 if stands else 0.0, abs=0.02), degrees
        world.close()


def test_a_urdf_has_its_own_mass_and_inertia(world, tmp_path):
    body = world.add_object(urdf(tmp_path, INERTIAL), Pose((0, 0, 0)), mass=9.0)
    tensor = np.array([[0.2, 0.05, 0], [0.05, 0.3, 0], [0, 0, 0.4]])
    push = Wrench()
    push.add((3.0, 0, 0), (0, 0, 0), (0, 0, 0))
    assert angular_velocity_after(world, body, (1.0, 2.0, 3.0)) == pytest.approx(
        SUB_STEP * np.linalg.solve(tensor, [1, 2, 3]), rel=1e-3
    )
    world.set_pose(body, Pose((0, 0, 0)))
    world.advance({body: push}, 1)
    assert world.state(body).linear_velocity[0] == pytest.approx(SUB_STEP, rel=1e-6), "3 N on 3 kg"


def test_a_urdf_with_a_mass_but_no_inertia_has_uniform_density(world, tmp_path):
    body = world.add_object(urdf(tmp_path, "<mass value='2'/>"), Pose((0, 0, 0)), mass=1.0)
    assert world.inertial_frame(body)[3::4] == pytest.approx((0, 0, 0.5), abs=1e-6)
    assert angular_velocity_after(world, body, (1.0, 0, 0))[0] == pytest.approx(SUB_STEP / (2 / 12 * 1.01), rel=1e-3)


def test_a_link_without_mass_on_a_fixed_joint_weighs_nothing(world, tmp_path):
    body = world.add_object(urdf(tmp_path, INERTIAL, ANTENNA), Pose((0, 0, 0)), mass=1.0)
    expected = SUB_STEP * np.linalg.inv([[0.2, 0.05, 0], [0.05, 0.3, 0], [0, 0, 0.4]])[2]
    assert angular_velocity_after(world, body, (0, 0, 1.0)) == pytest.approx(expected, rel=1e-3, abs=1e-9)


def test_physically_impossible_moments_of_inertia_are_refused(world, tmp_path):
    with pytest.raises(ValueError, match=r"one\.urdf: link a: inertia: principal moment -0\.10\d+ kg"):
        world.add_object(urdf(tmp_path, INERTIAL.replace(".05", ".35")), Pose((0, 0, 0)), mass=1.0)


# ---- masses and geometry of shapes, as scripts read and set them


SCENE = """
objects:
  - {name: Box, shape: box, size: [1, 2, 3], position: [5, 0, 4], rpy: [0, 0, 1.5707963267948966], mass: 2}
  - {name: Wall, shape: box, size: [1, 1, 1], position: [0, 9, 3]}
  - {name: Ball, shape: sphere, size: [0.2], position: [0, 7, 3], mass: 1}
  - {name: Bottle, shape: capsule, size: [0.1, 0.5], position: [0, 5, 3]}
  - name: Table
    shape: compound
    mass: 1
    position: [-5, 0, 3]
    parts: [{shape: box, size: [1, 1, 0.1]}, {shape: cylinder, size: [0.05, 0.8]}]
  - {name: Goal, kind: dummy, position: [0, 0, 9]}
"""
ALONG_WORLD = [2.0, 0.3, 0.1, 0.3, 3.0, 0.2, 0.1, 0.2, 4.0]  # kg m²


@pytest.fixture(name="simulation")
def _simulation(new_simulation):
    created = new_simulation(scene=SCENE)
    return created


@pytest.fixture(name="sim")
def _sim(simulation):
    return make_sim(simulation.child_scripts["drone"], SceneServices(operations=simulation.operations))


def test_mass_and_inertia_are_set_and_read_in_the_world_frame(simulation, sim):
    box = simulation.context.objects.handle("Box")
    assert sim.setShapeMassAndInertia(box, 6, ALONG_WORLD, [5.1, 0.2, 4]) == 1
    mass, inertia, centre = sim.getShapeMassAndInertia(box)
    assert (mass, inertia, centre) == (6, pytest.approx(ALONG_WORLD), pytest.approx([5.1, 0.2, 4]))


def test_mass_and_inertia_are_set_and_read_relative_to_a_frame(simulation, sim):
    box = simulation.context.objects.handle("Box")
    frame = sim.getObjectMatrix(box)
    sim.setShapeMassAndInertia(box, 6, ALONG_WORLD, [0.1, 0.2, 0.3], frame)
    _, inertia, centre = sim.getShapeMassAndInertia(box, frame)
    assert (inertia, centre) == (pytest.approx(ALONG_WORLD), pytest.approx([0.1, 0.2, 0.3]))


def test_an_inertia_is_set_relative_to_the_shape(simulation, sim):
    box = simulation.context.objects.handle("Box")
    turned = frames.from_euler((0.0, 0.1, 0.0), (0.0, 0.0, math.pi / 2))
    sim.setShapeInertia(box, [2, 0, 0, 0, 3, 0, 0, 0, 4], turned)
    tensor, frame = sim.getShapeInertia(box)
    axes = np.reshape(frame, (3, 4))[:, :3]
    assert axes @ np.reshape(tensor, (3, 3)) @ axes.T == pytest.approx(np.diag([3, 2, 4]))
    assert frames.position(frame) == pytest.approx((0, 0.1, 0)) and sim.getShapeMass(box) == pytest.approx(2)


def test_a_static_shape_stays_static_when_its_mass_is_set(simulation, sim):
    wall = simulation.context.objects.handle("Wall")
    sim.setShapeMassAndInertia(wall, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 9, 3])
    for _ in range(5):
        simulation.step()
    assert sim.getObjectPosition(wall, -1) == pytest.approx([0, 9, 3])


def test_setting_the_inertia_of_a_shape_without_own_mass_is_refused(simulation, sim):
    with pytest.raises(ValueError, match="'Wall' has no mass of its own"):
        sim.setShapeInertia(simulation.context.objects.handle("Wall"), [1, 0, 0, 0, 1, 0, 0, 0, 1], frames.IDENTITY)
    with pytest.raises(ValueError, match="is a part of a vehicle"):
        sim.setShapeMassAndInertia(
            simulation.context.objects.handle("Drone"), 1, [1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 0, 0]
        )


@pytest.mark.parametrize(
    ("name", "info"),
    [
        ("Box", (6, 3, [1, 2, 3, 0])),
        ("Ball", (6, 4, [0.4, 0.4, 0.4, 0])),
        ("Bottle", (6, 8, [0.2, 0.2, 0.7, 0])),
        ("Table", (3, 0, [0, 0, 0, 0])),
        ("Floor", (0, 0, [0, 0, 0, 0])),
    ],
)
def test_geometry_info_of_a_shape(simulation, sim, name, info):
    bits, form, size = sim.getShapeGeomInfo(simulation.context.objects.handle(name))
    assert (bits, form) == info[:2] and size == pytest.approx(info[2])


def test_geometry_info_of_an_object_that_is_no_shape_is_refused(simulation, sim):
    with pytest.raises(TypeError, match="'Goal' is not a shape"):
        sim.getShapeGeomInfo(simulation.context.objects.handle("Goal"))
