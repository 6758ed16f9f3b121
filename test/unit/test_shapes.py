"""PyBullet, the cameras and rviz agree on the size of each shape."""

import numpy as np
import pybullet
import pytest
import trimesh

from drone_sim.mechanics.state import Pose
from drone_sim.shapes import REPORTED_SHAPES
from drone_sim.shapes.box import Box
from drone_sim.shapes.capsule import Capsule
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.plane import Plane
from drone_sim.shapes.sphere import Sphere
from drone_sim.shapes.urdf import Urdf
from drone_sim.world import World

SIZED = [Box((0.3, 0.4, 0.5)), Cylinder((0.2, 0.6)), Sphere((0.3,)), Capsule((0.1, 0.4))]


@pytest.fixture(name="world")
def _world():
    world = World(0.005, -9.81)
    yield world
    world.close()


@pytest.fixture(name="torus")
def _torus(tmp_path):
    trimesh.creation.torus(0.5, 0.2, major_sections=12, minor_sections=6).export(str(tmp_path / "torus.stl"))
    return str(tmp_path / "torus.stl")


def urdf_of(folder, *geometries):
    """Return a URDF with one visual for each geometry."""
    visuals = "".join(f"<visual><geometry>{geometry}</geometry></visual>" for geometry in geometries)
    (folder / "all.urdf").write_text(f"<robot name='r'><link name='a'>{visuals}</link></robot>")
    return Urdf(str(folder / "all.urdf"))


def span(corners):
    """Return the lowest and the highest x, y, z."""
    points = np.reshape(corners, (-1, 3))
    return np.array([points.min(axis=0), points.max(axis=0)])


def span_in_rviz(primitive):
    """Return the lowest and the highest x, y, z that rviz draws for an upright primitive."""
    unit = primitive.corners or [(-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)]
    return span(unit * np.array(primitive.scale) + np.reshape(primitive.local, (3, 4))[:, 3])


def test_bullet_reports_the_visual_shapes_of_a_urdf(world, torus, tmp_path):
    body = world.add_object(
        urdf_of(
            tmp_path,
            "<box size='0.3 0.4 0.5'/>",
            "<cylinder radius='0.2' length='0.6'/>",
            "<sphere radius='0.3'/>",
            "<capsule radius='0.1' length='0.4'/>",
            "<mesh filename='torus.stl' scale='1 -2 0.5'/>",
            "<plane normal='0 0 1'/>",
        ),
        Pose((0, 0, 1)),
    )
    shown = [visual.shape for visual in world.pictures.visuals([body])]
    assert shown == [*SIZED, Mesh(torus, (1.0, -2.0, 0.5)), Plane()]
    assert {type(shape) for shape in shown} == set(REPORTED_SHAPES.values())


@pytest.mark.parametrize("mass", [0.0, 1.0])
@pytest.mark.parametrize("word", ["box", "cylinder", "sphere", "mesh"])
def test_collision_shape_is_as_large_as_the_drawn_shape(world, tmp_path, word, mass):
    trimesh.creation.box((0.6, 0.8, 1.0)).export(str(tmp_path / "block.stl"))
    shapes = {**{shape.word: shape for shape in SIZED}, "mesh": Mesh(str(tmp_path / "block.stl"), (1.0, 2.0, 0.5))}
    body = world.add_object(shapes[word], Pose((0, 0, 0)), mass=mass)
    eyes = 5 * np.repeat([[-1], [1]], 3, axis=0) * np.tile(np.eye(3), (2, 1))  # three below and three above
    rays = pybullet.rayTestBatch(eyes.tolist(), [[0, 0, 0]] * 6, physicsClientId=world._client)
    assert {ray[0] for ray in rays} == {body}
    hits = np.array([ray[3] for ray in rays])
    (part,) = shapes[word].triangles()
    np.testing.assert_allclose(span(hits), span(part.corners), rtol=0.012)


@pytest.mark.parametrize("shape", SIZED, ids=lambda shape: shape.word)
def test_rviz_primitives_are_as_large_as_the_drawn_shape(shape):
    (part,) = shape.triangles()
    spans = [span_in_rviz(primitive) for primitive in shape.for_rviz()]
    drawn = np.array([np.min(spans, axis=0)[0], np.max(spans, axis=0)[1]])
    np.testing.assert_allclose(drawn, span(part.corners), rtol=0.012)


@pytest.mark.parametrize("shape", SIZED, ids=lambda shape: shape.word)
def test_scaled_shared_form_has_the_triangles_of_the_shape(shape):
    form, scale = shape.shared()
    (own,), (shared,) = shape.triangles(), form.triangles()
    np.testing.assert_allclose(np.array(scale) * shared.corners, own.corners, rtol=0, atol=1e-12)
