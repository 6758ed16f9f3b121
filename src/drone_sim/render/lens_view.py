"""Images through a distorted lens, resampled from one or several pinhole images (tiles) with different directions.

A tile covers a rectangle of the lens' image and is rendered with nearly as many pixels as that rectangle has. In the
middle of most lenses these are up to a third larger than the lens' pixels, so that the image is slightly softer there;
at the border they are smaller.
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

_MAX_TILE_ANGLE = math.radians(91.0)  # field of view; 180 degrees need two tiles
_PIXEL_RATIO = 0.85  # rendered pixels of a tile per pixel of its rectangle
_MARGIN = 2  # pixels around a tile, needed to interpolate at its border
_SAME_SURFACE = 0.03  # relative difference of depth; beyond it, the pixels belong to different surfaces
_NOWHERE = -16.0  # px, outside the stack: nothing is interpolated there


Colors = Callable[[np.ndarray], np.ndarray]  # makes the image from the rendered RGBA, as for `Target.read`
Draw = Callable[[tuple[str, ...], Colors], Mapping[str, np.ndarray]]


class _Tile(NamedTuple):
    """A pinhole camera that renders a rectangle of the lens' image."""

    pixels: np.ndarray  # flat indices of the lens' pixels in the rectangle
    axes: np.ndarray  # rotation camera-from-tile of the optical frames, (3, 3)
    slopes: np.ndarray  # x / z and y / z of its pixels' rays in that frame, (n, 2)
    cosines: np.ndarray  # z of these rays, (n,)
    focal: float  # px
    size: tuple[int, int]  # of the rendered image, px
    centre: np.ndarray  # where the tile's axis meets that image, px

    @classmethod
    def of(cls, pixels: np.ndarray, rays: np.ndarray, across: np.ndarray, most: float) -> _Tile:
        """Return a tile around `rays` (n, 3), with x roughly along `across` (3,) and a focal length up to `most` px."""
        axis = rays.mean(axis=0)
        axis /= np.linalg.norm(axis)
        down = np.cross(axis, across)
        down /= np.linalg.norm(down)
        axes = np.column_stack([np.cross(down, axis), down, axis])
        tile_rays = rays @ axes
        slopes = tile_rays[:, :2] / tile_rays[:, 2:]
        low, high = slopes.min(axis=0), slopes.max(axis=0)
        focal = min(most, math.sqrt(_PIXEL_RATIO * len(pixels) / max(float(np.prod(high - low)), 1e-12)))
        width, height = (math.ceil(extent) + 2 * _MARGIN + 1 for extent in focal * (high - low))
        return cls(pixels, axes, slopes, tile_rays[:, 2], focal, (width, height), _MARGIN - focal * low)


