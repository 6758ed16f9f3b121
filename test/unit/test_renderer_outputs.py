"""Depths, masks, normals and previous positions, compared with PyBullet's ray casts and closed forms."""

import numpy as np
import pybullet
import pytest
from drawing import AHEAD, CAMERA, FLOOR, GREY, RED, at, box, looking

from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.renderer import FrameState
from drone_sim.shapes.box import Box
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.sphere import Sphere
from drone_sim.shapes.visual import Visual

SMALL = Intrinsics(64, 48, np.radians(70.0), 0.05, 50.0)
OUTPUTS = ("depth", "instance", "normal", "before")


def rotation(random):
    """Return a random rotation matrix, (3, 3)."""
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return turn * np.linalg.det(turn)


def flat(camera):
    """Return the rays of the pixels, scaled to z = 1, (height, width, 3)."""
    return camera.rays / camera.rays[..., 2:]


def random_scene(random):
    """Return random visuals, their poses, and a PyBullet client with the same bodies."""
    client = pybullet.connect(pybullet.DIRECT)
    visuals, poses = [], []
    for number in range(12):
        size = random.uniform(0.2, 0.8, 3)
        if number % 3 == 0:
            shape, form = Box(tuple(size)), {"shapeType": pybullet.GEOM_BOX, "halfExtents": size / 2}
        elif number % 3 == 1:
            shape, form = Sphere((size[0],)), {"shapeType": pybullet.GEOM_SPHERE, "radius": size[0]}
        else:
            shape = Cylinder((size[0] / 2, size[1]))
            form = {"shapeType": pybullet.GEOM_CYLINDER, "radius": size[0] / 2, "height": size[1]}
        pose = at(*random.uniform((2, -2, -1), (6, 2, 3)))
        pose[:3, :3] = rotation(random)
        visuals.append(Visual(number, shape, GREY))
        poses.append(pose)
        body = pybullet.createCollisionShape(physicsClientId=client, **form)
        quaternion = pybullet.getQuaternionFromEuler((0, 0, 0)) if number % 3 == 1 else quaternion_of(pose)
        pybullet.createMultiBody(0, body, -1, pose[:3, 3], quaternion, physicsClientId=client)
    return visuals, np.array(poses), client


def quaternion_of(pose):
    """Return x, y, z, w of a pose."""
    w = np.sqrt(max(0.0, 1 + np.trace(pose[:3, :3]))) / 2
    turn = pose[:3, :3]
    if w > 1e-3:
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * w)
        return [*axis, w]
    values, vectors = np.linalg.eigh((turn + turn.T) / 2)
    return [*vectors[:, np.argmax(values)], 0.0]


def cast(client, camera, camera_pose):
    """Return body number (from 1, 0 for none), hit point and normal in the world, for each pixel."""
    far = np.nan_to_num(camera.rays, nan=1.0) @ camera_pose[:3, :3].T * 20 + camera_pose[:3, 3]
    ends = far.reshape(-1, 3)
    hits = []
    for first in range(0, len(ends), 10_000):  # PyBullet limits the rays of a call
        part = ends[first : first + 10_000]
        origin = np.tile(camera_pose[:3, 3], (len(part), 1))
        hits += pybullet.rayTestBatch(origin.tolist(), part.tolist(), physicsClientId=client)
    shape = camera.height, camera.width
    bodies = np.array([one[0] + 1 for one in hits]).reshape(shape)
    return (
        bodies,
        np.array([one[3] for one in hits]).reshape(*shape, 3),
        np.array([one[4] for one in hits]).reshape(*shape, 3),
    )


def inner(labels):
    """Return a mask of the pixels whose eight neighbours have the same label."""
    same = np.ones(labels.shape, bool)
    for axis in (0, 1):
        for way in (-1, 1):
            same &= np.roll(labels, way, axis) == labels
    for way in (-1, 1):
        same &= np.roll(np.roll(labels, way, 0), 1, 1) == labels
        same &= np.roll(np.roll(labels, way, 0), -1, 1) == labels
    same[[0, -1]] = same[:, [0, -1]] = False
    return same


