"""Visuals and camera poses for tests of the renderer, and functions that find objects in its pictures."""

import numpy as np

from drone_sim.render.intrinsics import Intrinsics
from drone_sim.shapes.box import Box
from drone_sim.shapes.plane import Plane
from drone_sim.shapes.visual import Visual

CAMERA = Intrinsics(320, 240, np.radians(60.0), 0.02, 100.0)
RED, BLUE, GREY = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0), (0.6, 0.6, 0.6, 1.0)
FLOOR = Visual("floor", Plane(), GREY, floor=True)


def at(x, y, z):
    """Return the pose of an upright frame at a position in the world, as a 4 x 4 matrix."""
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def looking(eye, target):
    """Return the world-from-optical matrix of an upright camera at `eye` that looks at `target`."""
    forward = np.subtract(target, eye).astype(float)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    pose = at(*eye)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    return pose


AHEAD = looking((0, 0, 1), (1, 0, 1))


def box(key, size, rgba=RED, **kwargs):
    return Visual(key, Box(size), rgba, **kwargs)


def draw(renderer, visuals, poses, camera_pose=AHEAD, intrinsics=CAMERA):
    renderer.set_visuals(visuals)
    return renderer.render(intrinsics, camera_pose, np.array(poses).reshape(-1, 4, 4))


def pixel(camera, point):
    """Return the pixel (u, v) of a point in front of the camera, in its optical frame (m)."""
    x, y, z = point
    return camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy


def seen(renderer, visuals, poses, camera_pose=AHEAD, intrinsics=CAMERA):
    """Return the index of the nearest visual at each pixel, -1 for none; each visual is drawn alone."""
    depths = []
    for visual, pose in zip(visuals, poses):
        renderer.set_visuals([visual])
        depths.append(np.nan_to_num(renderer.render_depth(intrinsics, camera_pose, pose[None]), nan=np.inf))
    renderer.set_visuals(visuals)
    return np.where(np.isfinite(np.min(depths, axis=0)), np.argmin(depths, axis=0), -1)


def reddish(picture):
    """Return the mask of pixels where a picture shows RED."""
    return (picture[:, :, 0] > 100) & (picture[:, :, 1] < 40)
