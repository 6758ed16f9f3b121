"""The shader programs, each compiled at its first use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import moderngl
import numpy as np

from drone_sim.render import shaders
from drone_sim.render.outputs import with_outputs

TO_SUN = (-0.34, 0.30, 0.89)  # world frame, about 27 degrees from the vertical
# Look of a batch: GLSL macros that its shaders define.
LOOKS = {"plain": (), "textured": ("TEXTURED",), "floor": ("TEXTURED", "FLAT")}
_SOURCES = {
    "surface": (shaders.SURFACE_VERTEX, shaders.SURFACE_FRAGMENT),
    "bare": (shaders.BARE_VERTEX, shaders.BARE_FRAGMENT),
    "alone": (shaders.ALONE_VERTEX, shaders.ALONE_FRAGMENT),
    "shadow": (shaders.SHADOW_VERTEX, shaders.SHADOW_FRAGMENT),
    "sky": (shaders.SKY_VERTEX, shaders.SKY_FRAGMENT),
}


class Role(NamedTuple):
    """A purpose of a draw call, a key of `_SOURCES`, and its `outputs`.

    tiles: how often everything is drawn, each time into another part of the image. parallel: whether the camera is
    orthographic, which changes the outputs' shaders.
    """

    kind: str
    outputs: tuple[str, ...] = ()
    tiles: int = 1
    parallel: bool = False


ALONE = Role("alone")


class Programs:
    """The shader programs of a context, by role and look; only surfaces differ by look."""

    def __init__(self, gl: moderngl.Context):
        """Compile nothing yet."""
        self._gl = gl
        self._programs: dict[Role, Mapping[str, Any]] = {}
        self._to_sun = tuple(np.array(TO_SUN) / np.linalg.norm(TO_SUN))

    def of(self, role: Role) -> Mapping[str, Any]:
        if role not in self._programs:
            if role.kind == "surface":
                programs = {look: self._compile(role, defined) for look, defined in LOOKS.items()}
            else:
                programs = dict.fromkeys(LOOKS, self._compile(role))
            self._programs[role] = programs
        return self._programs[role]

    def one(self, role: Role) -> Any:
        """Return the program of a role that does not depend on the look."""
        return self.of(role)["plain"]

    def _compile(self, role: Role, defined: tuple[str, ...] = ()) -> Any:
        vertex, fragment = _SOURCES[role.kind]
        if role.outputs:
            vertex, fragment = with_outputs(vertex, fragment, role.outputs, first=int(role.kind == "surface"))
        if role.tiles > 1:
            defined = *defined, f"TILES {role.tiles}"
        if role.parallel:
            defined = *defined, "PARALLEL"
        start = "\n".join(["#version 330 core", *(f"#define {name}" for name in defined)])
        vertex, fragment = (source.replace("#version 330 core", start).lstrip() for source in (vertex, fragment))
        program = self._gl.program(vertex_shader=vertex, fragment_shader=fragment)
        if "to_sun" in program:
            program["to_sun"] = self._to_sun
        return program
