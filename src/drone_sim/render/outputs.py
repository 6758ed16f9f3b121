"""What a picture is made of besides its colours: for each pixel a depth, an instance, a normal, a place before.

An output is a line of `OUTPUTS`. Any of them are drawn in one pass, into a picture each: how many are asked for at once
hardly matters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drone_sim.render.shaders import INPUTS


@dataclass(frozen=True)
class Output:
    """A quantity for each pixel.

    components, dtype: of the picture, as OpenGL has it ("f4", "u2"); all are 0 where nothing is. vertex, fragment:
    GLSL that computes what the pixel gets, from the vertices' and instances' attributes in `inputs`, by what `declared`
    hands on; `OUT` stands for the pixel, `point` for the vertex's place in the world relative to the camera.
    """

    components: int
    dtype: str
    fragment: str
    declared: str = ""  # what the vertex shader hands on, without in or out
    vertex: str = ""
    uniforms: str = ""
    inputs: str = ""

    @property
    def kind(self) -> str:
        """The GLSL type of a pixel."""
        vector = {1: "", 2: "2", 4: "4"}[self.components]
        return "uint" if self.dtype == "u2" else f"vec{vector}" if vector else "float"


OUTPUTS: Mapping[str, Output] = {
    # The clip w is the optical z in perspective. Where rays are parallel, depth is `parallel.x`, the near plane's, and
    # the buffer's part of `parallel.y`, the way to the far one.
    "depth": Output(
        1,
        "f4",
        "OUT = parallel.y > 0.0 ? parallel.x + parallel.y * gl_FragCoord.z : 1.0 / gl_FragCoord.w;",
        uniforms="uniform vec2 parallel;",
    ),
    "instance": Output(
        1,
        "u2",
        "OUT = uint(identity_ + 0.5);",
        declared="flat float identity_;",
        vertex="identity_ = identity;",
        inputs="in float identity;",
    ),
    # In the optical frame, of unit length, towards who looks.
    "normal": Output(
        4,
        "f4",
        "vec3 n = normalize(normal_); OUT = vec4(dot(n, ray_) > 0.0 ? -n : n, 1.0);",
        declared="vec3 normal_; vec3 ray_;",
        vertex=(
            "mat3 m = transpose(mat3(row0.xyz, row1.xyz, row2.xyz));"
            " vec3 n = normal / vec3(dot(m[0], m[0]), dot(m[1], m[1]), dot(m[2], m[2]));"  # by the inverse scale twice
            " normal_ = mat3(optical_from_world) * (m * n); ray_ = mat3(optical_from_world) * point;"
        ),
        uniforms="uniform mat4 optical_from_world;",
        inputs="in vec3 normal;",
    ),
    # Where what is seen was in the picture before, in that one's optical frame, m.
    "before": Output(
        4,
        "f4",
        "OUT = vec4(before_, 1.0);",
        declared="vec3 before_;",
        vertex=(
            "vec4 p = vec4(position, 1.0);"
            " before_ = mat3(optical_before_from_world) * vec3(dot(before0, p), dot(before1, p), dot(before2, p));"
        ),
        uniforms="uniform mat4 optical_before_from_world;",
        inputs="in vec4 before0; in vec4 before1; in vec4 before2;",
    ),
}


# One object alone, whose fragments are counted.
ALONE_VERTEX = (
    INPUTS
    + """
uniform float only;
in float identity;
void main() {
    gl_Position = identity == only ? clip_from_world * vec4(world_point(), 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
"""
)
ALONE_FRAGMENT = """
#version 330 core
void main() {}
"""


def sources(names: Sequence[str]) -> tuple[str, str]:
    """Return vertex and fragment shader that draw these outputs, into one attachment each, in their order."""
    chosen = [OUTPUTS[name] for name in names]
    handed = [part.strip() for one in chosen for part in one.declared.split(";") if part.strip()]

    def passed(way: str) -> str:
        flat = [
            f"flat {way} {one.removeprefix('flat ')};" if one.startswith("flat ") else f"{way} {one};" for one in handed
        ]
        return "\n".join(flat)

    uniforms = "\n".join(one.uniforms for one in chosen)
    vertex = "\n".join([
        INPUTS, *(one.inputs for one in chosen), uniforms, passed("out"), "void main() {",
        "vec3 point = world_point(); gl_Position = clip_from_world * vec4(point, 1.0);",
        *(f"{{ {one.vertex} }}" for one in chosen), "}",
    ])  # fmt: skip
    outs = [f"layout(location = {place}) out {one.kind} out{place};" for place, one in enumerate(chosen)]
    fragment = "\n".join([
        "#version 330 core", uniforms, passed("in"), *outs, "void main() {",
        *(f"{{ {one.fragment.replace('OUT', f'out{place}')} }}" for place, one in enumerate(chosen)), "}",
    ])  # fmt: skip
    return vertex, fragment


def finished(name: str, drawn: np.ndarray) -> np.ndarray:
    """Return an output as `Renderer.render_outputs` hands it out."""
    if name == "depth":
        drawn[drawn == 0.0] = np.nan
    if name == "before":
        drawn[drawn[..., 3] == 0.0] = np.nan
    return drawn[..., :3] if drawn.ndim == 3 else drawn
