"""The ground truth of a camera's picture: the object of each pixel, boxes around objects, and the optical flow.

All is of the moment of the picture, and costs nothing as long as nobody asks for it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from drone_sim.mechanics.frames import to_quaternion
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.outputs import COLOR
from drone_sim.render.renderer import Moment
from drone_sim.shapes.shape import DrawnShape
from drone_sim.shapes.visual import Visual

VEHICLE = "vehicle"  # the category of vehicles
_COPY = re.compile(r"[\d#_\[\]. -]+$")  # what names end with that are alike but for a number
_FARTHER = 1.02  # times the depth of before, and the point was behind something then
_NEAREST = 1e-3  # m, ahead of the camera


class Identity(NamedTuple):
    """The object that a visual belongs to: its name in the scene, and its category."""

    name: str
    category: str


class Box2D(NamedTuple):
    """A box in the picture, px: its left upper and right lower corner, which are the borders of pixels."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def area(self) -> float:
        """In px²."""
        return max(0.0, self.right - self.left) * max(0.0, self.bottom - self.top)


class Seen(NamedTuple):
    """An object that the picture shows.

    visible: around its pixels. full: around all of it, as if nothing hid it and the picture were larger, and around
    `visible`, which can be larger by part of a pixel. For a pinhole, the object ends at the near plane. Through a
    plumb_bob or rational_polynomial lens, an object that reaches behind the camera has no other `full` than `visible`.
    occlusion: the share of what the picture would show of it alone that something hides; truncation: the share of
    `full` that is outside the picture, both 0 to 1. pose: the optical frame from the middle of its box (4, 4); size: of
    that box, m.
    """

    number: int
    identity: Identity
    pixels: int
    visible: Box2D
    full: Box2D
    occlusion: float
    truncation: float
    pose: np.ndarray
    size: np.ndarray


@dataclass
class Numbered:
    """The objects of a scene by their numbers in masks: from 1; 0 is nobody."""

    instances: np.ndarray  # of the visuals, (N,)
    identities: list[Identity] = field(default_factory=list)  # of the numbers from 1
    categories: list[str] = field(default_factory=list)  # of their numbers from 1

    @classmethod
    def of(cls, visuals: Sequence[Identity]) -> Numbered:
        """Number the objects of the visuals, in the order in which they first appear."""
        identities = list(dict.fromkeys(visuals))
        numbers = {one: number for number, one in enumerate(identities, 1)}
        instances = np.array([numbers[one] for one in visuals], dtype=np.uint16)
        return cls(instances, identities, sorted({one.category for one in identities}))

    def category_mask(self, instances: np.ndarray) -> np.ndarray:
        """Return the numbers of categories, from those of instances."""
        table = [0, *(self.categories.index(one.category) + 1 for one in self.identities)]
        return np.array(table, dtype=np.uint16)[instances]


def category_of(name: str) -> str:
    """Return the category of an object whose entry names none: its name without the number at its end."""
    return _COPY.sub("", name) or name


