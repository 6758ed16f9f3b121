"""The shader programs, each compiled when it is first needed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import moderngl
import numpy as np

from drone_sim.render import shaders
from drone_sim.render.outputs import with_outputs

TO_SUN = (-0.34, 0.30, 0.89)  # world frame, about 27 degrees from the vertical
LOOKS = {"plain": (), "textured": ("TEXTURED",), "floor": ("TEXTURED", "FLAT")}  # of batches, and what these define
_SOURCES = {
    "surface": (shaders.SURFACE_VERTEX, shaders.SURFACE_FRAGMENT),
    "bare": (shaders.BARE_VERTEX, shaders.BARE_FRAGMENT),
    "alone": (shaders.ALONE_VERTEX, shaders.ALONE_FRAGMENT),
    "shadow": (shaders.SHADOW_VERTEX, shaders.SHADOW_FRAGMENT),
    "sky": (shaders.SKY_VERTEX, shaders.SKY_FRAGMENT),
}


class Role(NamedTuple):
    """What something is drawn as: a surface with its colours, bare, alone, a shadow, the sky; with what outputs.

    tiles: how often, each time into another part of the picture. parallel: whether the rays are, for the outputs.
    """

    kind: str
    outputs: tuple[str, ...] = ()
    tiles: int = 1
    parallel: bool = False


ALONE = Role("alone")


class Programs:
    """The programs of a context, by role; those of surfaces also by a batch's look."""

    def __init__(self, gl: moderngl.Context):
        """None has been compiled yet."""
        self._gl = gl
        self._made: dict[Role, Mapping[str, Any]] = {}
        self._to_sun = tuple(np.array(TO_SUN) / np.linalg.norm(TO_SUN))

    def of(self, role: Role) -> Mapping[str, Any]:
        """Return a role's programs, by look."""
        if role not in self._made:
            if role.kind == "surface":
                made = {look: self._compiled(role, defined) for look, defined in LOOKS.items()}
            else:
                made = dict.fromkeys(LOOKS, self._compiled(role))
            self._made[role] = made
        return self._made[role]

    def one(self, role: Role) -> Any:
        """Return the program of a role in which all looks are alike."""
        return self.of(role)["plain"]

    def _compiled(self, role: Role, defined: tuple[str, ...] = ()) -> Any:
        vertex, fragment = _SOURCES[role.kind]
        if role.outputs:
            vertex, fragment = with_outputs(vertex, fragment, role.outputs, first=int(role.kind == "surface"))
        if role.tiles > 1:
            defined = *defined, f"TILES {role.tiles}"
        if role.parallel:
            defined = *defined, "PARALLEL"
        start = "\n".join(["#version 330 core", *(f"#define {name}" for name in defined)])
        vertex, fragment = (one.replace("#version 330 core", start).lstrip() for one in (vertex, fragment))
        program = self._gl.program(vertex_shader=vertex, fragment_shader=fragment)
        if "to_sun" in program:
            program["to_sun"] = self._to_sun
        return program
