"""Pixel counts of the objects of a scene, each rendered alone, without occlusion by others."""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np


def covered(gl: moderngl.Context, numbers: np.ndarray, draw: Callable[[int], None]) -> np.ndarray:
    """Return how many pixels each of the objects `numbers` covers when alone, indexed by number, (largest + 1,).

    `draw` draws only the object with that number, without clearing, and gives all its fragments the same depth.
    The depth test `<` then passes one fragment per pixel, even where parts of the object overlap.
    """
    counts = np.zeros(int(numbers.max(initial=0)) + 1, dtype=np.int64)
    query = gl.query(samples=True)
    gl.depth_func = "<"
    for number in numbers:
        gl.fbo.clear()
        with query:
            draw(int(number))
        counts[number] = query.samples
    gl.depth_func = "<="
    return counts


def pixels(
    instances: np.ndarray, poses: np.ndarray, mask: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return the same as `covered` for a distorted lens, by rendering one image per object; slower.

    instances, poses: each visual's object number, (N,), and pose, (N, 4, 4). `mask` renders the output "instance" for
    other numbers and poses.
    """
    counts = np.zeros(int(instances.max(initial=0)) + 1, dtype=np.int64)
    hidden_pose = np.eye(4)
    hidden_pose[2, 3] = -1e9  # m, far below everything that a camera sees
    for number in np.unique(instances):
        is_part = instances == number
        covered_pixels = mask(is_part.astype(np.uint16), np.where(is_part[:, None, None], poses, hidden_pose))
        counts[number] = covered_pixels.sum(dtype=np.int64)
    return counts