class PictureTruth:
    """The ground truth of one picture; each part is made when it is first asked for."""

    def __init__(
        self,
        draw: Callable[[Sequence[str]], Mapping[str, np.ndarray]],
        alone: Callable[[], np.ndarray],
        intrinsics: Intrinsics,
        moment: Moment,
        visuals: Sequence[Visual],
        numbered: Numbered,
    ):
        """`draw` returns outputs of the renderer; `alone` how many pixels each object has alone, by its number."""
        self._draw, self._alone = draw, alone
        self.intrinsics, self.moment = intrinsics, moment
        self._visuals, self.numbered = visuals, numbered
        self._drawn: dict[str, np.ndarray] = {}

    def want(self, names: Sequence[str]) -> None:
        """Draw these outputs, in one pass, as far as they are not drawn."""
        missing = [one for one in names if one not in self._drawn]
        if missing:
            self._drawn.update(self._draw(missing))

    @property
    def drawn(self) -> tuple[str, ...]:
        """The outputs that have been asked for, the picture aside."""
        return tuple(name for name in self._drawn if name != COLOR)

    def output(self, name: str) -> np.ndarray:
        """Return one of `render.outputs.OUTPUTS`, or the picture."""
        self.want([name])
        return self._drawn[name]

    @property
    def categories(self) -> np.ndarray:
        """The numbers of categories, (height, width) uint16."""
        return self.numbered.category_mask(self.output("instance"))

    @property
    def points(self) -> np.ndarray:
        """Where what is seen is, in the optical frame, m, (height, width, 3) float32; NaN where nothing is."""
        rays = self.intrinsics.rays
        along = rays if self.intrinsics.is_fisheye else rays / rays[..., 2:]
        return np.asarray(along * self.output("depth")[..., None], dtype=np.float32)

    def flow(self, depth_before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the optical flow since the picture before, and where it is known.

        (height, width, 2) float32, px to the right and down; and (height, width) bool: not of what was outside that
        picture, or hidden in it, as its depths `depth_before` tell.
        """
        self.want(["depth", "before"])
        before = self.output("before")
        then = self.intrinsics.project(before)
        known = np.isfinite(then).all(axis=-1)
        column, row = (np.rint(np.nan_to_num(one)).astype(np.intp) for one in (then[..., 0], then[..., 1]))
        height, width = depth_before.shape
        known &= (column >= 0) & (row >= 0) & (column < width) & (row < height)
        shown = np.where(known, depth_before[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)], np.nan)
        away = np.linalg.norm(before, axis=-1) if self.intrinsics.is_fisheye else before[..., 2]
        known &= away < _FARTHER * shown + _NEAREST
        flow = np.where(known[..., None], self.intrinsics.pixels - then, 0.0)
        return flow.astype(np.float32), known

    def seen(self) -> list[Seen]:
        """Return the objects of which a pixel is seen, floor and all, by their numbers."""
        mask = self.output("instance")
        counts, alone = np.bincount(mask.ravel(), minlength=len(self.numbered.identities) + 1), self._alone()
        found = []
        for number in np.flatnonzero(counts[1:]) + 1:
            rows, columns = np.any(mask == number, axis=1), np.any(mask == number, axis=0)
            (top, bottom), (left, right) = (np.flatnonzero(one)[[0, -1]] for one in (rows, columns))
            visible = Box2D(left - 0.5, top - 0.5, right + 0.5, bottom + 0.5)
            pose, size, corners = self._solid(number)
            full = self._around(number, corners, visible)
            inside = Box2D(
                max(full.left, -0.5), max(full.top, -0.5),
                min(full.right, self.intrinsics.width - 0.5), min(full.bottom, self.intrinsics.height - 0.5),
            )  # fmt: skip
            count, whole = int(counts[number]), max(int(alone[number]), int(counts[number]))
            shares = 1 - count / whole, 1 - inside.area / full.area if full.area > 0 else 0.0
            identity = self.numbered.identities[number - 1]
            found.append(Seen(int(number), identity, count, visible, full, *shares, pose, size))
        return found

    def _solid(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the pose of an object's box and its size, and its corners, (n, 3), all in the optical frame.

        The box stands as the object's first visual does.
        """
        corners = self._optical(number, _outline)
        optical = np.linalg.inv(self.moment.camera_pose)
        frame = optical @ self.moment.poses[np.flatnonzero(self.numbered.instances == number)[0]]
        frame[:3, :3] /= np.linalg.norm(frame[:3, :3], axis=0)
        own = (corners - frame[:3, 3]) @ frame[:3, :3]
        low, high = own.min(axis=0), own.max(axis=0)
        frame[:3, 3] += frame[:3, :3] @ ((low + high) / 2)
        return frame, high - low, corners

    def _optical(self, number: int, points: Callable[[DrawnShape], np.ndarray]) -> np.ndarray:
        """Return an object's points in the optical frame, (n, 3), from those of each of its shapes."""
        optical = np.linalg.inv(self.moment.camera_pose)
        found = []
        for one in np.flatnonzero(self.numbered.instances == number):
            pose = optical @ self.moment.poses[one]
            found.append(points(self._visuals[one].shape) @ pose[:3, :3].T + pose[:3, 3])
        return np.concatenate(found)

    def _around(self, number: int, corners: np.ndarray, visible: Box2D) -> Box2D:
        """Return the box in the picture around an object's corners and around `visible`, as `Seen.full`."""
        lens = self.intrinsics
        if not isinstance(lens, Distorted) and (corners[:, 2] < lens.near).any():
            corners = _cut(self._optical(number, _triangle_corners).reshape(-1, 3, 3), lens.near)
        pixels = lens.project(corners)
        if not np.isfinite(pixels).all():
            return visible
        pixels = np.concatenate([pixels, [visible[:2], visible[2:]]])
        return Box2D(*map(float, (*pixels.min(axis=0), *pixels.max(axis=0))))


def described(objects: Sequence[Seen]) -> list[dict[str, Any]]:
    """Return objects as JSON has them: px, m, and the pose of each box in the optical frame, quaternions xyzw."""
    return [
        {
            "number": one.number, **one.identity._asdict(), "pixels": one.pixels,
            "visible": [round(float(value), 2) for value in one.visible],
            "full": [round(float(value), 2) for value in one.full],
            "occlusion": round(one.occlusion, 4), "truncation": round(one.truncation, 4),
            "position": one.pose[:3, 3].round(5).tolist(),
            "orientation": [round(value, 6) for value in quaternion_of(one)],
            "size": one.size.round(5).tolist(),
        }
        for one in objects
    ]  # fmt: skip


def quaternion_of(one: Seen) -> tuple[float, ...]:
    """Return how an object's box is turned in the optical frame, xyzw."""
    return tuple(map(float, to_quaternion(tuple(one.pose[:3].ravel()))))


@lru_cache(maxsize=1024)
def _outline(shape: DrawnShape) -> np.ndarray:
    """Return the corners of a shape's triangles, each once, (n, 3), m."""
    return np.asarray(np.unique(_triangle_corners(shape), axis=0))


@lru_cache(maxsize=64)
def _triangle_corners(shape: DrawnShape) -> np.ndarray:
    """Return the corners of a shape's triangles, three in a row for each, (n, 3), m."""
    return np.concatenate([part.corners.reshape(-1, 3) for part in shape.triangles()])


def _cut(triangles: np.ndarray, near: float) -> np.ndarray:
    """Return the corners, (n, 3), of the parts of triangles (m, 3, 3) whose z is at least `near`."""
    starts, ends = triangles.reshape(-1, 3), np.roll(triangles, -1, axis=1).reshape(-1, 3)
    crossing = (starts[:, 2] < near) != (ends[:, 2] < near)
    starts_crossing, along = starts[crossing], (ends - starts)[crossing]
    cuts = starts_crossing + along * ((near - starts_crossing[:, 2:]) / along[:, 2:])
    return np.concatenate([starts[starts[:, 2] >= near], cuts])
