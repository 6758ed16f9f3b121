"""Pictures and depths of the renderer: geometry, shadows, textures, and silhouettes compared with PyBullet."""

import threading

import cv2
import numpy as np
import pybullet
import pytest
import trimesh
from drawing import AHEAD, BLUE, CAMERA, FLOOR, GREY, RED, at, box, draw, looking, pixel, reddish, seen

from drone_sim.render import batches, context, culling
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics, Orthographic
from drone_sim.render.programs import TO_SUN
from drone_sim.render.renderer import FrameState, Renderer
from drone_sim.shapes.box import Box
from drone_sim.shapes.capsule import Capsule
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.plane import Plane
from drone_sim.shapes.sphere import Sphere
from drone_sim.shapes.visual import Visual


def test_a_cube_covers_the_predicted_pixels(renderer):
    """The front face, 4.8 m ahead, is a square with known edges, away from the middle of the picture."""
    picture = draw(renderer, [box("cube", (0.4, 0.4, 0.4))], [at(5.0, 0.7, 1.5)])
    rows, columns = np.nonzero(reddish(picture))
    left, top = pixel(CAMERA, (-0.9, -0.7, 4.8))
    right, bottom = pixel(CAMERA, (-0.5, -0.3, 4.8))
    # Sides that face away from the axis are invisible; those that face it extend to 5.2 m.
    assert abs(columns.min() - 0.5 - left) < 0.5 + 1e-6 and abs(rows.min() - 0.5 - top) < 0.5 + 1e-6
    right, bottom = (max(right, pixel(CAMERA, (-0.5, -0.3, 5.2))[0]), max(bottom, pixel(CAMERA, (-0.5, -0.3, 5.2))[1]))
    assert abs(columns.max() + 0.5 - right) < 0.5 + 1e-6 and abs(rows.max() + 0.5 - bottom) < 0.5 + 1e-6


def test_the_centroid_of_a_ball_is_where_k_projects_it(renderer):
    for y, z in ((0.0, 1.0), (1.1, 1.6), (-1.3, 0.3)):
        picture = draw(renderer, [Visual("ball", Sphere((0.15,)), RED)], [at(4.0, y, z)])
        rows, columns = np.nonzero(reddish(picture))
        u, v = pixel(CAMERA, (-y, 1.0 - z, 4.0))
        assert abs(columns.mean() - u) < 0.5 and abs(rows.mean() - v) < 0.5


def test_up_is_up_and_left_is_left(renderer):
    cubes = [box("high", (0.3, 0.3, 0.3), RED), box("left", (0.3, 0.3, 0.3), BLUE)]
    picture = draw(renderer, cubes, [at(4.0, 0.0, 2.0), at(4.0, 1.0, 1.0)])
    assert np.nonzero(reddish(picture))[0].mean() < 60
    assert np.nonzero((picture[:, :, 2] > 100) & (picture[:, :, 0] < 40))[1].mean() < 100
    assert picture[0].mean() < picture[100].mean()  # the sky is darker above than at the horizon


@pytest.mark.parametrize(
    "camera",
    [CAMERA, Orthographic(160, 120, 4.0, 0.1, 20.0), Distorted(160, 120, 2.6, 0.02, 50.0, "equidistant")],
    ids=["pinhole", "orthographic", "fisheye"],
)
def test_culling_skips_visuals_outside_the_view_without_changing_the_picture(renderer, monkeypatch, camera):
    """Pictures and outputs with culling equal those without culling, to the last bit."""
    random, masks = np.random.default_rng(7), []
    monkeypatch.setattr(batches, "MANY_VERTICES", 0)

    def in_view_recorded(*arguments):
        masks.append(culling.in_view(*arguments))
        return masks[-1]

    names = ["color", "depth", "instance", "before"]
    for _ in range(20):
        shapes = [Box((0.4, 0.2, 0.3)), Sphere((0.2,)), Cylinder((0.2, 0.6)), Box((0.2, 0.4, 0.3))]
        colors = [RED, BLUE, (0.0, 1.0, 0.0, 0.5), GREY]
        visuals = [FLOOR, *(Visual(number, shapes[number % 4], colors[number % 4]) for number in range(40))]
        poses = np.array([np.eye(4), *(at(*point) for point in random.uniform((-6, -6, -0.5), (8, 6, 4), (40, 3)))])
        renderer.set_visuals(visuals)
        before = FrameState(AHEAD, poses + random.normal(0.0, 0.05))
        view = looking(random.uniform((-3, -3, 0.5), (3, 3, 3)), random.uniform(-3, 3, 3))
        images = []
        for in_view in (in_view_recorded, lambda centres, *_: np.ones(len(centres), dtype=bool)):
            monkeypatch.setattr(batches, "in_view", in_view)
            images.append(
                renderer.render_outputs(names, camera, view, poses, instances=np.arange(1, 42), before=before)
            )
        for name in names:
            np.testing.assert_array_equal(images[0][name], images[1][name])
    assert 0.1 < np.mean(masks) < 0.9


