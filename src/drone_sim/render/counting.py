"""How many pixels the objects of a scene would have, each of them alone."""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np


def covered(gl: moderngl.Context, numbers: np.ndarray, draw: Callable[[int], None]) -> np.ndarray:
    """Return how many pixels each of `numbers` covers alone, indexed by number, (largest + 1,).

    `draw` draws that object and nothing else, without clearing, and with the same depth for all of its fragments.
    The depth test `<` then passes one fragment of each pixel, however many parts of the object lie there.
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
    """Return the same through a lens, from a picture of each object alone; slower.

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
