"""Lenses that are no pinhole, as ROS and OpenCV describe them: plumb_bob, rational_polynomial and equidistant.

A point in the optical frame is at x = X / Z, y = Y / Z of an ideal pinhole; the lens puts it at x', y', and K makes
pixels of these. plumb_bob and rational_polynomial, with r² = x² + y² and D = k1, k2, p1, p2, k3[, k4, k5, k6]:

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶) + 2 p1 x y + p2 (r² + 2 x²), y' likewise

(Brown 1966; OpenCV's calib3d). equidistant, with θ the angle from the axis and D = k1, k2, k3, k4:

    θ' = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)

(Kannala and Brandt 2006; OpenCV's fisheye). It sees up to 110 degrees from the axis; pixels beyond are black.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drone_sim.render.intrinsics import Intrinsics

MODELS = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}  # and how many coefficients each has
_ROUNDS = 30  # of Newton's method
_CLOSE = 1e-9  # of x' and y', which are about 1 at the edge
_STEP = 1e-6
WIDEST = 3.84  # rad, the largest horizontal_fov of an equidistant lens: 220 degrees


@dataclass(frozen=True)
class Distorted(Intrinsics):
    """A camera whose lens bends straight lines.

    model: one of `MODELS`; D: its coefficients, filled up with zeros. horizontal_fov: rad, of the same camera without
    coefficients, so that it says the focal length; up to `WIDEST` with an equidistant lens.
    Raises ValueError for what `Intrinsics` does, an unknown model, too many coefficients, and a lens that folds the
    picture, so that pixels have no ray.
    """

    model: str = "plumb_bob"
    D: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what no lens can be."""
        if self.model not in MODELS:
            raise ValueError(f"model '{self.model}': must be one of {', '.join(MODELS)}")
        most = MODELS[self.model]
        if len(self.D) > most:
            raise ValueError(f"{len(self.D)} coefficients: {self.model} has {most}")
        object.__setattr__(self, "D", (*self.D, *(0.0,) * (most - len(self.D))))
        if not self.is_fisheye:
            super().__post_init__()
        elif not 0.0 < self.horizontal_fov <= WIDEST:
            raise ValueError(f"horizontal_fov {self.horizontal_fov}: must lie between 0 and {WIDEST} rad (220 degrees)")
        middle = self.rays[self.height // 2] if self.is_fisheye else self.rays
        if not np.isfinite(middle).all():
            raise ValueError(f"{list(self.D)}: this {self.model} lens is impossible: some pixels would have no ray")

    @property
    def distortion(self) -> tuple[str, tuple[float, ...]]:
        """The model of the lens and its coefficients, as in sensor_msgs/CameraInfo."""
        return self.model, self.D

    @property
    def is_fisheye(self) -> bool:
        """Whether it may see what is beside the camera, or behind it."""
        return self.model == "equidistant"

    @property
    def fx(self) -> float:
        """Focal length in pixels: of an equidistant lens, pixels per radian."""
        return self.width / self.horizontal_fov if self.is_fisheye else super().fx

    @cached_property
    def rays(self) -> np.ndarray:
        """Directions of the pixels in the optical frame, of unit length, (height, width, 3); NaN where is none."""
        seen = ((self.pixels - (self.cx, self.cy)) / (self.fx, self.fy)).reshape(-1, 2)
        rays = self._fisheye_rays(seen) if self.is_fisheye else self._rays(seen)
        return rays.reshape(self.height, self.width, 3)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (..., 2) of points (..., 3) in the optical frame; NaN of what it cannot see."""
        if self.is_fisheye:
            across = np.hypot(points[..., 0], points[..., 1])
            angle = np.arctan2(across, points[..., 2])
            scale = np.where(across > 0, _polynomial(angle, self.D) / np.maximum(across, 1e-300), 0.0)
            ideal = points[..., :2] * scale[..., None]
        else:
            with np.errstate(divide="ignore", invalid="ignore"):
                ideal = self._bent(np.where(points[..., 2:] > 0, points[..., :2] / points[..., 2:], np.nan))
        return np.asarray(ideal * (self.fx, self.fy) + (self.cx, self.cy))

    def _bent(self, ideal: np.ndarray) -> np.ndarray:
        """Where the lens puts an ideal pinhole's points (..., 2)."""
        k1, k2, p1, p2, k3, *rational = self.D
        k4, k5, k6 = rational or (0.0, 0.0, 0.0)
        x, y = ideal[..., 0], ideal[..., 1]
        r2 = x * x + y * y
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        return np.stack(
            [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
            axis=-1,
        )

    def _rays(self, seen: np.ndarray) -> np.ndarray:
        """Invert `_bent` by Newton's method, its derivative by differences."""
        ideal = seen.copy()
        for _ in range(_ROUNDS):
            missed = self._bent(ideal) - seen
            if np.abs(missed).max() < _CLOSE:
                break
            (a, c), (b, d) = (
                (self._bent(ideal + ahead) - self._bent(ideal - ahead)).T / (2 * _STEP) for ahead in _STEP * np.eye(2)
            )
            across, down = missed.T
            ideal -= np.column_stack([d * across - b * down, a * down - c * across]) / (a * d - b * c + 1e-12)[:, None]
            ideal = np.clip(ideal, -1e3, 1e3)
        rays = np.column_stack([ideal, np.ones(len(ideal))])
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        found = np.abs(self._bent(ideal) - seen).max(axis=1) < 1e-6
        found &= self._rises(ideal)
        return np.where(found[:, None], rays, np.nan)

    def _rises(self, ideal: np.ndarray) -> bool:
        """Tell whether what is farther from the axis is so in the picture, too, all the way out to its border."""
        grid = ideal.reshape(self.height, self.width, 2)
        border = np.concatenate([grid[0], grid[-1], grid[:, 0], grid[:, -1]])
        way = np.linalg.norm(self._bent(np.linspace(0.0, 1.0, 33)[:, None, None] * border), axis=-1)
        return bool((np.diff(way, axis=0) >= -1e-12).all())

    def _fisheye_rays(self, seen: np.ndarray) -> np.ndarray:
        """Look the angle up in a table, and make it exact by Newton's method."""
        table = np.linspace(0.0, WIDEST / 2, 2000)
        falls = np.flatnonzero(_slope(table, self.D) <= 0)
        table = table[: falls[0] if len(falls) else None]
        reached = _polynomial(table, self.D)
        bent = np.linalg.norm(seen, axis=1)
        angle = np.interp(bent, reached, table)
        for _ in range(4):
            angle -= (
                (_polynomial(angle, self.D) - bent) / np.maximum(_slope(angle, self.D), 1e-3) * (bent <= reached[-1])
            )
        across = np.where(bent > 0, np.sin(angle) / np.maximum(bent, 1e-300), 0.0)
        rays = np.column_stack([seen * across[:, None], np.cos(angle)])
        return np.where((bent <= reached[-1])[:, None], rays, np.nan)


def _polynomial(angle: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    k1, k2, k3, k4 = coefficients
    square = angle * angle
    return np.asarray(angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4)))))


def _slope(angle: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    k1, k2, k3, k4 = coefficients
    square = angle * angle
    return np.asarray(1 + square * (3 * k1 + square * (5 * k2 + square * (7 * k3 + square * 9 * k4))))