def test_an_object_outside_the_view_casts_a_shadow_into_it(renderer, monkeypatch):
    """The ball is 3 m above the picture's upper edge; its shadow is in the middle."""
    monkeypatch.setattr(batches, "MANY_VERTICES", 0)
    view = looking((0.0, 0.0, 2.0), (0.0, 0.1, 0.0))
    x, y, z = np.array(TO_SUN) / TO_SUN[2] * 5.0
    with_shadow = draw(renderer, [FLOOR, Visual("ball", Sphere((0.2,)), RED)], [np.eye(4), at(x, y + 0.1, z)], view)
    without = draw(renderer, [FLOOR], [np.eye(4)], view)
    assert not reddish(with_shadow).any() and with_shadow[120, 160].mean() < 0.6 * without[120, 160].mean()


def test_visuals_are_added_changed_and_removed(renderer):
    first, second = box("a", (0.5, 0.5, 0.5)), box("b", (0.5, 0.5, 0.5), BLUE)
    poses = [at(4.0, -1.0, 1.0), at(4.0, 1.0, 1.0)]
    empty = draw(renderer, [], [])
    assert not reddish(empty).any()
    one = reddish(draw(renderer, [first], poses[:1])).sum()
    assert one > 100
    both = draw(renderer, [first, second], poses)
    assert reddish(both).sum() == one and (both[:, :, 2] - both[:, :, 0].astype(int) > 100).any()
    assert reddish(draw(renderer, [first, second], poses[::-1]))[:, :160].sum() > 100
    assert reddish(draw(renderer, [box("a", (0.5, 1.0, 0.5)), second], poses)).sum() > 1.6 * one
    assert not reddish(draw(renderer, [box("a", (0.5, 0.5, 0.5), BLUE), second], poses)).any()
    np.testing.assert_array_equal(draw(renderer, [], []), empty)


def test_an_unreadable_mesh_leaves_the_scene_as_it_was(renderer):
    before = draw(renderer, [box("a", (0.5, 0.5, 0.5))], [at(4, 0, 1)])
    with pytest.raises(ValueError, match=r"missing\.obj"):
        renderer.set_visuals([Visual("b", Mesh("missing.obj"), RED)])
    np.testing.assert_array_equal(renderer.render(CAMERA, AHEAD, at(4, 0, 1)[None]), before)


def test_an_orthographic_camera_shows_the_same_size_at_any_distance(renderer):
    camera = Orthographic(160, 120, 4.0, 0.1, 20.0)
    for distance in (2.0, 8.0):
        cubes, poses = [box("cube", (0.4, 0.4, 0.4))], np.array([at(distance, 0.7, 1.5)])
        renderer.set_visuals(cubes)
        rows, columns = np.nonzero(reddish(renderer.render(camera, AHEAD, poses)))
        # 40 px/m; 0.7 m to the left and 0.5 m up of the middle
        assert (columns.min(), columns.max() + 1) == (80 - 28 - 8, 80 - 28 + 8)
        assert (rows.min(), rows.max() + 1) == (60 - 20 - 8, 60 - 20 + 8)
        depth = renderer.render_depth(camera, AHEAD, poses)
        assert np.isfinite(depth).sum() == 16 * 16 and depth[40, 52] == pytest.approx(distance - 0.2, abs=1e-5)
    u, v = (round(one) for one in pixel(CAMERA, (-0.7, -0.5, 7.8)))
    assert renderer.render_depth(CAMERA, AHEAD, poses)[v, u] == pytest.approx(7.8, abs=1e-3), "a perspective camera"


