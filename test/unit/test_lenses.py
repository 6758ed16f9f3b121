"""Lens models, compared with OpenCV's projections and with OpenCV's calibration from rendered pictures."""

import dataclasses
from dataclasses import replace

import cv2
import numpy as np
import pybullet
import pytest
from drawing import AHEAD, at, box, looking, pixel
from test_renderer_outputs import cast, inner, random_scene

from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.renderer import Renderer
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError

pytestmark = pytest.mark.long

BLACK, WHITE = (0.05, 0.05, 0.05, 1.0), (0.95, 0.95, 0.95, 1.0)
COLUMNS, ROWS, SQUARE = 9, 6, 0.08  # inner corners of the board, and m
WIDE = Distorted(640, 480, 1.1, 0.02, 50.0, "plumb_bob", (-0.25, 0.08, 0.001, -0.0007, 0.0))
RATIONAL = Distorted(
    640, 480, 1.1, 0.02, 50.0, "rational_polynomial", (0.3, 0.05, 0.0005, -0.0005, 0.01, 0.5, 0.1, 0.01)
)
FISHEYE = Distorted(640, 480, 2.6, 0.02, 50.0, "equidistant", (0.03, -0.008, 0.002, -0.0004))
LENSES = pytest.mark.parametrize("lens", [WIDE, RATIONAL, FISHEYE], ids=lambda lens: lens.model)


@pytest.fixture(name="smooth", scope="module")
def _smooth():
    renderer = Renderer(samples=4)
    yield renderer
    renderer.close()


def camera_matrix(lens):
    return np.reshape(lens.K, (3, 3))


def project_with_opencv(lens, points, matrix=None, coefficients=None):
    """Return the pixels onto which OpenCV projects points of the optical frame."""
    matrix = camera_matrix(lens) if matrix is None else matrix
    coefficients = np.array(lens.D if coefficients is None else coefficients).ravel()
    project = cv2.fisheye.projectPoints if lens.is_fisheye else cv2.projectPoints
    given = points[:, None] if lens.is_fisheye else points
    return project(given, np.zeros(3), np.zeros(3), matrix, coefficients)[0].reshape(-1, 2)


@LENSES
def test_projected_pixels_equal_those_of_opencv_and_rays_invert_the_projection(lens):
    points = np.random.RandomState(1).uniform((-1, -1, 1.5), (1, 1, 3), (200, 3))
    np.testing.assert_allclose(lens.project(points), project_with_opencv(lens, points), atol=1e-9)
    has_ray = np.isfinite(lens.rays[..., 0])
    np.testing.assert_allclose(lens.project(2 * lens.rays[has_ray]), lens.pixels[has_ray], atol=1e-5)


def test_a_fisheye_has_rays_behind_the_camera_and_none_beyond_its_limit():
    lens = Distorted(640, 480, np.radians(220), 0.02, 50.0, "equidistant")
    np.testing.assert_allclose(lens.rays[240, 0], (-np.cos(0.34), 0, -np.sin(0.34)), atol=0.01)
    assert np.isnan(lens.rays[0, 0]).all()
    np.testing.assert_allclose(lens.project(np.array([1.0, 0.0, -0.1]))[0], 319.5 + lens.fx * 1.6704649, atol=1e-4)


@pytest.mark.parametrize("width", [64, 4096])
def test_the_widest_fisheye_spans_the_documented_angle(width):
    front = {"width": width, "height": 2, "horizontal_fov": 3.84, "lens": {"model": "equidistant"}}
    lens = parameters.load({"cameras": {"front": front}}).cameras["front"].intrinsics()
    angle = 1.92 * (1 - 1 / width)  # from the axis to the middle of the last pixel
    assert np.arccos(lens.rays[0, -1, 2]) == pytest.approx(np.hypot(angle, 0.5 / lens.fx), abs=1e-9)
    with pytest.raises(ParameterError, match=r"horizontal_fov.*3\.84"):
        parameters.load({"cameras": {"front": {**front, "horizontal_fov": 3.85}}})


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("plumb_bob", (-0.8,)), r"\[-0.8, 0.0, 0.0, 0.0, 0.0\]: .*plumb_bob.* folds"),
        (("equidistant", (0.1,) * 5), "5 coefficients"),
        (("barrel", ()), "model 'barrel'"),
    ],
)
def test_invalid_lens_parameters_are_refused(given, said):
    with pytest.raises(ValueError, match=said):
        Distorted(64, 48, 1.8, 0.02, 50.0, *given)


