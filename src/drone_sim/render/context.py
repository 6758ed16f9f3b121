"""Creates an OpenGL context without a display."""

from __future__ import annotations

import os
from typing import Any

import moderngl

# glvnd's libEGL also resolves every GL function, so neither libGL nor libOpenGL has to be installed.
LIBEGL = "libEGL.so.1"
REQUIRED = 330
# Mesa's approximations of trilinear filtering save a tenth of the frame time of its CPU renderer without a visible
# difference; a GPU ignores them. Mesa reads the variable when the process creates its first context.
MESA_TUNING = ("GALLIVM_PERF", "brilinear,rho_approx")
DEVICES = 4  # to try: the user may lack permission to open the first, a graphics card


class RendererUnavailable(RuntimeError):
    """EGL provides no OpenGL context. The message is one line."""


def create(device_index: int) -> moderngl.Context:
    """Return a context of the EGL device with this index or, if that fails, of the next device that works."""
    os.environ.setdefault(*MESA_TUNING)
    reasons = []
    for index in range(device_index, device_index + DEVICES):
        try:
            settings: dict[str, Any] = {"backend": "egl", "libgl": LIBEGL, "libegl": LIBEGL, "device_index": index}
            return moderngl.create_context(require=REQUIRED, standalone=True, **settings)
        except Exception as error:  # moderngl raises bare Exceptions
            reasons.append(" ".join(str(error).split()))
    raise RendererUnavailable(f"no EGL context (Debian: apt install libegl1 libgl1-mesa-dri): {reasons[0]}")


def is_software(context: moderngl.Context) -> bool:
    """Return whether OpenGL renders on the CPU, where expensive texture filters should be off."""
    return any(name in context.info["GL_RENDERER"].lower() for name in ("llvmpipe", "softpipe", "swrast"))
