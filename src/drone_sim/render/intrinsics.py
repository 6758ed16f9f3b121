"""The pinhole model of a camera, in the conventions of ROS and of OpenGL.

Optical frame (REP 103): z forward, x right, y down. Pixel coordinates (u, v) have whole numbers at pixel
centres, as in OpenCV and image_geometry: the top left pixel's centre is (0, 0), the picture covers
-0.5..width-0.5, and the optical axis meets its centre at ((width - 1) / 2, (height - 1) / 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Intrinsics:
    """A camera without distortion and with square pixels.

    width, height: pixels; horizontal_fov: rad; near, far: metres along the optical z. baseline: m, how far to the right
    of the left camera of a pair it sits; 0 for any other.
    Raises ValueError for a size, angle or range with which no picture can be made.
    """

    width: int
    height: int
    horizontal_fov: float
    near: float
    far: float
    baseline: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse what no camera can be."""
        if self.width < 1 or self.height < 1:
            raise ValueError(f"image size {self.width} x {self.height}: both must be at least 1")
        if not 0.0 < self.horizontal_fov < math.pi:
            raise ValueError(f"horizontal_fov {self.horizontal_fov}: must lie between 0 and pi rad")
        if not 0.0 < self.near < self.far < math.inf:
            raise ValueError(f"near {self.near}, far {self.far}: 0 < near < far is needed")

    @property
    def fx(self) -> float:
        """Focal length in pixels: width / 2 = fx tan(horizontal_fov / 2)."""
        return self.width / 2.0 / math.tan(self.horizontal_fov / 2.0)

    @property
    def fy(self) -> float:
        """Focal length in pixels, equal to `fx`: the pixels are square."""
        return self.fx

    @property
    def cx(self) -> float:
        """Column of the optical axis, the middle of the picture."""
        return (self.width - 1) / 2.0

    @property
    def cy(self) -> float:
        """Row of the optical axis, the middle of the picture."""
        return (self.height - 1) / 2.0

    @property
    def K(self) -> tuple[float, ...]:
        """Camera matrix, 3 x 3 row-major, as in sensor_msgs/CameraInfo."""
        return (self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)

    @property
    def P(self) -> tuple[float, ...]:
        """Projection matrix, 3 x 4 row-major, as in sensor_msgs/CameraInfo: of points in the left camera's frame."""
        return (self.fx, 0.0, self.cx, 0.0 - self.fx * self.baseline, 0.0, self.fy, self.cy, 0.0, 0.0, 0.0, 1.0, 0.0)

    @property
    def distortion(self) -> tuple[str, tuple[float, ...]]:
        """The model of the lens and its coefficients, as in sensor_msgs/CameraInfo."""
        return "plumb_bob", (0.0,) * 5

    @property
    def is_fisheye(self) -> bool:
        """Whether it may see what is beside the camera, or behind it: depths are then along the ray."""
        return False

    @property
    def pixels(self) -> np.ndarray:
        """The pixels' coordinates u, v, (height, width, 2)."""
        return np.stack(np.meshgrid(np.arange(self.width), np.arange(self.height)), axis=-1)

    @cached_property
    def rays(self) -> np.ndarray:
        """Directions of the pixels in the optical frame, of unit length, (height, width, 3)."""
        across = (self.pixels - (self.cx, self.cy)) / (self.fx, self.fy)
        rays = np.concatenate([across, np.ones((*across.shape[:2], 1))], axis=-1)
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (..., 2) of points (..., 3) in the optical frame, m; NaN of what is behind the camera."""
        ahead = np.where(points[..., 2:] > 0, points[..., 2:], np.nan)
        return np.asarray(points[..., :2] / ahead * (self.fx, self.fy) + (self.cx, self.cy))

    def projection(self) -> np.ndarray:
        """OpenGL clip matrix (4, 4) float64 of the optical frame, acting on column vectors.

        Depth near..far maps to -1..1 as in glFrustum. OpenGL counts rows from the bottom; here y down in
        the optical frame is y up in the clip space, so that a plain glReadPixels yields the top row first.
        """
        clip = _perspective(self.near, self.far)
        clip[0, 0] = 2.0 * self.fx / self.width
        clip[1, 1] = 2.0 * self.fy / self.height
        return clip


@dataclass(frozen=True)
class Orthographic:
    """A camera without perspective and with square pixels.

    width, height: pixels; wide: metres across the picture; near, far: metres along the optical z.
    Raises ValueError for a size or range with which no picture can be made.
    """

    width: int
    height: int
    wide: float
    near: float
    far: float

    def __post_init__(self) -> None:
        """Refuse what no camera can be."""
        if self.width < 1 or self.height < 1:
            raise ValueError(f"image size {self.width} x {self.height}: both must be at least 1")
        if not 0.0 < self.wide < math.inf:
            raise ValueError(f"wide {self.wide}: must be greater than 0 m")
        if not 0.0 < self.near < self.far < math.inf:
            raise ValueError(f"near {self.near}, far {self.far}: 0 < near < far is needed")

    @property
    def high(self) -> float:
        """Metres from the picture's top to its bottom."""
        return self.wide * self.height / self.width

    def projection(self) -> np.ndarray:
        """OpenGL clip matrix (4, 4) float64 of the optical frame, as Intrinsics.projection.

        Depth near..far maps to -1..1 as in glOrtho.
        """
        near, far = self.near, self.far
        clip = np.diag([2.0 / self.wide, 2.0 / self.high, 2.0 / (far - near), 1.0])
        clip[2, 3] = -(far + near) / (far - near)
        return clip


Lens = Intrinsics | Orthographic


@dataclass(frozen=True, eq=False)
class Tiles:
    """Pinholes that look from one place, each into its rectangle of one picture.

    width, height: of the picture, px; near, far: metres along each pinhole's own axis. projections: OpenGL clip
    matrices of the picture, from the optical frame of the camera, (n, 4, 4). bounds: the rectangles in that picture, of
    which x and y go from -1 to 1: the lowest x and y, the highest x and y, (n, 4).
    """

    width: int
    height: int
    near: float
    far: float
    projections: np.ndarray
    bounds: np.ndarray

    @staticmethod
    def of_one(focal: float, centre: np.ndarray, size: tuple[int, int], within: tuple[float, float]) -> np.ndarray:
        """Return the clip matrix (4, 4) of a pinhole in its own optical frame.

        focal: px; centre: the pixel that its axis meets; size: of the picture, px; within: near and far.
        """
        clip = _perspective(*within)
        clip[:2, :2] = np.diag(2.0 * focal / np.array(size))
        clip[:2, 2] = 2.0 * (centre + 0.5) / size - 1.0
        return clip

    def projection(self) -> np.ndarray:
        """OpenGL clip matrices (n, 4, 4) of the optical frame."""
        return self.projections


def _perspective(near: float, far: float) -> np.ndarray:
    """What a clip matrix does with the optical z, as in glFrustum; nothing yet with x and y."""
    clip = np.zeros((4, 4))
    clip[2, 2] = (far + near) / (far - near)
    clip[2, 3] = -2.0 * far * near / (far - near)
    clip[3, 2] = 1.0
    return clip
