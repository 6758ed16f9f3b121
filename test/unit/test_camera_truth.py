"""Ground truth of a drone's camera: names, categories, boxes and flow, rendered only on request."""

import json

import cv2
import numpy as np
import pytest
import yaml
from pycocotools.coco import COCO
from pycocotools.mask import area, toBbox
from test_renderer_outputs import inner

from drone_sim.mechanics.state import Pose
from drone_sim.offline.fly import main as fly

SCENE = {
    "drone": {"position": [0, 0, 1]},
    "objects": [
        {"name": "Wall", "shape": "box", "size": [0.1, 2.0, 2.0], "position": [4, 0, 1.5], "category": "obstacle"},
        {"name": "Post7", "shape": "box", "size": [0.2, 0.4, 1.0], "position": [2.5, 0.5, 1.0]},
        {"name": "Aside", "shape": "box", "size": [0.2, 1.0, 0.2], "position": [2.5, -1.5, 1.0]},
    ],
}


@pytest.fixture(
    name="simulation", params=[None, {"model": "plumb_bob", "coefficients": [-0.2, 0.05]}], ids=["pinhole", "lens"]
)
def _simulation(request, new_simulation):
    cameras = {"front": {"lens": request.param}} if request.param else {}
    return new_simulation({"cameras": cameras}, steps=5, scene=yaml.safe_dump(SCENE))


def by_name(truth):
    return {one.identity.name: one for one in truth.seen()}


def test_masks_and_boxes_have_the_names_and_categories_of_the_scene(simulation):
    truth = simulation.drone.cameras["front"].truth()
    seen = by_name(truth)
    assert {"Wall", "Post7", "Aside", "Floor"} <= set(seen)
    assert {name: one.identity.category for name, one in seen.items()} == {
        "Wall": "obstacle", "Post7": "Post", "Aside": "Aside", "Floor": "Floor",
    }  # fmt: skip
    mask, categories = truth.output("instance"), truth.categories
    for one in seen.values():
        assert one.pixels == (mask == one.number).sum()
        category = truth.numbered.categories.index(one.identity.category) + 1
        assert (categories[mask == one.number] == category).all()
        rows, columns = np.nonzero(mask == one.number)
        assert one.visible[:2] == (columns.min() - 0.5, rows.min() - 0.5)
        assert one.visible[2:] == (columns.max() + 0.5, rows.max() + 0.5)


def test_3d_boxes_match_the_poses_and_sizes_of_the_objects(simulation):
    camera = simulation.drone.cameras["front"]
    eye = np.reshape((*camera.pose(), 0, 0, 0, 1), (4, 4))
    for entry in SCENE["objects"]:
        one = by_name(camera.truth())[entry["name"]]
        np.testing.assert_allclose((eye @ one.pose)[:3, 3], entry["position"], atol=1e-6)
        np.testing.assert_allclose(np.abs(eye[:3, :3] @ one.pose[:3, :3]), np.eye(3), atol=1e-6)
        np.testing.assert_allclose(one.size, entry["size"], atol=1e-6)


def test_occlusion_and_truncation_are_measured(simulation):
    camera = simulation.drone.cameras["front"]
    seen = by_name(camera.truth())
    assert seen["Post7"].occlusion == 0 and seen["Post7"].truncation == 0
    assert 0.02 < seen["Wall"].occlusion < 0.4 and seen["Wall"].truncation == 0
    assert 0.2 < seen["Aside"].truncation < 0.9
    assert seen["Aside"].full.right > camera.intrinsics.width
    alone = np.count_nonzero(camera.truth().output("instance") == seen["Wall"].number)
    assert alone / (1 - seen["Wall"].occlusion) == pytest.approx(alone + count_hidden_pixels(camera, seen), rel=0.01)


