"""Distorted lenses with the models of ROS and OpenCV: plumb_bob, rational_polynomial and equidistant.

An ideal pinhole projects a point of the optical frame to x = X / Z, y = Y / Z. The lens moves it to x', y', and the
camera matrix K converts these to pixels. plumb_bob and rational_polynomial use r² = x² + y² and
D = k1, k2, p1, p2, k3[, k4, k5, k6]:

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶) + 2 p1 x y + p2 (r² + 2 x²), y' likewise

(Brown 1966; OpenCV's calib3d). equidistant, with θ the angle from the axis and D = k1, k2, k3, k4:

    θ' = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)

(Kannala and Brandt 2006; OpenCV's fisheye). Pixels more than 110 degrees from the axis are black.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drone_sim.render.intrinsics import Intrinsics

MODELS = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}  # model: number of coefficients
_MAX_ITERATIONS = 30  # of Newton's method
_TOLERANCE = 1e-9  # of x' and y', which are about 1 at the edge
_STEP = 1e-6  # of the numerical derivative
WIDEST = 3.84  # rad, the largest horizontal_fov of an equidistant lens: 220 degrees


@dataclass(frozen=True)
class Distorted(Intrinsics):
    """A camera whose lens images straight lines as curves.

    model: one of `MODELS`; D: its coefficients, padded with zeros. horizontal_fov: rad, of the same camera with all
    coefficients 0, so that it defines the focal length; up to `WIDEST` for an equidistant lens.
    Raises ValueError as `Intrinsics` does, and for an unknown model, too many coefficients, or a lens that folds the
    image, so that some pixels have no ray.
    """

    model: str = "plumb_bob"
    D: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.model not in MODELS:
            raise ValueError(f"model '{self.model}': must be one of {', '.join(MODELS)}")
        max_coefficients = MODELS[self.model]
        if len(self.D) > max_coefficients:
            raise ValueError(f"{len(self.D)} coefficients: {self.model} has {max_coefficients}")
        object.__setattr__(self, "D", (*self.D, *(0.0,) * (max_coefficients - len(self.D))))
        if not self.is_fisheye:
            super().__post_init__()
        elif not 0.0 < self.horizontal_fov <= WIDEST:
            raise ValueError(f"horizontal_fov {self.horizontal_fov}: must lie between 0 and {WIDEST} rad (220 degrees)")
        checked_rays = self.rays[self.height // 2] if self.is_fisheye else self.rays
        if not np.isfinite(checked_rays).all():
            raise ValueError(f"{list(self.D)}: this {self.model} lens folds the image: some pixels have no ray")

    @property
    def distortion(self) -> tuple[str, tuple[float, ...]]:
        return self.model, self.D

    @property
    def is_fisheye(self) -> bool:
        """Whether the lens is equidistant, and may see points beside or behind the camera."""
        return self.model == "equidistant"

    @property
    def fx(self) -> float:
        """Focal length in pixels; pixels per radian for an equidistant lens."""
        return self.width / self.horizontal_fov if self.is_fisheye else super().fx

    @cached_property
    def rays(self) -> np.ndarray:
        """Unit ray of each pixel in the optical frame, (height, width, 3); NaN for a pixel without a ray."""
        distorted = ((self.pixels - (self.cx, self.cy)) / (self.fx, self.fy)).reshape(-1, 2)
        rays = self._fisheye_rays(distorted) if self.is_fisheye else self._rays(distorted)
        return rays.reshape(self.height, self.width, 3)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (..., 2) of points (..., 3) in the optical frame; NaN where the lens cannot see."""
        if self.is_fisheye:
            radius = np.hypot(points[..., 0], points[..., 1])
            angle = np.arctan2(radius, points[..., 2])
            scale = np.where(radius > 0, _polynomial(angle, self.D) / np.maximum(radius, 1e-300), 0.0)
            ideal = points[..., :2] * scale[..., None]
        else:
            with np.errstate(divide="ignore", invalid="ignore"):
                ideal = self._distort(np.where(points[..., 2:] > 0, points[..., :2] / points[..., 2:], np.nan))
        return np.asarray(ideal * (self.fx, self.fy) + (self.cx, self.cy))

    def _distort(self, ideal: np.ndarray) -> np.ndarray:
        """Return x', y' for the coordinates x, y of an ideal pinhole, (..., 2)."""
        k1, k2, p1, p2, k3, *rational = self.D
        k4, k5, k6 = rational or (0.0, 0.0, 0.0)
        x, y = ideal[..., 0], ideal[..., 1]
        r2 = x * x + y * y
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        return np.stack(
            [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
            axis=-1,
        )

    def _rays(self, distorted: np.ndarray) -> np.ndarray:
        """Invert `_distort` by Newton's method with a numerical derivative."""
        ideal = distorted.copy()
        for _ in range(_MAX_ITERATIONS):
            error = self._distort(ideal) - distorted
            if np.abs(error).max() < _TOLERANCE:
                break
            (a, c), (b, d) = (
                (self._distort(ideal + h) - self._distort(ideal - h)).T / (2 * _STEP) for h in _STEP * np.eye(2)
            )
            ex, ey = error.T
            ideal -= np.column_stack([d * ex - b * ey, a * ey - c * ex]) / (a * d - b * c + 1e-12)[:, None]
            ideal = np.clip(ideal, -1e3, 1e3)
        rays = np.column_stack([ideal, np.ones(len(ideal))])
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        is_valid = np.abs(self._distort(ideal) - distorted).max(axis=1) < 1e-6
        is_valid &= self._is_monotonic(ideal)
        return np.where(is_valid[:, None], rays, np.nan)

    def _is_monotonic(self, ideal: np.ndarray) -> bool:
        """Return whether the distance from the axis grows from the image centre to every border pixel."""
        grid = ideal.reshape(self.height, self.width, 2)
        border = np.concatenate([grid[0], grid[-1], grid[:, 0], grid[:, -1]])
        radii = np.linalg.norm(self._distort(np.linspace(0.0, 1.0, 33)[:, None, None] * border), axis=-1)
        return bool((np.diff(radii, axis=0) >= -1e-12).all())

    def _fisheye_rays(self, distorted: np.ndarray) -> np.ndarray:
        """Look up each pixel's angle in a table and refine it by Newton's method."""
        table = np.linspace(0.0, WIDEST / 2, 2000)
        falling = np.flatnonzero(_slope(table, self.D) <= 0)
        table = table[: falling[0] if len(falling) else None]
        radii = _polynomial(table, self.D)
        radius = np.linalg.norm(distorted, axis=1)
        angle = np.interp(radius, radii, table)
        for _ in range(4):
            angle -= (
                (_polynomial(angle, self.D) - radius) / np.maximum(_slope(angle, self.D), 1e-3) * (radius <= radii[-1])
            )
        scale = np.where(radius > 0, np.sin(angle) / np.maximum(radius, 1e-300), 0.0)
        rays = np.column_stack([distorted * scale[:, None], np.cos(angle)])
        return np.where((radius <= radii[-1])[:, None], rays, np.nan)


def _polynomial(angle: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    k1, k2, k3, k4 = coefficients
    square = angle * angle
    return np.asarray(angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4)))))


def _slope(angle: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    k1, k2, k3, k4 = coefficients
    square = angle * angle
    return np.asarray(1 + square * (3 * k1 + square * (5 * k2 + square * (7 * k3 + square * 9 * k4))))
