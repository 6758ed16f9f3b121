"""How a mass lies in what stands in a scene: against closed forms, and against how it moves."""

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
CAPSULE = trimesh.creation.capsule(0.4, 0.1, count=[200, 200])  # as good as round
FORMS = {  # principal moments of 2 kg: the textbook's, and for the capsule an integral over its surface
    "box": (Box((0.3, 0.4, 0.5)), MASS / 12 * np.array([0.41, 0.34, 0.25])),
    "cylinder": (Cylinder((0.2, 0.6)), MASS * np.array([0.04 / 4 + 0.36 / 12, 0.04 / 4 + 0.36 / 12, 0.04 / 2])),
    "sphere": (Sphere((0.3,)), MASS * 2 / 5 * 0.09 * np.ones(3)),
    "capsule": (Capsule((0.1, 0.4)), np.diag(CAPSULE.moment_inertia) * MASS / CAPSULE.volume),
}
LINK = """<robot name="r"><link name="a"><inertial>{inertial}</inertial>
  <collision><origin xyz="0 0 0.5"/><geometry><box size="0.1 0.1 1"/></geometry></collision></link>{more}</robot>"""
OWN = "<origin xyz='0.1 0 0'/><mass value='3'/><inertia ixx='.2' iyy='.3' izz='.4' ixy='.05' ixz='0' iyz='0'/>"
ANTENNA = """<link name="antenna"/><joint name="j" type="fixed"><parent link="a"/><child link="antenna"/>
  <origin xyz="0 0 5"/></joint>"""


@pytest.fixture(name="world")
def _world():
    world = World(SUB_STEP, 0.0)
    yield world
    world.close()


@pytest.fixture(name="pole")
def _pole(tmp_path):
    """A pole of 1 m whose origin is at its foot."""
    pole = trimesh.creation.box((0.1, 0.1, 1.0), trimesh.transformations.translation_matrix((0, 0, 0.5)))
    pole.export(str(tmp_path / "pole.stl"))
    return Mesh(str(tmp_path / "pole.stl"))


def urdf(folder, inertial, more=""):
    """Return a URDF whose first link is a pole of 1 m on its origin."""
    (folder / "one.urdf").write_text(LINK.format(inertial=inertial, more=more))
    return Urdf(str(folder / "one.urdf"))


def turned_by(world, body, torque):
    """Return the angular velocity that a torque (N m, world) gives in one sub-step, from rest."""
    wrench = Wrench()
    wrench.add((0, 0, 0), torque, (0, 0, 0))
    world.advance({body: wrench}, 1)
    return np.array(world.state(body).angular_velocity)


@pytest.mark.parametrize("word", FORMS)
def test_closed_forms(word):
    shape, moments = FORMS[word]
    found = inertia_of([Part(shape, IDENTITY, WHITE)], MASS)
    assert found.moments == pytest.approx(moments, rel=5e-4 if word == "capsule" else 1e-9)
    assert found.frame == pytest.approx(IDENTITY, abs=1e-12)


