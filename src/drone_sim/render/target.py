"""Framebuffers for an image, for outputs, or for both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import cv2
import moderngl
import numpy as np

from drone_sim.render import sky
from drone_sim.render.outputs import COLOR, OUTPUTS


class Box(NamedTuple):
    """A rectangle of an image, px: its top left pixel, width and height."""

    left: int
    top: int
    width: int
    height: int


class Target:
    """A framebuffer with one attachment for each name: colour first, then the outputs."""

    def __init__(
        self, gl: moderngl.Context, names: Sequence[str], held: Sequence[type], size: tuple[int, int], samples: int
    ):
        """`held`: dtypes of the outputs' attachments. size: width, height (px). samples: per pixel, colour only."""
        self._gl, self._size, self._names = gl, size, tuple(names)
        self._outputs = dict(zip([name for name in names if name != COLOR], held))
        self._has_color = COLOR in names
        colors = [gl.renderbuffer(size, 4, samples=samples)] if self._has_color else []
        others = [
            gl.renderbuffer(size, OUTPUTS[name].components, dtype=_dtype_name(dtype))
            for name, dtype in self._outputs.items()
        ]
        self._drawn: Any = gl.framebuffer([*colors, *others], gl.depth_renderbuffer(size, samples=samples))
        self._resolved = gl.framebuffer([gl.renderbuffer(size, 4)]) if samples else self._drawn
        self._rgba = np.empty((size[1], size[0], 4), dtype=np.uint8)

    def clear(self, alpha: float, box: Box, whole: tuple[int, int]) -> None:
        """Clear and bind it, with a viewport that shows `box` of an image of `whole` width and height.

        Colour becomes haze with this alpha; outputs get their value for no surface.
        """
        self._drawn.viewport = -box.left, -box.top, *whole
        for name in self._names:
            self._write([name])
            self._drawn.clear(*(*sky.HAZE, alpha) if name == COLOR else (OUTPUTS[name].nothing,) * 4)
            self._drawn.depth_mask = False  # depths are cleared once
        self._drawn.depth_mask = True
        self.use()

    def use(self, color: bool = True, outputs: bool = True) -> None:
        """Bind it for drawing. `color` and `outputs` say which attachments are written."""
        self._write([name for name in self._names if (color if name == COLOR else outputs)])

    def _write(self, names: Sequence[str]) -> None:
        if len(self._names) > 1:
            self._drawn.color_mask = [(name in names,) * 4 for name in self._names]
        self._drawn.use()

    def read(self, colors: Callable[[np.ndarray], np.ndarray] | None = None) -> dict[str, np.ndarray]:
        """Return the rendered arrays by name, top row first.

        `colors` converts RGBA (height, width, 4) uint8 to the image; its argument is a buffer that is reused later.
        """
        wide, high = self._size
        read = {}
        for attachment, (name, dtype) in enumerate(self._outputs.items(), int(self._has_color)):
            output = OUTPUTS[name]
            drawn: np.ndarray = np.empty((high, wide, output.components)[: 2 + (output.components > 1)], dtype)
            options = {"viewport": (0, 0, wide, high), "components": output.components, "dtype": _dtype_name(dtype)}
            self._drawn.read_into(drawn, attachment=attachment, **options)
            read[name] = drawn[..., :3] if output.components > 1 else drawn.astype(output.dtype, copy=False)
        if colors is not None:
            if self._resolved is not self._drawn:
                self._gl.copy_framebuffer(self._resolved, self._drawn)
            self._resolved.read_into(self._rgba, viewport=(0, 0, wide, high), components=4)
            read[COLOR] = colors(self._rgba)
        return read


def _dtype_name(dtype: type) -> str:
    """Return moderngl's name of a dtype, such as f4."""
    return f"{'u' if np.issubdtype(dtype, np.integer) else 'f'}{np.dtype(dtype).itemsize}"


def without_alpha(rgba: np.ndarray, out: np.ndarray | None) -> np.ndarray:
    """Return RGB of RGBA, written into `out` if given; raises ValueError if that does not fit."""
    shape = (*rgba.shape[:2], 3)
    if out is None:
        out = np.empty(shape, dtype=np.uint8)
    elif out.shape != shape or out.dtype != np.uint8 or not out.flags.c_contiguous:
        raise ValueError(f"out must be a C-contiguous uint8 array of shape {shape}")
    return np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2RGB, dst=out))
