"""The renderer draws what the physics hits: silhouettes against PyBullet's."""

import numpy as np
import pybullet
import pytest
import trimesh
from drawing import AHEAD, CAMERA, RED, at

from drone_sim.render.intrinsics import Intrinsics
from drone_sim.shapes.box import Box
from drone_sim.shapes.capsule import Capsule
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.sphere import Sphere
from drone_sim.shapes.visual import Visual


@pytest.fixture()
def bullet():
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(client)


def bullet_mask(client, camera_pose, intrinsics):
    """What TinyRenderer takes for the first body, seen by the same camera."""
    eye_from_world = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(camera_pose)
    upright = intrinsics.projection() @ np.diag([1.0, -1.0, -1.0, 1.0])
    upright[1] *= -1.0
    segmentation = pybullet.getCameraImage(
        intrinsics.width,
        intrinsics.height,
        viewMatrix=eye_from_world.T.ravel(),
        projectionMatrix=upright.T.ravel(),
        renderer=pybullet.ER_TINY_RENDERER,
        physicsClientId=client,
    )[4]
    return np.reshape(segmentation, (intrinsics.height, intrinsics.width)) == 0


TURN = (0.2, -0.3, 0.4, 0.8426)
BIG = Intrinsics(640, 480, np.radians(60.0), 0.05, 50.0)


def overlap(renderer, visual, pose, theirs, intrinsics):
    renderer.set_visuals([visual])
    ours = np.isfinite(renderer.render_depth(intrinsics, AHEAD, pose[None]))
    assert ours.mean() > 0.08
    return (ours & theirs).sum() / (ours | theirs).sum()


def place(client, **shapes):
    """The pose of a new body in front of the camera."""
    body = pybullet.createMultiBody(
        0, basePosition=(2.2, 0.1, 0.9), baseOrientation=TURN, physicsClientId=client, **shapes
    )
    position, turn = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    pose = at(*position)
    pose[:3, :3] = np.reshape(pybullet.getMatrixFromQuaternion(turn), (3, 3))
    return pose


@pytest.mark.parametrize("word", ["box", "sphere", "cylinder", "capsule", "mesh"])
def test_the_silhouette_is_that_of_pybullets_picture(renderer, bullet, tmp_path, word):
    """Round shapes go to PyBullet as fine meshes: its own are hulls of 42 directions, a sphere 8 % too small."""
    path = str(tmp_path / "theirs.obj")
    shape, theirs = {
        "box": (Box((0.8, 1.0, 1.2)), trimesh.creation.box((0.8, 1.0, 1.2))),
        "sphere": (Sphere((0.6,)), trimesh.creation.icosphere(5, 0.6)),
        "cylinder": (Cylinder((0.4, 1.0)), trimesh.creation.cylinder(0.4, 1.0, sections=128)),
        "capsule": (Capsule((0.3, 0.8)), trimesh.creation.capsule(0.8, 0.3, count=[128, 64])),
        "mesh": (
            Mesh(path, (1.5, 1.0, 1.0)),
            trimesh.creation.torus(0.5, 0.2, major_sections=24, minor_sections=12),
        ),
    }[word]
    theirs.export(path)
    scale = shape.size if word == "mesh" else (1.0, 1.0, 1.0)
    form = {"shapeType": pybullet.GEOM_MESH, "fileName": path, "meshScale": scale}
    if word == "box":
        form = {"shapeType": pybullet.GEOM_BOX, "halfExtents": np.array(shape.size) / 2.0}
    pose = place(bullet, baseVisualShapeIndex=pybullet.createVisualShape(physicsClientId=bullet, **form))
    assert overlap(renderer, Visual("it", shape, RED), pose, bullet_mask(bullet, AHEAD, BIG), BIG) >= 0.99


@pytest.mark.parametrize(
    ("shape", "kind", "arguments"),
    [
        (Box((0.8, 1.0, 1.2)), pybullet.GEOM_BOX, {"halfExtents": (0.4, 0.5, 0.6)}),
        (Sphere((0.6,)), pybullet.GEOM_SPHERE, {"radius": 0.6}),
        (Cylinder((0.4, 1.0)), pybullet.GEOM_CYLINDER, {"radius": 0.4, "height": 1.0}),
        (Capsule((0.3, 0.8)), pybullet.GEOM_CAPSULE, {"radius": 0.3, "height": 0.8}),
    ],
    ids=["box", "sphere", "cylinder", "capsule"],
)
def test_the_silhouette_is_that_of_the_body_the_physics_hits(renderer, bullet, shape, kind, arguments):
    """A ray through each pixel's centre, against Bullet's exact shapes."""
    form = pybullet.createCollisionShape(kind, physicsClientId=bullet, **arguments)
    pose = place(bullet, baseCollisionShapeIndex=form)
    columns, rows = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    rays = np.stack([(columns - CAMERA.cx) / CAMERA.fx, (rows - CAMERA.cy) / CAMERA.fy, np.ones(rows.shape)], axis=2)
    ends = (AHEAD[:3, 3] + 5.0 * rays.reshape(-1, 3) @ AHEAD[:3, :3].T).tolist()
    starts = [AHEAD[:3, 3].tolist()] * len(ends)
    hits = []
    for first in range(0, len(ends), 8000):
        part = slice(first, first + 8000)
        hits += pybullet.rayTestBatch(starts[part], ends[part], physicsClientId=bullet)
    theirs = np.reshape([hit[0] == 0 for hit in hits], rows.shape)
    assert overlap(renderer, Visual("it", shape, RED), pose, theirs, CAMERA) >= 0.99