@pytest.mark.parametrize("word", FORMS)
def test_a_torque_turns_it_as_its_form_says(world, word):
    shape, moments = FORMS[word]
    for axis in range(3):
        body = world.add_object(shape, Pose((0, 0, 5 * axis)), mass=MASS)
        expected = SUB_STEP * np.eye(3)[axis] / moments[axis]
        assert turned_by(world, body, np.eye(3)[axis]) == pytest.approx(expected, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_hull_fills_what_qhulls_does(scale):
    for seed in range(5):
        points = scale * np.random.default_rng(seed).normal(size=(300, 3))
        ours, theirs = hull_of([points.reshape(-1, 3, 3)]), trimesh.convex.convex_hull(points)
        assert ours.volume == pytest.approx(theirs.volume, rel=1e-9)
        np.testing.assert_allclose(ours.centroid, theirs.center_mass, atol=1e-9 * scale)
        np.testing.assert_allclose(ours.inertia, theirs.moment_inertia, rtol=1e-9, atol=1e-9 * scale**5)


def test_a_mesh_turns_about_the_centre_of_its_hull(world, pole):
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
    body = world.add_object(urdf(tmp_path, OWN), Pose((0, 0, 0)), mass=9.0)
    tensor = np.array([[0.2, 0.05, 0], [0.05, 0.3, 0], [0, 0, 0.4]])
    push = Wrench()
    push.add((3.0, 0, 0), (0, 0, 0), (0, 0, 0))
    assert turned_by(world, body, (1.0, 2.0, 3.0)) == pytest.approx(
        SUB_STEP * np.linalg.solve(tensor, [1, 2, 3]), rel=1e-3
    )
    world.set_pose(body, Pose((0, 0, 0)))
    world.advance({body: push}, 1)
    assert world.state(body).linear_velocity[0] == pytest.approx(SUB_STEP, rel=1e-6), "3 N on 3 kg"


def test_a_urdf_that_says_a_mass_alone_is_evenly_filled(world, tmp_path):
    body = world.add_object(urdf(tmp_path, "<mass value='2'/>"), Pose((0, 0, 0)), mass=1.0)
    assert world.inertial_frame(body)[3::4] == pytest.approx((0, 0, 0.5), abs=1e-6)
    assert turned_by(world, body, (1.0, 0, 0))[0] == pytest.approx(SUB_STEP / (2 / 12 * 1.01), rel=1e-3)


def test_a_link_that_a_fixed_joint_holds_and_that_says_no_mass_weighs_nothing(world, tmp_path):
    body = world.add_object(urdf(tmp_path, OWN, ANTENNA), Pose((0, 0, 0)), mass=1.0)
    expected = SUB_STEP * np.linalg.inv([[0.2, 0.05, 0], [0.05, 0.3, 0], [0, 0, 0.4]])[2]
    assert turned_by(world, body, (0, 0, 1.0)) == pytest.approx(expected, rel=1e-3, abs=1e-9)


def test_moments_that_no_mass_has_are_refused(world, tmp_path):
    with pytest.raises(ValueError, match=r"one\.urdf: link a: inertia: principal moment -0\.10\d+ kg"):
        world.add_object(urdf(tmp_path, OWN.replace(".05", ".35")), Pose((0, 0, 0)), mass=1.0)


# ---- masses and forms of shapes, for scripts


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
    made = new_simulation(scene=SCENE)
    return made


@pytest.fixture(name="sim")
def _sim(simulation):
    return make_sim(simulation.child_scripts["drone"], SceneServices(operations=simulation.operations))


def test_mass_and_inertia_are_told_in_the_world(simulation, sim):
    box = simulation.context.objects.handle("Box")
    assert sim.setShapeMassAndInertia(box, 6, ALONG_WORLD, [5.1, 0.2, 4]) == 1
    mass, inertia, centre = sim.getShapeMassAndInertia(box)
    assert (mass, inertia, centre) == (6, pytest.approx(ALONG_WORLD), pytest.approx([5.1, 0.2, 4]))


def test_mass_and_inertia_are_told_in_a_frame(simulation, sim):
    box = simulation.context.objects.handle("Box")
    frame = sim.getObjectMatrix(box)
    sim.setShapeMassAndInertia(box, 6, ALONG_WORLD, [0.1, 0.2, 0.3], frame)
    _, inertia, centre = sim.getShapeMassAndInertia(box, frame)
    assert (inertia, centre) == (pytest.approx(ALONG_WORLD), pytest.approx([0.1, 0.2, 0.3]))


def test_an_inertia_is_told_in_the_shapes_frame(simulation, sim):
    box = simulation.context.objects.handle("Box")
    turned = frames.from_euler((0.0, 0.1, 0.0), (0.0, 0.0, math.pi / 2))
    sim.setShapeInertia(box, [2, 0, 0, 0, 3, 0, 0, 0, 4], turned)
    tensor, frame = sim.getShapeInertia(box)
    axes = np.reshape(frame, (3, 4))[:, :3]
    assert axes @ np.reshape(tensor, (3, 3)) @ axes.T == pytest.approx(np.diag([3, 2, 4]))
    assert frames.position(frame) == pytest.approx((0, 0.1, 0)) and sim.getShapeMass(box) == pytest.approx(2)


def test_what_stands_still_goes_on_to_stand_still(simulation, sim):
    wall = simulation.context.objects.handle("Wall")
    sim.setShapeMassAndInertia(wall, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 9, 3])
    for _ in range(5):
        simulation.step()
    assert sim.getObjectPosition(wall, -1) == pytest.approx([0, 9, 3])


def test_what_has_no_mass_of_its_own_has_no_inertia(simulation, sim):
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
def test_the_form_of_a_shape(simulation, sim, name, info):
    bits, form, size = sim.getShapeGeomInfo(simulation.context.objects.handle(name))
    assert (bits, form) == info[:2] and size == pytest.approx(info[2])


def test_what_is_no_shape_has_no_form(simulation, sim):
    with pytest.raises(TypeError, match="'Goal' is not a shape"):
        sim.getShapeGeomInfo(simulation.context.objects.handle("Goal"))
