"""What is drawn into: a picture's colours, outputs beside it, or both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import moderngl
import numpy as np

from drone_sim.render import sky
from drone_sim.render.outputs import COLOR, OUTPUTS, finished


class Box(NamedTuple):
    """A part of a picture, px: its left upper pixel, its width and its height."""

    left: int
    top: int
    width: int
    height: int


class Target:
    """A framebuffer of one size, with an attachment for each of some names: the colours first, then outputs."""

    def __init__(self, gl: moderngl.Context, names: Sequence[str], size: tuple[int, int], samples: int):
        """Make it; `size` is width and height in px, `samples` those of a pixel, of colours alone."""
        self._gl, self._size = gl, size
        self._outputs = [name for name in names if name != COLOR]
        self._has_color = COLOR in names
        colors = [gl.renderbuffer(size, 4, samples=samples)] if self._has_color else []
        held = [gl.renderbuffer(size, OUTPUTS[one].components, dtype=_dtype(one)) for one in self._outputs]
        self._drawn: Any = gl.framebuffer([*colors, *held], gl.depth_renderbuffer(size, samples=samples))
        self._resolved = gl.framebuffer([gl.renderbuffer(size, 4)]) if samples else self._drawn
        self._rgba = np.empty((size[1], size[0], 4), dtype=np.uint8)

    def clear(self, alpha: float, box: Box, whole: tuple[int, int]) -> None:
        """Be that box of a picture, whose width and height are `whole`, and be drawn into from now on.

        The colours are haze, with this alpha, and the outputs 0.
        """
        self._drawn.viewport = -box.left, -box.top, *whole
        if self._outputs:
            self.use(color=False)
            self._drawn.depth_mask = not self._has_color  # with the colours depths are cleared once
            self._drawn.clear()
            self._drawn.depth_mask = True
        if self._has_color:
            self.use(outputs=False)
            self._drawn.clear(*sky.HAZE, alpha)
        self.use()

    def use(self, color: bool = True, outputs: bool = True) -> None:
        """Be drawn into from now on, which changes the colours or not, and the outputs or not."""
        if self._has_color and self._outputs:
            self._drawn.color_mask = [(color,) * 4, *[(outputs,) * 4] * len(self._outputs)]
        self._drawn.use()

    def read(self, into: np.ndarray | None) -> dict[str, np.ndarray]:
        """Return what has been drawn, by name, the top row first; the picture is written into an array, if given."""
        wide, high = self._size
        read = {}
        for place, name in enumerate(self._outputs, int(self._has_color)):
            one = OUTPUTS[name]
            drawn: np.ndarray = np.empty((high, wide, one.components)[: 2 + (one.components > 1)], one.dtype)
            given = {"viewport": (0, 0, wide, high), "components": one.components, "dtype": _dtype(name)}
            self._drawn.read_into(drawn, attachment=place, **given)
            read[name] = finished(name, drawn)
        if self._has_color:
            if self._resolved is not self._drawn:
                self._gl.copy_framebuffer(self._resolved, self._drawn)
            self._resolved.read_into(self._rgba, viewport=(0, 0, wide, high), components=4)
            picture = array(into, (high, wide, 3), np.uint8)
            read[COLOR] = cv2.cvtColor(self._rgba, cv2.COLOR_RGBA2RGB, dst=picture)
        return read


def _dtype(output: str) -> str:
    """Return OpenGL's name of what an attachment holds."""
    return f"u{np.dtype(OUTPUTS[output].dtype).itemsize}"


def array(out: np.ndarray | None, shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Return the array to write into: a new one where none is given. Raises ValueError for one that does not fit."""
    if out is None:
        return np.empty(shape, dtype=dtype)
    if out.shape != shape or out.dtype != dtype or not out.flags.c_contiguous:
        raise ValueError(f"out must be a C-contiguous {np.dtype(dtype).name} array of shape {shape}")
    return out