@pytest.mark.long
def test_masks_depths_and_normals_equal_ray_casts(renderer):
    """In 100 random scenes, at every pixel that is not at an edge."""
    random, compared = np.random.RandomState(29), 0
    eye = looking((0, 0, 1), (4, 0.2, 1.1))
    for _ in range(100):
        visuals, poses, client = random_scene(random)
        bodies, points, normals = cast(client, SMALL, eye)
        pybullet.disconnect(client)
        renderer.set_visuals(visuals)
        numbers = np.arange(1, len(visuals) + 1)
        drawn = renderer.render_outputs(("depth", "instance", "normal"), SMALL, eye, poses, instances=numbers)
        interior = inner(bodies) & inner(drawn["instance"])
        np.testing.assert_array_equal(drawn["instance"][interior], bodies[interior])
        is_hit = interior & (bodies > 0)
        compared += is_hit.sum()
        depth = (points - eye[:3, 3]) @ eye[:3, 2]
        even = is_hit & (np.array([isinstance(one.shape, Box) for one in visuals])[bodies - 1])
        even &= inner((normals @ (1, 10, 100)).round(3))  # without the edges between the faces of a box
        np.testing.assert_allclose(drawn["depth"][even], depth[even], atol=2e-3)
        cosine = np.einsum("ijk,ijk->ij", drawn["normal"], normals @ eye[:3, :3])
        assert np.degrees(np.arccos(np.clip(cosine[even], -1, 1))).max(initial=0) < 1
    assert compared > 30_000


@pytest.mark.parametrize("shape", [Sphere((0.7,)), Cylinder((0.5, 1.5))])
def test_the_normals_of_round_shapes_are_radial(renderer, shape):
    renderer.set_visuals([Visual("one", shape, RED)])
    drawn = renderer.render_outputs(("normal", "depth"), CAMERA, AHEAD, at(3, 0.2, 1)[None])
    is_hit = inner(np.isfinite(drawn["depth"])) & np.isfinite(drawn["depth"])
    points = flat(CAMERA)[is_hit] * drawn["depth"][is_hit, None] @ AHEAD[:3, :3].T + AHEAD[:3, 3] - (3, 0.2, 1)
    radial = points * ((1, 1, 1) if isinstance(shape, Sphere) else (1, 1, 0))
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", drawn["normal"][is_hit] @ AHEAD[:3, :3].T, radial)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 1