class LensView:
    """The tiles of a lens, and the map from its pixels to theirs.

    All tiles are rendered into one image, a *stack*, one below the other.
    """

    def __init__(self, lens: Distorted):
        """Divide the field of view of `lens` into tiles, and compute the map."""
        self._has_ray = np.isfinite(lens.rays[..., 0])
        tiles = _tiles(lens, self._has_ray)
        starts = np.cumsum([0, *(tile.size[1] for tile in tiles)])
        self.tiles = _stack(lens, tiles, starts)
        places = np.full((*self._has_ray.shape, 2), _NOWHERE)
        rays, self._depth_factor = np.zeros((*self._has_ray.shape, 3)), np.zeros(self._has_ray.shape)
        nearest = np.zeros_like(rays)
        for tile, start in zip(tiles, starts):
            target = tile.focal * tile.slopes + tile.centre
            offset = (np.rint(target) - target) / tile.focal  # offset to the nearest pixel, at depth 1
            ray = np.column_stack([tile.slopes, np.ones(len(target))]) @ tile.axes.T
            places.reshape(-1, 2)[tile.pixels] = target + np.array((0, start))
            rays.reshape(-1, 3)[tile.pixels] = ray
            nearest.reshape(-1, 3)[tile.pixels] = ray + offset @ tile.axes[:, :2].T
            # A tile's depth is along its axis; a fisheye lens' depth is along the ray.
            along = 1.0 if lens.is_fisheye else lens.rays.reshape(-1, 3)[tile.pixels, 2]
            self._depth_factor.reshape(-1)[tile.pixels] = along / tile.cosines
        self._ray, self._nearest_ray = rays, nearest
        self._exact = places[..., 0].astype(np.float32), places[..., 1].astype(np.float32)
        self._smooth = cv2.convertMaps(*self._exact, cv2.CV_16SC2)  # fixed-point maps are faster
        self._rgba = np.empty((*self._has_ray.shape, 4), np.uint8)
        self._place = tuple(np.rint(np.maximum(places[..., axis], 0)).astype(np.intp) for axis in (1, 0))

    def seen(
        self, names: Sequence[str], draw: Draw, rotation: np.ndarray | None, out: np.ndarray | None
    ) -> dict[str, np.ndarray]:
        """Return the image and outputs of the renderer as the lens sees them, by name.

        `draw` renders the named outputs of all tiles, and passes the colours through its second argument. `rotation` is
        as for `gather`. The image, black where the lens sees nothing, is written into `out` if that is given.
        """

        def colors(stack: np.ndarray) -> np.ndarray:
            return without_alpha(cv2.remap(stack, *self._smooth, cv2.INTER_LINEAR, dst=self._rgba), out)

        drawn = dict(draw(tuple(names) if "before" not in names or "depth" in names else (*names, "depth"), colors))
        images = {name: drawn.pop(name) for name in (COLOR,) if name in drawn}
        resampled = {**self.gather(drawn, rotation), **images}
        return {name: resampled[name] for name in names}

    def gather(self, drawn: Mapping[str, np.ndarray], rotation: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return outputs of the renderer as the lens sees them, resampled from the stacks `drawn`.

        "before" needs "depth" and `rotation`: the previous from the present optical frame, (3, 3).
        """
        gathered = {name: stack[self._place] for name, stack in drawn.items()}
        if "depth" in drawn:
            nearest = gathered["depth"]
            with np.errstate(divide="ignore"):  # where the lens sees nothing
                smooth = 1.0 / cv2.remap(1.0 / drawn["depth"], self._exact[0], self._exact[1], cv2.INTER_LINEAR)
            # Interpolated in 1/depth (linear on a plane) within one surface, else that of the nearest pixel.
            depth = np.where(np.abs(smooth - nearest) < _SAME_SURFACE * nearest, smooth, nearest)
            gathered["depth"] = (depth * self._depth_factor).astype(np.float32)
        if "before" in drawn and rotation is not None:  # the point moved like its nearest pixel
            offset = self._ray * depth[..., None] - self._nearest_ray * nearest[..., None]
            gathered["before"] = (gathered["before"] + offset @ rotation.T).astype(np.float32)
        for name, output in gathered.items():
            output[~self._has_ray] = np.nan if name in ("depth", "before") else 0
        return gathered


def _tiles(lens: Distorted, has_ray: np.ndarray) -> list[_Tile]:
    """Divide the image into rectangles of similar size, each narrow enough for a pinhole."""
    high, wide = has_ray.shape
    middle = lens.rays[high // 2], lens.rays[:, wide // 2]
    columns_of_tiles, rows_of_tiles = (max(1, math.ceil(_angle(rays) / _MAX_TILE_ANGLE)) for rays in middle)
    tiles = []
    for rows in np.array_split(np.arange(high), rows_of_tiles):
        for columns in np.array_split(np.arange(wide), columns_of_tiles):
            valid = has_ray[np.ix_(rows, columns)]
            if not valid.any():
                continue
            rays = lens.rays[np.ix_(rows, columns)]
            centre = max(1, len(columns) // 2)
            across = np.nansum(rays[:, centre:], axis=(0, 1)) / max(1, valid[:, centre:].sum())
            across -= np.nansum(rays[:, :centre], axis=(0, 1)) / max(1, valid[:, :centre].sum())
            pixels = (rows[:, None] * wide + columns)[valid]
            tiles.append(_Tile.of(pixels, rays[valid], across, lens.fx))
    return tiles


def _angle(rays: np.ndarray) -> float:
    """Return the sum of the angles between consecutive rays, rad."""
    steps = np.linalg.norm(np.diff(rays[np.isfinite(rays[:, 0])], axis=0), axis=1)
    return float(2 * np.arcsin(steps / 2).sum())


def _stack(lens: Distorted, tiles: list[_Tile], starts: np.ndarray) -> Tiles:
    """Return the projections that render each tile into the stack, from its row in `starts`."""
    wide, high = max(tile.size[0] for tile in tiles), int(starts[-1])
    projections, bounds = [], []
    for tile, start in zip(tiles, starts):
        project = Tiles.of_one(tile.focal, tile.centre + np.array((0, start)), (wide, high), (lens.near, lens.far))
        axes = np.eye(4)
        axes[:3, :3] = tile.axes.T
        projections.append(project @ axes)
        edges = np.array([[0, start], [tile.size[0], start + tile.size[1]]]) / (wide, high)
        bounds.append((2 * edges - 1).ravel())
    return Tiles(wide, high, lens.near, lens.far, np.array(projections), np.array(bounds))