def test_depth_is_in_metres_and_nan_where_nothing_is_hit(renderer):
    renderer.set_visuals([box("wall", (1.0, 2.0, 2.0)), box("distant", (1.0, 40.0, 1000.0))])
    poses = np.array([at(5.5, 0.0, 1.0), at(105.0, 0.0, 1.0)])
    depth = renderer.render_depth(CAMERA, AHEAD, poses)
    assert depth.shape == (240, 320) and depth.dtype == np.float32
    wall = np.abs(depth - 5.0) < 0.5
    assert 10000 < wall.sum() < 15000
    np.testing.assert_allclose(depth[wall], 5.0, rtol=0, atol=0.001)
    assert np.isnan(depth[~wall]).all()
    farther = Intrinsics(320, 240, np.radians(60.0), 0.02, 200.0)
    assert np.nanmax(renderer.render_depth(farther, AHEAD, poses)) == pytest.approx(104.5, abs=0.01)


def test_depth_is_precise_far_from_the_origin(renderer):
    renderer.set_visuals([box("wall", (1.0, 2.0, 2.0))])
    depth = renderer.render_depth(CAMERA, at(1e5, 3e5, 0) @ AHEAD, at(1e5 + 5.5, 3e5, 1.0)[None])
    np.testing.assert_allclose(depth[120, 160], 5.0, atol=0.001)


def test_the_depth_of_a_pixel_is_that_of_the_nearest_visual(renderer):
    visuals, poses = (
        [box("a", (0.5, 0.5, 0.5)), FLOOR, box("b", (0.5, 0.5, 0.5))],
        [at(4, 1, 1), at(0, 0, 0), at(4, -1, 1)],
    )
    labels = seen(renderer, visuals, poses)
    assert (labels[120, 80], labels[239, 160], labels[120, 239], labels[0, 0]) == (0, 1, 2, -1)
    depth = renderer.render_depth(CAMERA, AHEAD, np.array(poses))
    np.testing.assert_array_equal(np.isnan(depth), labels == -1)
    for index, (visual, pose) in enumerate(zip(visuals, poses)):
        renderer.set_visuals([visual])
        alone = renderer.render_depth(CAMERA, AHEAD, pose[None])
        np.testing.assert_array_equal(depth[labels == index], alone[labels == index])


def test_transparent_visuals_are_blended_with_the_visuals_behind_them(renderer):
    wall, panes = box("wall", (0.1, 9.0, 9.0), BLUE), []
    poses = [at(6, 0, 1), at(4, 0, 1), at(5, 0, 1)]
    wall_color = draw(renderer, [wall], poses[:1])[120, 160].astype(float)
    for key, rgba in (("near", (1.0, 0.0, 0.0, 0.5)), ("far", (0.0, 1.0, 0.0, 0.5))):
        panes.append(box(key, (0.1, 1.0, 1.0), rgba))
    pane_colors = [
        draw(renderer, [box("p", (0.1, 1.0, 1.0), (*pane.rgba[:3], 1.0))], [pose])[120, 160]
        for pane, pose in zip(panes, poses[1:])
    ]
    expected = 0.5 * pane_colors[0] + 0.25 * pane_colors[1] + 0.25 * wall_color
    for order in ([wall, *panes], [panes[1], wall, panes[0]]):
        placed = [poses[[wall, *panes].index(visual)] for visual in order]
        np.testing.assert_allclose(draw(renderer, order, placed)[120, 160], expected, atol=2.0)


DOWN = looking((-4.0, 0.0, 5.0), (0.0, 0.0, 0.0))


def test_a_shadow_darkens_the_floor_under_an_object_and_nothing_else(renderer):
    poses = [at(0, 0, 0), at(0, 0, 1.5)]
    bare = draw(renderer, [FLOOR], poses[:1], DOWN).astype(int)
    picture = draw(renderer, [FLOOR, box("a", (1.0, 1.0, 0.2))], poses, DOWN).astype(int)
    labels = seen(renderer, [FLOOR, box("a", (1.0, 1.0, 0.2))], poses, DOWN)
    darker = (labels == 0) & (picture.sum(axis=2) < bare.sum(axis=2) - 30)
    assert darker.sum() > 1000
    ratio = picture[darker].sum() / bare[darker].sum()
    assert 0.4 < ratio < 0.7
    np.testing.assert_array_equal(picture[(labels != 1) & ~darker], bare[(labels != 1) & ~darker])
    columns = np.nonzero(darker)[1]
    assert 0.8 < np.ptp(columns) / (2 * CAMERA.fx * 0.5 / 6.4) < 1.6  # about a metre wide, 6.4 m away


