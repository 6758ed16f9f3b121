"""What is drawn into: a picture's colours, outputs beside it, or both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import cv2
import moderngl
import numpy as np

from drone_sim.render import sky
from drone_sim.render.outputs import COLOR, OUTPUTS


class Box(NamedTuple):
    """A part of a picture, px: its left upper pixel, its width and its height."""

    left: int
    top: int
    width: int
    height: int


class Target:
    """A framebuffer of one size, with an attachment for each of some names: the colours first, then outputs."""

    def __init__(
        self, gl: moderngl.Context, names: Sequence[str], held: Sequence[type], size: tuple[int, int], samples: int
    ):
        """Make it.

        held: dtypes of the outputs' attachments; size: width and height in px; samples: of a pixel, of colours alone.
        """
        self._gl, self._size, self._names = gl, size, tuple(names)
        self._outputs = dict(zip([name for name in names if name != COLOR], held))
        self._has_color = COLOR in names
        colors = [gl.renderbuffer(size, 4, samples=samples)] if self._has_color else []
        others = [
            gl.renderbuffer(size, OUTPUTS[name].components, dtype=_word(dtype)) for name, dtype in self._outputs.items()
        ]
        self._drawn: Any = gl.framebuffer([*colors, *others], gl.depth_renderbuffer(size, samples=samples))
        self._resolved = gl.framebuffer([gl.renderbuffer(size, 4)]) if samples else self._drawn
        self._rgba = np.empty((size[1], size[0], 4), dtype=np.uint8)

    def clear(self, alpha: float, box: Box, whole: tuple[int, int]) -> None:
        """Take that box of a picture, whose width and height are `whole`, and make this the target of drawing.

        The colours are haze, with this alpha, and the outputs say that there is nothing.
        """
        self._drawn.viewport = -box.left, -box.top, *whole
        for name in self._names:
            self._write([name])
            self._drawn.clear(*(*sky.HAZE, alpha) if name == COLOR else (OUTPUTS[name].nothing,) * 4)
            self._drawn.depth_mask = False  # depths are cleared once
        self._drawn.depth_mask = True
        self.use()

    def use(self, color: bool = True, outputs: bool = True) -> None:
        """Make this the target of drawing from now on; `color` and `outputs`: which of them drawing changes."""
        self._write([name for name in self._names if (color if name == COLOR else outputs)])

    def _write(self, names: Sequence[str]) -> None:
        """Make this the target of drawing from now on, which changes only these attachments."""
        if len(self._names) > 1:
            self._drawn.color_mask = [(name in names,) * 4 for name in self._names]
        self._drawn.use()

    def read(self, colors: Callable[[np.ndarray], np.ndarray] | None = None) -> dict[str, np.ndarray]:
        """Return what has been drawn, by name, the top row first.

        `colors` makes the picture of what there is of it, (height, width, 4) uint8, which is drawn over later.
        """
        wide, high = self._size
        read = {}
        for place, (name, dtype) in enumerate(self._outputs.items(), int(self._has_color)):
            one = OUTPUTS[name]
            drawn: np.ndarray = np.empty((high, wide, one.components)[: 2 + (one.components > 1)], dtype)
            given = {"viewport": (0, 0, wide, high), "components": one.components, "dtype": _word(dtype)}
            self._drawn.read_into(drawn, attachment=place, **given)
            read[name] = drawn[..., :3] if one.components > 1 else drawn.astype(one.dtype, copy=False)
        if colors is not None:
            if self._resolved is not self._drawn:
                self._gl.copy_framebuffer(self._resolved, self._drawn)
            self._resolved.read_into(self._rgba, viewport=(0, 0, wide, high), components=4)
            read[COLOR] = colors(self._rgba)
        return read


def _word(dtype: type) -> str:
    """Return moderngl's name of what an attachment holds."""
    return f"{'u' if np.issubdtype(dtype, np.integer) else 'f'}{np.dtype(dtype).itemsize}"


def without_alpha(picture: np.ndarray, out: np.ndarray | None) -> np.ndarray:
    """Return RGB of RGBA, written into `out` where given; raises ValueError where that does not fit."""
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGBA2RGB, dst=_array(out, (*picture.shape[:2], 3), np.uint8)))


def _array(out: np.ndarray | None, shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Return the array to write into: a new one where none is given. Raises ValueError for one that does not fit."""
    if out is None:
        return np.empty(shape, dtype=dtype)
    if out.shape != shape or out.dtype != dtype or not out.flags.c_contiguous:
        raise ValueError(f"out must be a C-contiguous {np.dtype(dtype).name} array of shape {shape}")
    return out
