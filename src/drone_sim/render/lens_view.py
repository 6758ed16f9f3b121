"""What a lens sees, gathered from pictures of pinholes: one, or some tiles, each of which looks its own way.

A tile is a rectangle of the lens' picture. Nearly as many pixels are drawn for it as it has: in the middle of most
lenses they are larger than its own, by up to a third, so that it is a little softer there, and smaller at the border.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Tiles
from drone_sim.render.outputs import COLOR
from drone_sim.render.target import without_alpha

_WIDEST = math.radians(91.0)  # of a tile: 180 degrees take two
_SHARE = 0.85  # of the pixels of a part, so many has its tile
_MARGIN = 2  # pixels around a tile, from which its border is interpolated
_ALIKE = 0.03  # of a depth: what differs by more is another thing
_NOWHERE = -16.0  # px, where there is nothing to interpolate


Colors = Callable[[np.ndarray], np.ndarray]  # a picture, of what is drawn of it, as `Target.read` says
Draw = Callable[[tuple[str, ...], Colors], Mapping[str, np.ndarray]]


class _Tile(NamedTuple):
    """A pinhole that draws a part of what the lens sees."""

    pixels: np.ndarray  # the lens' own, by their numbers
    axes: np.ndarray  # of its optical frame, in the camera's, by columns, (3, 3)
    slopes: np.ndarray  # x / z and y / z of its pixels' rays in that frame, (n, 2)
    cosines: np.ndarray  # z of these rays, (n,)
    focal: float  # px
    size: tuple[int, int]  # of what is drawn, px
    centre: np.ndarray  # where the axis is in it, px

    @classmethod
    def of(cls, pixels: np.ndarray, rays: np.ndarray, across: np.ndarray, most: float) -> _Tile:
        """Look where `rays` (n, 3) lead, with x about along `across` (3,), and a focal length of `most` px at most."""
        axis = rays.mean(axis=0)
        axis /= np.linalg.norm(axis)
        down = np.cross(axis, across)
        down /= np.linalg.norm(down)
        axes = np.column_stack([np.cross(down, axis), down, axis])
        inside = rays @ axes
        slopes = inside[:, :2] / inside[:, 2:]
        low, high = slopes.min(axis=0), slopes.max(axis=0)
        focal = min(most, math.sqrt(_SHARE * len(pixels) / max(float(np.prod(high - low)), 1e-12)))
        wide, tall = (math.ceil(one) + 2 * _MARGIN + 1 for one in focal * (high - low))
        return cls(pixels, axes, slopes, inside[:, 2], focal, (wide, tall), _MARGIN - focal * low)


class LensView:
    """Which tiles a lens needs, and which of their pixels become its own.

    The tiles lie one below the other in one picture, a *stack*.
    """

    def __init__(self, lens: Distorted):
        """Divide what `lens` sees."""
        self._sees = np.isfinite(lens.rays[..., 0])
        found = _tiles(lens, self._sees)
        starts = np.cumsum([0, *(one.size[1] for one in found)])
        self.tiles = _stacked(lens, found, starts)
        places = np.full((*self._sees.shape, 2), _NOWHERE)
        rays, self._deeper = np.zeros((*self._sees.shape, 3)), np.zeros(self._sees.shape)
        nearest = np.zeros_like(rays)
        for one, start in zip(found, starts):
            there = one.focal * one.slopes + one.centre
            beside = (np.rint(there) - there) / one.focal  # its nearest pixel, where depth is 1
            ray = np.column_stack([one.slopes, np.ones(len(there))]) @ one.axes.T
            places.reshape(-1, 2)[one.pixels] = there + np.array((0, start))
            rays.reshape(-1, 3)[one.pixels] = ray
            nearest.reshape(-1, 3)[one.pixels] = ray + beside @ one.axes[:, :2].T
            # A tile's depth is along its own axis. With a fisheye lens depths are counted along the ray.
            along = 1.0 if lens.is_fisheye else lens.rays.reshape(-1, 3)[one.pixels, 2]
            self._deeper.reshape(-1)[one.pixels] = along / one.cosines
        self._ray, self._nearest_ray = rays, nearest
        self._exact = places[..., 0].astype(np.float32), places[..., 1].astype(np.float32)
        self._smooth = cv2.convertMaps(*self._exact, cv2.CV_16SC2)  # sooner done
        self._rgba = np.empty((*self._sees.shape, 4), np.uint8)
        self._place = tuple(np.rint(np.maximum(places[..., axis], 0)).astype(np.intp) for axis in (1, 0))

    def seen(
        self, names: Sequence[str], draw: Draw, turn: np.ndarray | None, out: np.ndarray | None
    ) -> dict[str, np.ndarray]:
        """Return the picture and outputs of the renderer as the lens sees them, by name.

        `draw` draws some of the tiles, the colours as it is told. `turn` is as for `gather`; the picture, black where
        the lens sees nothing, is written into `out`, if it is there.
        """

        def colors(stack: np.ndarray) -> np.ndarray:
            return without_alpha(cv2.remap(stack, *self._smooth, cv2.INTER_LINEAR, dst=self._rgba), out)

        drawn = dict(draw(tuple(names) if "before" not in names or "depth" in names else (*names, "depth"), colors))
        pictures = {name: drawn.pop(name) for name in (COLOR,) if name in drawn}
        found = {**self.gather(drawn, turn), **pictures}
        return {name: found[name] for name in names}

    def gather(self, drawn: Mapping[str, np.ndarray], turn: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return outputs of the renderer as the lens sees them, from stacks of them.

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
        for name, picture in gathered.items():
            picture[~self._sees] = np.nan if name in ("depth", "before") else 0
        return gathered

    def _between(self, stack: np.ndarray, nearest: np.ndarray) -> np.ndarray:
        """Return the tiles' depths at the pixels: within one thing interpolated by 1/depth, linear on a plane."""
        with np.errstate(divide="ignore"):  # where the lens sees nothing
            smooth = 1.0 / cv2.remap(1.0 / stack, self._exact[0], self._exact[1], cv2.INTER_LINEAR)
        return np.where(np.abs(smooth - nearest) < _ALIKE * nearest, smooth, nearest)


