"""How many pixels the objects of a scene would have, each of them alone."""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np


def fragments(gl: moderngl.Context, numbers: np.ndarray, draw: Callable[[int], None]) -> np.ndarray:
    """Return the nearest fragments of each of `numbers`, by number, (largest + 1,).

    `draw` draws that object, with a depth test, and nothing else; it clears nothing.
    """
    counts = np.zeros(int(numbers.max(initial=0)) + 1, dtype=np.int64)
    query = gl.query(samples=True)
    for number in numbers:
        gl.fbo.clear()
        draw(int(number))  # first, so that only what is nearest counts
        gl.depth_func = "=="
        with query:
            draw(int(number))
        gl.depth_func = "<="
        counts[number] = query.samples
    return counts


def pixels(
    instances: np.ndarray, poses: np.ndarray, mask: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return the same where a lens makes pixels of fragments; slower.

    instances, poses: the object's number of each visual, (N,), and its pose, (N, 4, 4). `mask` draws the picture of
    instances, given other numbers and poses.
    """
    counts = np.zeros(int(instances.max(initial=0)) + 1, dtype=np.int64)
    nowhere = np.eye(4)
    nowhere[2, 3] = -1e9  # m, where nobody sees it
    for number in np.unique(instances):
        own = instances == number
        there = mask(own.astype(np.uint16), np.where(own[:, None, None], poses, nowhere))
        counts[number] = there.sum(dtype=np.int64)
    return counts