def count_hidden_pixels(camera, seen):
    """Return the number of pixels of the post that lie in front of the wall."""
    truth = camera.truth()
    rays = camera.intrinsics.rays[truth.output("instance") == seen["Post7"].number]
    pose, size = seen["Wall"].pose, seen["Wall"].size
    near = rays / rays[:, 2:] * (pose[2, 3] - size[0] / 2)
    local = (near - pose[:3, 3]) @ pose[:3, :3]
    return (np.abs(local[:, 1:]) <= size[1:] / 2).all(axis=1).sum()


@pytest.fixture(name="picture_of")
def _picture_of(tmp_path, new_simulation):
    """Return a function that takes a picture with the front camera, 1 m above the floor: seen objects and camera."""

    def take(objects, **camera):
        scene = yaml.safe_dump({"objects": objects, "drone": {"position": [0, 0, 1]}})
        front = new_simulation({"cameras": {"front": camera}}, scene=scene).drone.cameras["front"]
        return by_name(front.truth()), front

    return take


def test_overlapping_parts_of_a_compound_are_not_occlusion(picture_of):
    parts = [{"shape": "box", "size": [0.2, 0.4, 0.4], "position": [0, y, 0]} for y in (-0.1, 0.1)]
    seen, _ = picture_of([{"name": "Pair", "shape": "compound", "parts": parts, "position": [2, 0, 1]}])
    assert seen["Pair"].occlusion == 0 and seen["Pair"].pixels > 10_000


def test_an_object_that_extends_behind_the_camera_ends_at_the_near_plane(picture_of):
    beam = {"name": "Beam", "shape": "box", "size": [6.0, 0.4, 0.2], "position": [0, 0.8, 1.0]}
    seen, camera = picture_of([beam], near=0.05)
    lens, eye = camera.intrinsics, camera.pose()
    far, left, right = 3.0 - eye[3], 1.0 - eye[7], 0.6 - eye[7]  # of the beam, from the camera, m
    top, bottom = 1.1 - eye[11], 0.9 - eye[11]
    expected = (
        lens.cx - lens.fx * left / lens.near, lens.cy - lens.fx * top / lens.near,
        lens.cx - lens.fx * right / far, lens.cy - lens.fx * bottom / lens.near,
    )  # fmt: skip
    np.testing.assert_allclose(seen["Beam"].full, expected, rtol=1e-4, atol=0.5)
    wide, high = expected[2] - expected[0], expected[3] - expected[1]
    inside = (expected[2] + 0.5) * lens.height  # the part that the picture shows is as high as the picture
    assert seen["Beam"].truncation == pytest.approx(1 - inside / (wide * high), rel=1e-3)
    assert seen["Floor"].truncation > 0.99, "the floor reaches behind the camera, too"


def test_flow_equals_that_of_reprojected_points(simulation):
    camera = simulation.drone.cameras["front"]
    first = camera.truth()
    depth, before = first.output("depth"), first.moment
    simulation.drone.body.move(Pose((0.05, 0.03, 1.02), (0.0, 0.0, 0.02, 0.9998)))
    truth = camera.truth()
    flow, known = truth.flow(depth)
    world = truth.points @ truth.moment.camera_pose[:3, :3].T + truth.moment.camera_pose[:3, 3]
    previous_pixels = camera.intrinsics.project((world - before.camera_pose[:3, 3]) @ before.camera_pose[:3, :3])
    assert known.mean() > 0.3
    missed = np.abs(flow - (camera.intrinsics.pixels - previous_pixels)).max(axis=-1)
    assert missed[known & inner(truth.output("instance"))].max() < 0.1, "except at edges between two objects"
    assert np.linalg.norm(flow[known], axis=1).max() > 5
    assert (flow[~known] == 0).all()