def test_the_normals_of_an_unevenly_scaled_box_are_perpendicular_to_its_faces(renderer):
    turned = at(3, 0, 1)
    turned[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    renderer.set_visuals([box("flat", (0.05, 2.0, 1.0))])
    normal = renderer.render_outputs(("normal",), CAMERA, AHEAD, turned[None])["normal"][120, 160]
    np.testing.assert_allclose(normal @ AHEAD[:3, :3].T, (-0.8, -0.6, 0), atol=1e-6)


def test_the_before_output_contains_the_previous_position_of_each_point(renderer):
    visuals = [box("moves", (0.5, 0.5, 0.5)), box("stands", (0.3, 6.0, 6.0))]
    then, now = np.array([at(3, 0.1, 1), at(5, 0, 1)]), np.array([at(2.9, -0.1, 1.1), at(5, 0, 1)])
    turned = looking((0.05, 0.1, 1.02), (3, 0.3, 1.0))
    renderer.set_visuals(visuals)
    before = FrameState(AHEAD, then)
    drawn = renderer.render_outputs(OUTPUTS, CAMERA, turned, now, instances=np.array([1, 2]), before=before)
    is_hit = np.isfinite(drawn["depth"])
    points = flat(CAMERA) * np.nan_to_num(drawn["depth"])[..., None] @ turned[:3, :3].T + turned[:3, 3]
    moved = np.where((drawn["instance"] == 1)[..., None], now[0, :3, 3] - then[0, :3, 3], 0)
    previous = (points - moved - AHEAD[:3, 3]) @ AHEAD[:3, :3]
    np.testing.assert_allclose(drawn["before"][is_hit], previous[is_hit], atol=2e-3)
    assert np.isnan(drawn["before"][~is_hit]).all()
    assert np.abs(CAMERA.project(previous) - CAMERA.pixels)[drawn["instance"] == 1].max() > 5


def test_outputs_are_the_same_when_rendered_alone_and_together(renderer):
    ground = Visual("ground", Box((90.0, 90.0, 0.1)), GREY, ground=True)
    glass = box("glass", (0.1, 0.5, 2), (1, 1, 1, 0.3))
    renderer.set_visuals([box("a", (0.5, 0.5, 0.5)), glass, FLOOR, ground])
    poses = np.array([at(3, 0, 1), at(2, 0.6, 1), at(0, 0, 0.01), at(0, 0, -0.1)])
    arguments = {"instances": np.array([7, 60000, 8, 9]), "before": FrameState(AHEAD, poses)}
    together = renderer.render_outputs(OUTPUTS, CAMERA, AHEAD, poses, **arguments)
    colored = renderer.render_outputs((*OUTPUTS, "color"), CAMERA, AHEAD, poses, **arguments)
    np.testing.assert_array_equal(colored["color"], renderer.render(CAMERA, AHEAD, poses))
    for name in OUTPUTS:
        alone = renderer.render_outputs((name,), CAMERA, AHEAD, poses, **arguments)[name]
        np.testing.assert_array_equal(alone, together[name])
        np.testing.assert_array_equal(alone, colored[name])
    assert set(np.unique(together["instance"])) >= {0, 7, 60000}, "transparent visuals are in the mask, too"
    with pytest.raises(ValueError, match="before"):
        renderer.render_outputs(("before",), CAMERA, AHEAD, poses)


@pytest.mark.parametrize("largest", [255, 256])
def test_masks_are_uint16_for_small_and_large_numbers(renderer, largest):
    renderer.set_visuals([box("a", (0.5, 0.5, 0.5)), box("b", (0.5, 0.5, 0.5))])
    poses, numbers = np.array([at(3, 0.5, 1), at(3, -0.5, 1)]), np.array([3, largest])
    mask = renderer.render_outputs(("instance",), CAMERA, AHEAD, poses, instances=numbers)["instance"]
    assert mask.dtype == np.uint16
    assert set(np.unique(mask)) == {0, 3, largest}


@pytest.mark.parametrize(
    "centres",
    [[(2, -0.1, 1), (2, 0.1, 1)], [(2, 0, 1), (2, 0, 1)], [(2, 0.1, 1), (2.1, 0, 1.1)], [(2, 0, 1), (3, 0.1, 1)]],
    ids=["coplanar faces that overlap", "one at the place of the other", "interpenetrating", "one behind the other"],
)
def test_count_alone_counts_each_pixel_of_an_object_once(renderer, centres):
    boxes, poses = [box(name, (0.2, 0.4, 0.4)) for name in "ab"], np.array([at(*centre) for centre in centres])
    renderer.set_visuals(boxes)
    whole = np.isfinite(renderer.render_depth(CAMERA, AHEAD, poses)).sum()
    np.testing.assert_array_equal(renderer.count_alone(CAMERA, AHEAD, poses, np.array([1, 1])), [0, whole])
    apart = renderer.count_alone(CAMERA, AHEAD, poses, np.array([1, 2]))
    for number, (visual, pose) in enumerate(zip(boxes, poses), 1):
        renderer.set_visuals([visual])
        assert apart[number] == np.isfinite(renderer.render_depth(CAMERA, AHEAD, pose[None])).sum() > 1000


def test_count_alone_ends_at_the_near_and_the_far_plane(renderer):
    camera = Intrinsics(320, 240, np.radians(60.0), 1.0, 3.0)
    renderer.set_visuals([box("through near", (2.0, 0.2, 0.2)), box("beyond far", (0.2, 9.0, 9.0))])
    poses, both = np.array([at(1.5, 0.3, 1), at(4, 0, 1)]), np.array([1, 2])
    mask = renderer.render_outputs(("instance",), camera, AHEAD, poses, instances=both)["instance"]
    np.testing.assert_array_equal(renderer.count_alone(camera, AHEAD, poses, both), [0, (mask == 1).sum(), 0])
