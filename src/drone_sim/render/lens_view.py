"""What a lens sees, gathered from pictures of pinholes: one, or some faces of a cube around the camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.outputs import COLOR
from drone_sim.render.target import Box, array

_ONE = math.cos(math.radians(65.0))  # of the angle from the axis as far as which one pinhole sees well
_MARGIN = 2  # pixels around a picture, from which its border is interpolated
_ALIKE = 0.03  # of a depth: what differs by more is another thing
_FACES = np.array(  # the axes of optical frames in the camera's, by columns: ahead, right, left, down, up
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    ],
    dtype=np.float64,
)


class PinholeView(NamedTuple):
    """A picture to be taken, and the axes of its optical frame in the camera's, (4, 4)."""

    intrinsics: Intrinsics
    turn: np.ndarray
    box: Box  # the part of it that is used


Draw = Callable[[PinholeView, tuple[str, ...]], dict[str, np.ndarray]]


class LensView:
    """Which pinholes' pictures a lens needs, and which of their pixels become its own.

    What is used of these pictures lies one below the other in one picture, a *stack*.
    """

    def __init__(self, lens: Distorted):
        """Divide what `lens` sees."""
        self._sees = np.isfinite(lens.rays[..., 0])
        rays = np.where(self._sees[..., None], lens.rays, (0.0, 0.0, 1.0))
        faces = _FACES[:1] if rays[..., 2].min() > _ONE else _FACES
        face = np.argmax(rays @ faces[:, :, 2].T, axis=-1)
        used = np.flatnonzero(np.bincount(face.ravel()))
        self._turns = faces[face]
        inside = np.einsum("...ij,...i->...j", self._turns, rays)
        across, down = inside[..., 0] / inside[..., 2], inside[..., 1] / inside[..., 2]
        wide, high = (2 * math.ceil(lens.fx * np.abs(one).max()) + 2 * _MARGIN + 1 for one in (across, down))
        self._pinhole = Intrinsics(wide, high, 2 * math.atan(wide / 2 / lens.fx), lens.near, lens.far)
        number = np.searchsorted(used, face)
        columns, rows = lens.fx * across + self._pinhole.cx, lens.fx * down + self._pinhole.cy
        boxes = [_around(columns[number == one], rows[number == one]) for one in range(len(used))]
        self.views = [PinholeView(self._pinhole, _homogeneous(faces[one]), box) for one, box in zip(used, boxes)]
        self._starts = np.cumsum([0, *(box.height for box in boxes)])
        lefts, tops = (np.array([one[axis] for one in boxes]) for axis in (0, 1))
        columns, rows = columns - lefts[number], rows + (self._starts[:-1] - tops)[number]  # in the stack
        self._exact = columns.astype(np.float32), rows.astype(np.float32)
        whole, parts = cv2.convertMaps(*self._exact, cv2.CV_16SC2)  # sooner done
        self._smooth = whole, parts
        self._place = np.rint(rows).astype(np.intp), np.rint(columns).astype(np.intp)
        # A face's depth is along its own axis. With a fisheye lens depths are counted along the ray.
        self._deeper = (1.0 if lens.is_fisheye else rays[..., 2]) / inside[..., 2]
        nearest = np.stack([(np.rint(columns) - columns) / lens.fx, (np.rint(rows) - rows) / lens.fx], axis=-1)
        self._ray = rays / inside[..., 2:]  # where face depth is 1: of the pixel, and of its nearest one
        self._nearest_ray = self._ray + np.einsum("...ij,...j->...i", self._turns[..., :2], nearest)

    def seen(
        self, names: Sequence[str], draw: Draw, turn: np.ndarray | None, into: np.ndarray | None
    ) -> dict[str, np.ndarray]:
        """Return the picture and outputs of the renderer as the lens sees them, by name.

        `draw` draws some of the box of a pinhole. `turn` is as for `gather`; the picture, black where the lens sees
        nothing, is written into `into`, if it is there.
        """
        drawn = tuple(names) if "before" not in names or "depth" in names else (*names, "depth")
        parts = [draw(one, drawn) for one in self.views]
        stacks = {name: self._stacked([part[name] for part in parts]) for name in drawn}
        color = stacks.pop(COLOR, None)
        found = self.gather(stacks, turn)
        if color is not None:
            found[COLOR] = self._colors(color, into)
        return {name: found[name] for name in names}

    def _stacked(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        if len(parts) == 1:
            return parts[0]
        wide = max(part.shape[1] for part in parts)
        stack = np.ones((self._starts[-1], wide, *parts[0].shape[2:]), parts[0].dtype)
        for start, part in zip(self._starts, parts):
            stack[start : start + len(part), : part.shape[1]] = part
        return stack

    def _colors(self, stack: np.ndarray, into: np.ndarray | None) -> np.ndarray:
        picture = array(into, (*self._sees.shape, 3), np.uint8)
        cv2.remap(stack, self._smooth[0], self._smooth[1], cv2.INTER_LINEAR, dst=picture)
        if not self._sees.all():
            picture[~self._sees] = 0
        return picture

    def gather(self, drawn: dict[str, np.ndarray], turn: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return outputs of the renderer as the lens sees them, from stacks of its pinholes' pictures.

        With "before" there must be "depth", too, and how the camera has turned since: the optical frame of then from
        that of now, (3, 3).
        """
        gathered = {name: stack[self._place] for name, stack in drawn.items()}
        if "depth" in drawn:
            nearest = gathered["depth"]
            depth = self._between(drawn["depth"], nearest)
            gathered["depth"] = (depth * self._deeper).astype(np.float32)
        if "before" in drawn and turn is not None:  # what is beside the nearest pixel has come the same way
            beside = self._ray * depth[..., None] - self._nearest_ray * nearest[..., None]
            gathered["before"] = (gathered["before"] + beside @ turn.T).astype(np.float32)
        if "normal" in drawn:
            gathered["normal"] = np.einsum("...ij,...j->...i", self._turns, gathered["normal"]).astype(np.float32)
        for name, picture in gathered.items():
            picture[~self._sees] = np.nan if name in ("depth", "before") else 0
        return gathered

    def _between(self, stack: np.ndarray, nearest: np.ndarray) -> np.ndarray:
        """Return the faces' depths at the pixels: between those of one thing the inverse is even on a plane."""
        smooth = 1.0 / cv2.remap(1.0 / stack, self._exact[0], self._exact[1], cv2.INTER_LINEAR)
        return np.where(np.abs(smooth - nearest) < _ALIKE * nearest, smooth, nearest)


def _around(columns: np.ndarray, rows: np.ndarray) -> Box:
    """Return the box around places in a picture, with what is interpolated there."""
    (left, right), (top, bottom) = ((int(one.min()) - _MARGIN, int(one.max()) + _MARGIN) for one in (columns, rows))
    left, top = max(left, 0), max(top, 0)
    return Box(left, top, right + 1 - left, bottom + 1 - top)


def _homogeneous(turn: np.ndarray) -> np.ndarray:
    whole = np.eye(4)
    whole[:3, :3] = turn
    return whole