def test_a_flight_is_written_as_a_coco_dataset(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(yaml.safe_dump(SCENE))
    folder, small = tmp_path / "seen", ["cameras.front.width=64", "cameras.front.height=48"]
    assert fly(["--scene", str(scene), "--duration", "0.15", "--truth", str(folder), "--set", *small]) == 0
    annotations, dataset = json.loads((folder / "annotations.json").read_text()), COCO(folder / "annotations.json")
    assert [one["file_name"] for one in annotations["images"]] == [f"color/{number:06}.png" for number in range(3)]
    categories = {one["id"]: one["name"] for one in annotations["categories"]}
    assert len({one["id"] for one in annotations["annotations"]}) == len(annotations["annotations"]) > 6
    for one in annotations["annotations"]:
        file = f"{one['image_id']:06}.png"
        mask = cv2.imread(str(folder / "instances" / file), cv2.IMREAD_UNCHANGED) == one["number"]
        np.testing.assert_array_equal(dataset.annToMask(one), mask)  # as COCO's own reader decodes it
        assert one["bbox"] == toBbox(dataset.annToRLE(one)).tolist() and one["area"] == area(dataset.annToRLE(one))
    assert {one["name"]: categories[one["category_id"]] for one in annotations["annotations"]}["Wall"] == "obstacle"
    arrays = np.load(folder / "truth" / "000001.npz")
    assert {name: one.shape for name, one in arrays.items()} == {
        "depth": (48, 64), "normals": (48, 64, 3), "flow": (48, 64, 2), "flow_known": (48, 64),
    }  # fmt: skip
    assert arrays["flow_known"].any() and not np.load(folder / "truth" / "000000.npz")["flow_known"].any()
    assert fly(["--duration", "0", "--truth", str(folder)]) == 1 == fly(["--duration", "0", "--truth", str(scene)])


def test_messages_of_one_stamp_become_one_picture_of_the_dataset(tmp_path):
    pytest.importorskip("rospy", reason="needs ROS")
    from drone_sim.ros.tools import record_truth

    groups = record_truth._StampGroups()
    names = ["color", "boxes", *record_truth._IMAGES]
    for name in names:
        groups.add(name, 1.0500001, f"{name} 1")  # a stamp in JSON is rounded
        groups.add(name, 1.1, f"{name} 2") if name != "flow" else None
    assert groups.complete.get_nowait() == (1.05, {name: f"{name} 1" for name in names}) and groups.complete.empty()
    for number in range(3):
        for name in names:
            groups.add(name, 2.0 + number, name)
    assert groups.lost == 1, "at most two groups wait at a time"
    for number in range(record_truth._MAX_INCOMPLETE):
        groups.add("color", 10.0 + number, "alone")
    assert groups.lost == 2, "the oldest group, whose flow is missing, is dropped"


def test_ground_truth_is_not_rendered_without_a_request(simulation, monkeypatch):
    camera = simulation.drone.cameras["front"]
    picture = camera.take()
    renderings = []
    renderer = simulation.vision._renderer
    monkeypatch.setattr(renderer, "render_outputs", lambda *_, **__: renderings.append(1))
    simulation.step()
    camera.look()
    assert renderings == []
    assert picture.shape == (480, 640, 3)


def test_outputs_requested_for_one_picture_are_rendered_with_the_next(simulation, monkeypatch):
    camera = simulation.drone.cameras["front"]
    camera.take()
    camera.truth().want(("depth", "instance"))
    simulation.step()
    picture_count = simulation.vision.pictures
    picture = camera.look()
    assert simulation.vision.pictures == picture_count + 1
    renderer, renderings = simulation.vision._renderer, []
    with monkeypatch.context() as patched:
        patched.setattr(renderer, "render_outputs", lambda *_, **__: renderings.append(1))
        cached_truth = camera.truth()
        depth, mask = cached_truth.output("depth"), cached_truth.output("instance")
    assert renderings == []
    np.testing.assert_array_equal(picture, camera.take())
    fresh = camera.truth()
    np.testing.assert_array_equal(depth, fresh.output("depth"))
    np.testing.assert_array_equal(mask, fresh.output("instance"))
