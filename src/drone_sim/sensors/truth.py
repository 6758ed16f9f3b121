"""Ground truth of a camera image: the object of each pixel, bounding boxes, and optical flow.

All parts belong to the moment of the image, and are computed only on request.
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
from drone_sim.render.renderer import FrameState
from drone_sim.shapes.shape import DrawnShape
from drone_sim.shapes.visual import Visual

VEHICLE = "vehicle"  # the category of vehicles
_COPY = re.compile(r"[\d#_\[\]. -]+$")  # the suffix of numbered copies
_HIDDEN = 1.02  # a point was hidden if its distance exceeded the depth by this factor ...
_HIDDEN_BY = 1e-3  # ... and this distance, m


class ObjectLabel(NamedTuple):
    """The object of a visual: its name in the scene, and its category."""

    name: str
    category: str


class Box2D(NamedTuple):
    """A box in the image, px, from the outer border of its first pixels to that of its last ones."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def area(self) -> float:
        return max(0.0, self.right - self.left) * max(0.0, self.bottom - self.top)


class Detection(NamedTuple):
    """An object visible in the image.

    visible: box around its pixels. full: box around the whole object, without occlusion and image borders, and around
    `visible`, which can be larger by a part of a pixel. For a pinhole, the object is cut at the near plane. With a
    plumb_bob or rational_polynomial lens, `full` is `visible` if the object extends behind the camera.
    occlusion: the hidden share of the pixels that it would have alone; truncation: the share of `full` outside the
    image; both 0 to 1. pose: transform optical-from-box, with the origin in the box's centre (4, 4); size: of that 3-D
    box, m.
    """

    number: int
    identity: ObjectLabel
    pixels: int
    visible: Box2D
    full: Box2D
    occlusion: float
    truncation: float
    pose: np.ndarray
    size: np.ndarray


@dataclass
class Numbered:
    """The numbers of a scene's objects in masks: 1, 2, ...; 0 is background."""

    instances: np.ndarray  # number of each visual, (N,)
    identities: list[ObjectLabel] = field(default_factory=list)  # of the objects 1, 2, ...
    categories: list[str] = field(default_factory=list)  # of the category numbers 1, 2, ...

    @classmethod
    def of(cls, visuals: Sequence[ObjectLabel]) -> Numbered:
        """Number the objects of the visuals in the order of their first appearance."""
        identities = list(dict.fromkeys(visuals))
        numbers = {identity: number for number, identity in enumerate(identities, 1)}
        instances = np.array([numbers[identity] for identity in visuals], dtype=np.uint16)
        return cls(instances, identities, sorted({identity.category for identity in identities}))

    def category_mask(self, instances: np.ndarray) -> np.ndarray:
        """Return the category numbers for a mask of instance numbers."""
        table = [0, *(self.categories.index(identity.category) + 1 for identity in self.identities)]
        return np.array(table, dtype=np.uint16)[instances]


def category_of(name: str) -> str:
    """Return the default category of an object: its name without the number at the end."""
    return _COPY.sub("", name) or name