def board():
    """Return the visuals of a chessboard and their poses in its frame: origin at a corner, z along the normal."""
    wide, high = (COLUMNS + 1) * SQUARE, (ROWS + 1) * SQUARE
    middle = np.array((wide / 2 - SQUARE, high / 2 - SQUARE))
    visuals, poses = [box("paper", (wide + SQUARE, high + SQUARE, 0.01), WHITE)], [at(*middle, -0.005)]
    for column in range(COLUMNS + 1):
        for row in range(ROWS + 1):
            if (column + row) % 2 == 0:
                visuals.append(box((column, row), (SQUARE, SQUARE, 0.0002), BLACK))
                poses.append(at((column - 0.5) * SQUARE, (row - 0.5) * SQUARE, 0.0))
    return visuals, np.array(poses)


def board_poses(lens):
    """Return poses of the board in the camera's optical frame, spread over the field of view."""
    far = 0.62 if lens.is_fisheye else 1.35
    grid = [(u, v) for v in (0.3, 0.5, 0.7) for u in (0.25, 0.42, 0.58, 0.75)]
    random = np.random.RandomState(3)
    for u, v in grid:
        ray = lens.rays[int(v * lens.height), int(u * lens.width)]
        turn = cv2.Rodrigues(random.uniform(-0.35, 0.35, 3))[0]
        pose = np.eye(4)
        axis = np.cross((0, 0, 1.0), ray)
        angle = np.arctan2(np.linalg.norm(axis), ray[2])
        towards = cv2.Rodrigues(axis / max(np.linalg.norm(axis), 1e-9) * angle)[0]
        pose[:3, :3] = towards @ turn @ np.diag((1.0, -1.0, -1.0))
        pose[:3, 3] = ray * far - pose[:3, :3] @ ((COLUMNS - 1) * SQUARE / 2, (ROWS - 1) * SQUARE / 2, 0)
        yield pose


def corners(renderer, lens):
    """Return the corners on the board (m) and the pixels at which OpenCV finds them in rendered pictures."""
    visuals, local = board()
    renderer.set_visuals(visuals)
    flat = np.array([(SQUARE * n, SQUARE * m, 0) for m in range(ROWS) for n in range(COLUMNS)])
    grids = []
    for pose in board_poses(lens):
        picture = renderer.render(lens, AHEAD, AHEAD @ pose @ local)
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        is_detected, places = cv2.findChessboardCornersSB(grey, (COLUMNS, ROWS))
        if is_detected:
            grids.append(places.reshape(-1, 2))
    return flat.astype(np.float32), grids


@LENSES
def test_opencv_calibration_recovers_the_lens(smooth, lens):
    flat, grids = corners(smooth, lens)
    assert len(grids) >= 8
    size = lens.width, lens.height
    if lens.is_fisheye:
        flags = cv2.fisheye.CALIB_RECOMPUTE_EXTRINSIC | cv2.fisheye.CALIB_FIX_SKEW
        given = [flat[None].astype(np.float64)] * len(grids), [one[None].astype(np.float64) for one in grids]
        _, matrix, coefficients, *_ = cv2.fisheye.calibrate(*given, size, None, None, flags=flags)
    else:
        flags = cv2.CALIB_RATIONAL_MODEL if lens.model == "rational_polynomial" else 0
        _, matrix, coefficients, *_ = cv2.calibrateCamera([flat] * len(grids), grids, size, None, None, flags=flags)
    expected = camera_matrix(lens)
    np.testing.assert_allclose((matrix[0, 0], matrix[1, 1]), lens.fx, rtol=0.002)
    np.testing.assert_allclose(matrix[:2, 2], expected[:2, 2], atol=0.005 * lens.width)
    across = lens.rays[40:-40:40, 40:-40:40].reshape(-1, 3)
    errors = project_with_opencv(lens, across, matrix, coefficients) - lens.project(across)
    assert np.abs(errors).max() < 1.0


def test_straight_lines_are_straight_after_undistortion(smooth):
    smooth.set_visuals([box("wall", (0.1, 20.0, 20.0), WHITE), box("beam", (0.1, 20.0, 0.5), BLACK)])
    picture = smooth.render(WIDE, AHEAD, np.array([at(3, 0, 1), at(2.9, 0, 1.6)]))
    bent = edge(picture)
    straight = edge(cv2.undistort(picture, camera_matrix(WIDE), np.array(WIDE.D)))
    assert np.abs(bent).max() > 5
    assert np.abs(straight).max() < 0.2


