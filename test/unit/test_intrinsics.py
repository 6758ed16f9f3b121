"""The camera model: K, P and the OpenGL matrix all send a point to the same pixel."""

from dataclasses import replace

import numpy as np
import pytest
from drawing import pixel

from drone_sim.render.intrinsics import Intrinsics

CAMERA = Intrinsics(640, 480, np.radians(60.0), 0.02, 100.0)
POINTS = [(0.0, 0.0, 1.0), (0.3, -0.2, 1.5), (-2.0, 1.0, 7.0), (0.01, 0.02, 0.05), (30.0, -20.0, 90.0)]


def window(camera, point):
    """Pixel and depth (-1..1) to which OpenGL sends a point of the optical frame, rows counted as it reads them."""
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
def test_matrices_agree_on_the_pixel(point):
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


def test_the_right_camera_of_a_pair_says_how_far_apart_they_are():
    pytest.importorskip("rospy", reason="needs ROS")
    from drone_sim.ros.core.message_conversion import camera_info

    left, right = (camera_info(replace(CAMERA, baseline=way), "left_optical") for way in (0.0, 0.12))
    assert left.P[3] == 0 and right.P[3] == pytest.approx(-CAMERA.fx * 0.12)
    assert (*left.P[:3], *left.P[4:]) == (*right.P[:3], *right.P[4:])