def _tiles(lens: Distorted, sees: np.ndarray) -> list[_Tile]:
    """Divide the picture into rectangles of about the same size, none of which is too wide for a pinhole."""
    high, wide = sees.shape
    middle = lens.rays[high // 2], lens.rays[:, wide // 2]
    many_across, many_down = (max(1, math.ceil(_angle(one) / _WIDEST)) for one in middle)
    found = []
    for rows in np.array_split(np.arange(high), many_down):
        for columns in np.array_split(np.arange(wide), many_across):
            seen = sees[np.ix_(rows, columns)]
            if not seen.any():
                continue
            rays = lens.rays[np.ix_(rows, columns)]
            half = max(1, len(columns) // 2)
            across = np.nansum(rays[:, half:], axis=(0, 1)) / max(1, seen[:, half:].sum())
            across -= np.nansum(rays[:, :half], axis=(0, 1)) / max(1, seen[:, :half].sum())
            pixels = (rows[:, None] * wide + columns)[seen]
            found.append(_Tile.of(pixels, rays[seen], across, lens.fx))
    return found


def _angle(rays: np.ndarray) -> float:
    """Return the angle from the first of some rays to the last, from each to the next, rad."""
    steps = np.linalg.norm(np.diff(rays[np.isfinite(rays[:, 0])], axis=0), axis=1)
    return float(2 * np.arcsin(steps / 2).sum())


def _stacked(lens: Distorted, found: list[_Tile], starts: np.ndarray) -> Tiles:
    """Return how the tiles are drawn, each at its place."""
    wide, high = max(one.size[0] for one in found), int(starts[-1])
    projections, bounds = [], []
    for one, start in zip(found, starts):
        project = Tiles.of_one(one.focal, one.centre + np.array((0, start)), (wide, high), (lens.near, lens.far))
        axes = np.eye(4)
        axes[:3, :3] = one.axes.T
        projections.append(project @ axes)
        edges = np.array([[0, start], [one.size[0], start + one.size[1]]]) / (wide, high)
        bounds.append((2 * edges - 1).ravel())
    return Tiles(wide, high, lens.near, lens.far, np.array(projections), np.array(bounds))
