"""An OpenGL context without a display."""

from __future__ import annotations

import os
from typing import Any

import moderngl

# glvnd's libEGL hands out every GL function too, so neither libGL nor libOpenGL has to be installed.
LIBEGL = "libEGL.so.1"
REQUIRED = 330
# Mesa's own approximations of trilinear filtering: a tenth off a frame's time where the CPU draws, no visible
# difference, no effect elsewhere. Read by Mesa when it makes its first context in the process.
MESA_TUNING = ("GALLIVM_PERF", "brilinear,rho_approx")
DEVICES = 4  # how many devices to try: the first may be a graphics card that this user may not open


class RendererUnavailable(RuntimeError):
    """No OpenGL context can be had through EGL; the message is one line."""


def create(device_index: int) -> moderngl.Context:
    """A context of the EGL device with this index or, where that fails, of the next that works."""
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
    """Whether the CPU draws, so that costly texture filters should be left alone."""
    return any(name in context.info["GL_RENDERER"].lower() for name in ("llvmpipe", "softpipe", "swrast"))
