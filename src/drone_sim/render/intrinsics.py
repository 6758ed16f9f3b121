"""Camera models, pinhole and orthographic, in the conventions of ROS and OpenGL.

Optical frame (REP 103): z forward, x right, y down. Pixel coordinates (u, v) are integers at pixel centres, as in
OpenCV and image_geometry: the centre of the top left pixel is (0, 0), the image covers -0.5..width-0.5, and the
optical axis meets its centre ((width - 1) / 2, (height - 1) / 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera with square pixels.

    width, height: pixels; horizontal_fov: rad; near, far: metres along the optical z. baseline: m, distance of the
    right camera of a stereo pair from the left one; 0 for any other camera.
    Raises ValueError for an impossible size, angle or range.
    """

    width: int
    height: int
    horizontal_fov: float
    near: float
    far: float
    baseline: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        """Validate the fields; raise ValueError."""
        if self.width < 1 or self.height < 1:
            raise ValueError(f"image size {self.width} x {self.height}: both must be at least 1")
        if not 0.0 < self.horizontal_fov < math.pi:
            raise ValueError(f"horizontal_fov {self.horizontal_fov}: must lie between 0 and pi rad")
        if not 0.0 < self.near < self.far < math.inf:
            raise ValueError(f"near {self.near}, far {self.far}: must be 0 < near < far")

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
        """Column of the optical axis, the middle of the image."""
        return (self.width - 1) / 2.0

    @property
    def cy(self) -> float:
        """Row of the optical axis, the middle of the image."""
        return (self.height - 1) / 2.0

    @property
    def K(self) -> tuple[float, ...]:
        """Camera matrix, 3 x 3 row-major, as in sensor_msgs/CameraInfo."""
        return (self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)

    @property
    def P(self) -> tuple[float, ...]:
        """Projection matrix, 3 x 4 row-major, as in sensor_msgs/CameraInfo; points are in the left camera's frame."""
        return (self.fx, 0.0, self.cx, 0.0 - self.fx * self.baseline, 0.0, self.fy, self.cy, 0.0, 0.0, 0.0, 1.0, 0.0)

    @property
    def distortion(self) -> tuple[str, tuple[float, ...]]:
        """The distortion model and its coefficients, as in sensor_msgs/CameraInfo."""
        return "plumb_bob", (0.0,) * 5

    @property
    def is_fisheye(self) -> bool:
        """Whether the camera may see points beside or behind it; its depths are then along the ray."""
        return False

    @property
    def pixels(self) -> np.ndarray:
        """Coordinates u, v of each pixel, (height, width, 2)."""
        return np.stack(np.meshgrid(np.arange(self.width), np.arange(self.height)), axis=-1)

    @cached_property
    def rays(self) -> np.ndarray:
        """Unit ray of each pixel in the optical frame, (height, width, 3)."""
        across = (self.pixels - (self.cx, self.cy)) / (self.fx, self.fy)
        rays = np.concatenate([across, np.ones((*across.shape[:2], 1))], axis=-1)
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (..., 2) of points (..., 3) in the optical frame, m; NaN for points behind the camera."""
        ahead = np.where(points[..., 2:] > 0, points[..., 2:], np.nan)
        return np.asarray(points[..., :2] / ahead * (self.fx, self.fy) + (self.cx, self.cy))

    def projection(self) -> np.ndarray:
        """Return the OpenGL matrix clip-from-optical (4, 4) float64, for column vectors.

        Depth near..far maps to -1..1 as in glFrustum. OpenGL counts rows from the bottom; here the optical frame's
        y down becomes y up in clip space, so that glReadPixels returns the top row first.
        """
        clip = _perspective(self.near, self.far)
        clip[0, 0] = 2.0 * self.fx / self.width
        clip[1, 1] = 2.0 * self.fy / self.height
        return clip


@dataclass(frozen=True)
class Orthographic:
    """An orthographic camera with square pixels.

    width, height: pixels; wide: width of the view in metres; near, far: metres along the optical z.
    Raises ValueError for an impossible size or range.
    """

    width: int
    height: int
    wide: float
    near: float
    far: float

    def __post_init__(self) -> None:
        """Validate the fields; raise ValueError."""
        if self.width < 1 or self.height < 1:
            raise ValueError(f"image size {self.width} x {self.height}: both must be at least 1")
        if not 0.0 < self.wide < math.inf:
            raise ValueError(f"wide {self.wide}: must be greater than 0 m")
        if not 0.0 < self.near < self.far < math.inf:
            raise ValueError(f"near {self.near}, far {self.far}: must be 0 < near < far")

    @property
    def high(self) -> float:
        """Height of the view in metres."""
        return self.wide * self.height / self.width

    def projection(self) -> np.ndarray:
        """Return the OpenGL matrix clip-from-optical, as `Intrinsics.projection` does.

        Depth near..far maps to -1..1 as in glOrtho.
        """
        near, far = self.near, self.far
        clip = np.diag([2.0 / self.wide, 2.0 / self.high, 2.0 / (far - near), 1.0])
        clip[2, 3] = -(far + near) / (far - near)
        return clip


Lens = Intrinsics | Orthographic


@dataclass(frozen=True, eq=False)
class Tiles:
    """Several pinhole cameras at one position, each of which renders into its rectangle of a common image.

    width, height: of the image, px; near, far: metres along each pinhole's axis. projections: OpenGL matrices
    clip-from-optical of the whole image and the camera's optical frame, (n, 4, 4). bounds: the rectangles in clip
    space (-1..1): lowest x, lowest y, highest x, highest y, (n, 4).
    """

    width: int
    height: int
    near: float
    far: float
    projections: np.ndarray
    bounds: np.ndarray

    @staticmethod
    def of_one(focal: float, centre: np.ndarray, size: tuple[int, int], within: tuple[float, float]) -> np.ndarray:
        """Return the matrix clip-from-optical (4, 4) of one pinhole, in its optical frame.

        focal: px; centre: the pixel on its axis; size: of the image, px; within: near and far.
        """
        clip = _perspective(*within)
        clip[:2, :2] = np.diag(2.0 * focal / np.array(size))
        clip[:2, 2] = 2.0 * (centre + 0.5) / size - 1.0
        return clip

    def projection(self) -> np.ndarray:
        """Return the OpenGL matrices clip-from-optical (n, 4, 4)."""
        return self.projections


def _perspective(near: float, far: float) -> np.ndarray:
    """Return the z and w part of a clip matrix, as in glFrustum; x and y are still 0."""
    clip = np.zeros((4, 4))
    clip[2, 2] = (far + near) / (far - near)
    clip[2, 3] = -2.0 * far * near / (far - near)
    clip[3, 2] = 1.0
    return clip