def edge(picture):
    """Return for each column the distance of the dark area's upper edge from its fitted straight line, px."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(float)
    columns = np.arange(60, picture.shape[1] - 60)
    rows = []
    for column in columns:
        one = grey[:, column]
        middle = (one.max() + one.min()) / 2
        row = np.flatnonzero((one[:-1] > middle) & (one[1:] <= middle))[0]
        rows.append(row + (one[row] - middle) / (one[row] - one[row + 1]))
    return np.array(rows) - np.polyval(np.polyfit(columns, rows, 1), columns)


@LENSES
def test_masks_and_depths_through_a_lens_equal_ray_casts(renderer, lens):
    lens = dataclasses.replace(lens, width=320, height=240)
    visuals, poses, client = random_scene(np.random.RandomState(4))
    eye = looking((0, 0, 1), (4, 0.2, 1.1))
    bodies, points, _ = cast(client, lens, eye)
    pybullet.disconnect(client)
    renderer.set_visuals(visuals)
    numbers = np.arange(1, len(visuals) + 1)
    drawn = renderer.render_outputs(("depth", "instance"), lens, eye, poses, instances=numbers)
    interior = inner(bodies) & inner(drawn["instance"]) & np.isfinite(lens.rays[..., 0])
    assert (drawn["instance"][interior] != bodies[interior]).mean() < 1e-3
    compared = interior & (bodies > 0) & (drawn["instance"] == bodies)
    offsets = points - eye[:3, 3]
    depth = np.linalg.norm(offsets, axis=-1) if lens.is_fisheye else offsets @ eye[:3, 2]
    assert compared.sum() > 4_000
    assert np.percentile(np.abs(drawn["depth"] - depth)[compared], 99) < 0.01


# ---- pinhole cameras: K, P and OpenGL's matrix


CAMERA = Intrinsics(640, 480, np.radians(60.0), 0.02, 100.0)
POINTS = [(0.0, 0.0, 1.0), (0.3, -0.2, 1.5), (-2.0, 1.0, 7.0), (0.01, 0.02, 0.05), (30.0, -20.0, 90.0)]


def window(camera, point):
    """Return the pixel (rows in OpenGL's read order) and depth (-1..1) of a point in the optical frame."""
    clip = camera.projection() @ np.append(point, 1.0)
    x, y, depth = clip[:3] / clip[3]
    return (x + 1.0) * camera.width / 2.0 - 0.5, (y + 1.0) * camera.height / 2.0 - 0.5, depth


def test_the_field_of_view_spans_the_picture():
    edge = np.tan(np.radians(30.0))
    assert pixel(CAMERA, (edge, 0.0, 1.0))[0] == pytest.approx(639.5, abs=1e-9)
    assert pixel(CAMERA, (-edge, 0.0, 1.0))[0] == pytest.approx(-0.5, abs=1e-9)
    assert CAMERA.fx == CAMERA.fy == pytest.approx(554.2562584220408, abs=1e-9)
    assert pixel(CAMERA, (0.0, 0.0, 3.0)) == ((640 - 1) / 2, (480 - 1) / 2)


@pytest.mark.parametrize("point", POINTS)
def test_k_p_and_the_projection_matrix_give_the_same_pixel(point):
    u, v = pixel(CAMERA, point)
    by_k = np.reshape(CAMERA.K, (3, 3)) @ point
    by_p = np.reshape(CAMERA.P, (3, 4)) @ np.append(point, 1.0)
    np.testing.assert_allclose(by_k[:2] / by_k[2], (u, v), rtol=0, atol=1e-9)
    np.testing.assert_allclose(by_p[:2] / by_p[2], (u, v), rtol=0, atol=1e-9)
    np.testing.assert_allclose(window(CAMERA, point)[:2], (u, v), rtol=0, atol=1e-9)


def test_right_and_down_in_the_optical_frame_are_right_and_down_in_the_picture():
    u, v = pixel(CAMERA, (0.1, 0.2, 1.0))
    assert u > CAMERA.cx and v > CAMERA.cy


def test_near_and_far_bound_the_depth():
    assert window(CAMERA, (0.0, 0.0, CAMERA.near))[2] == pytest.approx(-1.0)
    assert window(CAMERA, (0.0, 0.0, CAMERA.far))[2] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"width": 0},
        {"height": -1},
        {"horizontal_fov": 0.0},
        {"horizontal_fov": np.pi},
        {"near": 0.0},
        {"far": 0.01},
        {"far": np.inf},
        {"near": np.nan},
    ],
)
def test_impossible_cameras_are_refused(wrong):
    values = {"width": 640, "height": 480, "horizontal_fov": 1.0, "near": 0.02, "far": 100.0}
    with pytest.raises(ValueError):
        Intrinsics(**{**values, **wrong})


def test_p_of_the_right_stereo_camera_contains_the_baseline():
    pytest.importorskip("rospy", reason="needs ROS")
    from drone_sim.ros.core.message_conversion import camera_info

    left, right = (camera_info(replace(CAMERA, baseline=distance), "left_optical") for distance in (0.0, 0.12))
    assert left.P[3] == 0 and right.P[3] == pytest.approx(-CAMERA.fx * 0.12)
    assert (*left.P[:3], *left.P[4:]) == (*right.P[:3], *right.P[4:])