class PictureTruth:
    """The ground truth of an image; each part is computed at its first use."""

    def __init__(
        self,
        draw: Callable[[Sequence[str]], Mapping[str, np.ndarray]],
        alone: Callable[[], np.ndarray],
        intrinsics: Intrinsics,
        moment: FrameState,
        visuals: Sequence[Visual],
        numbered: Numbered,
    ):
        """`draw` renders outputs; `alone` returns each object's number of pixels without occlusion, by its number."""
        self._draw, self._alone = draw, alone
        self.intrinsics, self.moment = intrinsics, moment
        self._visuals, self.numbered = visuals, numbered
        self._drawn: dict[str, np.ndarray] = {}

    def want(self, names: Sequence[str]) -> None:
        """Render those of the outputs `names` that are missing, in one pass."""
        missing = [name for name in names if name not in self._drawn]
        if missing:
            self._drawn.update(self._draw(missing))

    @property
    def drawn(self) -> tuple[str, ...]:
        """Names of the outputs rendered so far, without the colour image."""
        return tuple(name for name in self._drawn if name != COLOR)

    def output(self, name: str) -> np.ndarray:
        """Return one of `render.outputs.OUTPUTS`, or the colour image."""
        self.want([name])
        return self._drawn[name]

    @property
    def categories(self) -> np.ndarray:
        """Mask of category numbers, (height, width) uint16."""
        return self.numbered.category_mask(self.output("instance"))

    @property
    def points(self) -> np.ndarray:
        """The surface point of each pixel in the optical frame, m, (height, width, 3) float32; NaN for no surface."""
        rays = self.intrinsics.rays
        along = rays if self.intrinsics.is_fisheye else rays / rays[..., 2:]
        return np.asarray(along * self.output("depth")[..., None], dtype=np.float32)

    def flow(self, depth_before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the optical flow since the previous image, and the mask of pixels where it is known.

        The flow is (height, width, 2) float32, px to the right and down. The mask is (height, width) bool; a point is
        not known if it was outside the previous image, or hidden according to that image's depth `depth_before`.
        """
        self.want(["depth", "before"])
        before = self.output("before")
        source = self.intrinsics.project(before)
        known = np.isfinite(source).all(axis=-1)
        column, row = (np.rint(np.nan_to_num(axis)).astype(np.intp) for axis in (source[..., 0], source[..., 1]))
        height, width = depth_before.shape
        known &= (column >= 0) & (row >= 0) & (column < width) & (row < height)
        shown = np.where(known, depth_before[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)], np.nan)
        distance = np.linalg.norm(before, axis=-1) if self.intrinsics.is_fisheye else before[..., 2]
        known &= distance < _HIDDEN * shown + _HIDDEN_BY
        flow = np.where(known[..., None], self.intrinsics.pixels - source, 0.0)
        return flow.astype(np.float32), known

    def seen(self) -> list[Detection]:
        """Return all objects with a visible pixel, including the floor, in the order of their numbers."""
        mask = self.output("instance")
        counts, alone = np.bincount(mask.ravel(), minlength=len(self.numbered.identities) + 1), self._alone()
        objects = []
        for number in np.flatnonzero(counts[1:]) + 1:
            rows, columns = np.any(mask == number, axis=1), np.any(mask == number, axis=0)
            (top, bottom), (left, right) = (np.flatnonzero(has_pixel)[[0, -1]] for has_pixel in (rows, columns))
            visible = Box2D(left - 0.5, top - 0.5, right + 0.5, bottom + 0.5)
            pose, size, corners = self._box(number)
            full = self._full_box(number, corners, visible)
            inside = Box2D(
                max(full.left, -0.5), max(full.top, -0.5),
                min(full.right, self.intrinsics.width - 0.5), min(full.bottom, self.intrinsics.height - 0.5),
            )  # fmt: skip
            count, unoccluded = int(counts[number]), max(int(alone[number]), int(counts[number]))
            shares = 1 - count / unoccluded, 1 - inside.area / full.area if full.area > 0 else 0.0
            identity = self.numbered.identities[number - 1]
            objects.append(Detection(int(number), identity, count, visible, full, *shares, pose, size))
        return objects

    def _box(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return pose (4, 4), size and vertices (n, 3) of an object, all in the optical frame.

        Its box has the axes of the object's first visual.
        """
        corners = self._optical(number, _vertices)
        optical = np.linalg.inv(self.moment.camera_pose)
        frame = optical @ self.moment.poses[np.flatnonzero(self.numbered.instances == number)[0]]
        frame[:3, :3] /= np.linalg.norm(frame[:3, :3], axis=0)
        in_box_axes = (corners - frame[:3, 3]) @ frame[:3, :3]
        low, high = in_box_axes.min(axis=0), in_box_axes.max(axis=0)
        frame[:3, 3] += frame[:3, :3] @ ((low + high) / 2)
        return frame, high - low, corners

    def _optical(self, number: int, points: Callable[[DrawnShape], np.ndarray]) -> np.ndarray:
        """Return the `points` of all shapes of an object, in the optical frame, (n, 3)."""
        optical = np.linalg.inv(self.moment.camera_pose)
        pieces = []
        for index in np.flatnonzero(self.numbered.instances == number):
            pose = optical @ self.moment.poses[index]
            pieces.append(points(self._visuals[index].shape) @ pose[:3, :3].T + pose[:3, 3])
        return np.concatenate(pieces)

    def _full_box(self, number: int, corners: np.ndarray, visible: Box2D) -> Box2D:
        """Return `Detection.full` of an object with these corners."""
        lens = self.intrinsics
        if not isinstance(lens, Distorted) and (corners[:, 2] < lens.near).any():
            corners = _clip_near(self._optical(number, _triangle_corners).reshape(-1, 3, 3), lens.near)
        pixels = lens.project(corners)
        if not np.isfinite(pixels).all():
            return visible
        pixels = np.concatenate([pixels, [visible[:2], visible[2:]]])
        return Box2D(*map(float, (*pixels.min(axis=0), *pixels.max(axis=0))))


def described(objects: Sequence[Detection]) -> list[dict[str, Any]]:
    """Return objects as JSON values: px, m, and poses optical-from-box with quaternions xyzw."""
    return [
        {
            "number": seen.number, **seen.identity._asdict(), "pixels": seen.pixels,
            "visible": [round(float(value), 2) for value in seen.visible],
            "full": [round(float(value), 2) for value in seen.full],
            "occlusion": round(seen.occlusion, 4), "truncation": round(seen.truncation, 4),
            "position": seen.pose[:3, 3].round(5).tolist(),
            "orientation": [round(value, 6) for value in quaternion_of(seen)],
            "size": seen.size.round(5).tolist(),
        }
        for seen in objects
    ]  # fmt: skip


def quaternion_of(seen: Detection) -> tuple[float, ...]:
    """Return the orientation of an object's box in the optical frame, a quaternion xyzw."""
    return tuple(map(float, to_quaternion(tuple(seen.pose[:3].ravel()))))


@lru_cache(maxsize=1024)
def _vertices(shape: DrawnShape) -> np.ndarray:
    """Return the distinct corners of a shape's triangles, (n, 3), m."""
    return np.asarray(np.unique(_triangle_corners(shape), axis=0))


@lru_cache(maxsize=64)
def _triangle_corners(shape: DrawnShape) -> np.ndarray:
    """Return the corners of a shape's triangles, three consecutive rows per triangle, (n, 3), m."""
    return np.concatenate([part.corners.reshape(-1, 3) for part in shape.triangles()])


def _clip_near(triangles: np.ndarray, near: float) -> np.ndarray:
    """Return the corners, (n, 3), of the parts of triangles (m, 3, 3) whose z is at least `near`."""
    starts, ends = triangles.reshape(-1, 3), np.roll(triangles, -1, axis=1).reshape(-1, 3)
    crossing = (starts[:, 2] < near) != (ends[:, 2] < near)
    starts_crossing, edges = starts[crossing], (ends - starts)[crossing]
    cuts = starts_crossing + edges * ((near - starts_crossing[:, 2:]) / edges[:, 2:])
    return np.concatenate([starts[starts[:, 2] >= near], cuts])