def test_shadows_do_not_add_up(renderer):
    visuals = [FLOOR, box("a", (1.0, 1.0, 0.1)), box("b", (1.0, 1.0, 0.1))]
    alone = draw(renderer, visuals[:2], [at(0, 0, 0), at(0, 0, 1.5)], DOWN)
    both = draw(renderer, visuals, [at(0, 0, 0), at(0, 0, 1.5), at(0, 0, 2.0)], DOWN)
    labels = seen(renderer, visuals, [at(0, 0, 0), at(0, 0, 1.5), at(0, 0, 2.0)], DOWN)
    floor = both[labels == 0]
    assert len(np.unique(floor[:, 0])) == 2  # lit or in shadow, nothing darker
    assert floor[:, 0].min() == alone[:, :, 0][renderer_floor(alone)].min()


def renderer_floor(picture):
    return np.ptp(picture.astype(int), axis=2) < 12


def test_shadows_end_where_the_floor_ends(renderer):
    small = box("floor", (1.0, 1.0, 0.2), GREY, floor=True)
    poses = np.array([at(0, 0, -0.1), at(0, 0, 1.5)])
    visuals, level = [small, box("a", (3.0, 3.0, 0.1), RED)], looking((-4, 0, 0.9), (0, 0, 0))
    picture = draw(renderer, visuals, poses, level)
    labels = seen(renderer, visuals, poses, level)
    sky = draw(renderer, [], [], level)
    np.testing.assert_array_equal(picture[labels == -1], sky[labels == -1])


def test_multisampling_smooths_edges_and_only_edges():
    scene = [Visual("disc", Cylinder((0.5, 0.1)), RED)], [at(3, 0, 1) @ looking((0, 0, 0), (1, 0, 0.001))]
    rough, smooth = Renderer(), Renderer(samples=4)
    try:
        pictures = [draw(renderer, *scene) for renderer in (rough, smooth, rough)]
    finally:
        rough.close()
        smooth.close()
    np.testing.assert_array_equal(pictures[0], pictures[2])
    changed = (np.abs(pictures[0].astype(int) - pictures[1]) > 3).any(axis=2)
    inside = cv2.erode(reddish(pictures[0]).astype(np.uint8), np.ones((5, 5)))
    outside = 1 - cv2.dilate(reddish(pictures[0]).astype(np.uint8), np.ones((5, 5)))
    assert changed.sum() > 50 and not (changed & (inside | outside).astype(bool)).any()


def quarters(path):
    """Write a picture with red and blue in the upper row, green and white in the lower; return its path."""
    image = np.zeros((64, 64, 3), np.uint8)
    image[:32, :32], image[:32, 32:], image[32:, :32], image[32:][:, 32:] = (0, 0, 255), (255, 0, 0), (0, 255, 0), 255
    cv2.imwrite(str(path), image)
    return str(path)


@pytest.mark.parametrize("shape", ["box", "mesh"])
def test_textures_are_the_right_way_up(renderer, tmp_path, shape):
    image, wall = quarters(tmp_path / "quarters.png"), Box((1.0, 1.0, 1.0))
    if shape == "mesh":
        wall = Mesh(str(tmp_path / "wall.obj"))
        (tmp_path / "wall.mtl").write_text("newmtl picture\nKd 1 1 1\nmap_Kd quarters.png\n")
        (tmp_path / "wall.obj").write_text(
            "mtllib wall.mtl\nv 0 .5 -.5\nv 0 -.5 -.5\nv 0 -.5 .5\nv 0 .5 .5\n"
            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl picture\nf 1/1 2/2 3/3 4/4\n"
        )
        image = ""
    visual = Visual("wall", wall, (1.0, 1.0, 1.0, 1.0), texture=image)
    picture = draw(renderer, [visual], [at(2, 0, 1)])
    top_left, top_right, low_left, low_right = (picture[v, u].astype(int) for v in (90, 150) for u in (130, 190))
    assert np.argmax(top_left) == 0 and np.argmax(top_right) == 2 and np.argmax(low_left) == 1
    assert top_left.min() < 10 and top_right.min() < 10 and low_left.min() < 10 and low_right.min() > 80


def test_textures_repeat(renderer, tmp_path):
    floor = Visual("floor", Plane(), (1.0, 1.0, 1.0, 1.0), texture=quarters(tmp_path / "q.png"), floor=True)
    above = np.array([[0.0, -1, 0, 0.5], [-1, 0, 0, 0.5], [0, 0, -1, 2.0], [0, 0, 0, 1]])
    picture = draw(renderer, [floor], [at(0, 0, 0)], above)
    shift = above.copy()
    shift[:2, 3] += (3.0, -5.0)
    np.testing.assert_allclose(draw(renderer, [floor], [at(0, 0, 0)], shift), picture, atol=3)
    assert np.ptp(picture[:, :, 0]) > 150


def test_the_same_scene_gives_the_same_picture_after_other_renderings(renderer):
    visuals = [FLOOR, box("a", (1, 1, 1)), Visual("g", Sphere((0.4,)), (0, 1, 0, 0.4))]
    poses = np.array([at(0, 0, 0), at(5, 1, 0.5), at(3, 0, 1)])
    first = draw(renderer, visuals, poses)
    renderer.render_depth(CAMERA, DOWN, poses)
    wide = Intrinsics(64, 48, 1.5, 0.1, 20.0)
    assert renderer.render(wide, DOWN, poses).shape == (48, 64, 3)
    renderer.render_depth(wide, AHEAD, poses)
    out = np.zeros((240, 320, 3), np.uint8)
    assert renderer.render(CAMERA, AHEAD, poses, out=out) is out
    np.testing.assert_array_equal(out, first)
    assert first.flags.c_contiguous and first.dtype == np.uint8


def test_wrong_arguments_are_refused(renderer):
    renderer.set_visuals([FLOOR])
    with pytest.raises(ValueError, match="1 visuals"):
        renderer.render(CAMERA, AHEAD, np.zeros((2, 4, 4)))
    with pytest.raises(ValueError, match="out"):
        renderer.render(CAMERA, AHEAD, at(0, 0, 0)[None], out=np.zeros((240, 320, 4), np.uint8))
    with pytest.raises(ValueError, match="samples"):
        Renderer(samples=3)


def test_a_closed_renderer_refuses_use_and_can_be_closed_again():
    renderer = Renderer()
    renderer.set_visuals([FLOOR])
    renderer.close()
    renderer.close()
    with pytest.raises(RuntimeError, match="closed"):
        renderer.set_visuals([])


def test_use_from_another_thread_is_refused(renderer):
    caught = []

    def use():
        try:
            renderer.set_visuals([])
        except RuntimeError as error:
            caught.append(str(error))

    thread = threading.Thread(target=use)
    thread.start()
    thread.join()
    assert caught and "thread" in caught[0]


def test_without_egl_a_one_line_error_names_the_missing_library(monkeypatch):
    monkeypatch.setattr(context, "LIBEGL", "libNoSuchEGL.so.1")
    with pytest.raises(context.RendererUnavailable, match="libegl1") as caught:
        Renderer()
    assert "\n" not in str(caught.value)


# ---- silhouettes against PyBullet's rays


@pytest.fixture()
def bullet():
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(client)


def bullet_mask(client, camera_pose, intrinsics):
    """Return a mask of the pixels that show the first body in TinyRenderer's picture of the same camera."""
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
    """Create a body in front of the camera and return its pose."""
    body = pybullet.createMultiBody(
        0, basePosition=(2.2, 0.1, 0.9), baseOrientation=TURN, physicsClientId=client, **shapes
    )
    position, turn = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    pose = at(*position)
    pose[:3, :3] = np.reshape(pybullet.getMatrixFromQuaternion(turn), (3, 3))
    return pose


@pytest.mark.parametrize("word", ["box", "sphere", "cylinder", "capsule", "mesh"])
def test_the_silhouette_equals_that_of_pybullets_picture(renderer, bullet, tmp_path, word):
    """Round shapes go to PyBullet as fine meshes: its own are hulls of 42 directions, a sphere 8 % too small."""
    path = str(tmp_path / "theirs.obj")
    shape, theirs = {
        "box": (Box((0.8, 1.0, 1.2)), trimesh.creation.box((0.8, 1.0, 1.2))),
        "sphere": (Sphere((0.6,)), trimesh.creation.icosphere(5, 0.6)),
        "cylinder": (Cylinder((0.4, 1.0)), trimesh.creation.cylinder(0.4, 1.0, sections=128)),
        "capsule": (Capsule((0.3, 0.8)), trimesh.creation.capsule(0.8, 0.3, count=[128, 64])),
        "mesh": (Mesh(path, (1.5, 1.0, 1.0)), trimesh.creation.torus(0.5, 0.2, major_sections=24, minor_sections=12)),
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
def test_the_silhouette_equals_that_of_ray_casts_against_the_body(renderer, bullet, shape, kind, arguments):
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
