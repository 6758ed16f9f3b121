"""What a picture is made of besides its colours: for each pixel a depth, an instance, a normal, a place before.

An output is a line of `OUTPUTS`. Any of them are drawn in one pass, with the colours or without, into an attachment
each: how many are asked for at once hardly matters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

COLOR = "color"  # the picture itself, which may be asked for like an output


@dataclass(frozen=True)
class Output:
    """A quantity for each pixel.

    components, dtype: of a pixel; all are `nothing` where nothing is. vertex, fragment: GLSL that computes the `value`
    that the pixel gets, from the vertices' and instances' attributes in `inputs`, by what `declared` hands on; `point`
    stands for the vertex's place in the world relative to the camera.
    """

    components: int
    dtype: type
    fragment: str
    declared: str = ""  # what the vertex shader hands on, without in or out
    vertex: str = ""
    uniforms: str = ""
    inputs: str = ""
    nothing: float = 0.0

    @property
    def is_whole(self) -> bool:
        """Whether it counts something."""
        return bool(np.issubdtype(self.dtype, np.integer))

    def held(self, most: int) -> type:
        """The dtype that an attachment has, if numbers are at most `most`: the CPU draws bytes fastest."""
        return np.uint8 if self.is_whole and most <= np.iinfo(np.uint8).max else self.dtype

    @property
    def kind(self) -> str:
        """The GLSL type of `value`."""
        one, several = ("uint", "uvec") if self.is_whole else ("float", "vec")
        return one if self.components == 1 else f"{several}{self.components}"


OUTPUTS: Mapping[str, Output] = {
    # The clip w is the optical z in perspective. Where rays are parallel, depth is `parallel.x`, the near plane's, and
    # the buffer's part of `parallel.y`, the way to the far one. A choice for each pixel would take twice the time.
    "depth": Output(
        1,
        np.float32,
        (
            "\n#ifdef PARALLEL\n value = parallel.x + parallel.y * gl_FragCoord.z;"
            "\n#else\n value = 1.0 / gl_FragCoord.w;\n#endif\n"
        ),
        uniforms="uniform vec2 parallel;",
        nothing=np.nan,
    ),
    "instance": Output(
        1,
        np.uint16,
        "value = uint(identity_ + 0.5);",
        declared="flat float identity_;",
        vertex="identity_ = identity;",
        inputs="in float identity;",
    ),
    # In the optical frame, of unit length, towards who looks.
    "normal": Output(
        4,
        np.float32,
        "vec3 n = normalize(normal_); value = vec4(dot(n, ray_) > 0.0 ? -n : n, 1.0);",
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
        np.float32,
        "value = vec4(before_, 1.0);",
        declared="vec3 before_;",
        vertex=(
            "vec4 p = vec4(position, 1.0);"
            " before_ = mat3(optical_before_from_world) * vec3(dot(before0, p), dot(before1, p), dot(before2, p));"
        ),
        uniforms="uniform mat4 optical_before_from_world;",
        inputs="in vec4 before0; in vec4 before1; in vec4 before2;",
        nothing=np.nan,
    ),
}


def with_outputs(vertex: str, fragment: str, names: Sequence[str], first: int) -> tuple[str, str]:
    """Return shaders that draw these outputs, too, into the attachments from `first` on."""
    chosen = [OUTPUTS[name] for name in names]
    handed = [part.strip() for one in chosen for part in one.declared.split(";") if part.strip()]

    def passed(way: str) -> list[str]:
        return [
            f"flat {way} {one.removeprefix('flat ')};" if one.startswith("flat ") else f"{way} {one};" for one in handed
        ]

    uniforms = [one.uniforms for one in chosen]
    inputs = [one.inputs for one in chosen if one.inputs not in vertex]
    moved = ["vec3 point = world_point();", *(f"{{ {one.vertex} }}" for one in chosen)]
    outs = [f"layout(location = {place}) out {one.kind} out{place};" for place, one in enumerate(chosen, first)]
    drawn = [f"{{ {one.kind} value; {one.fragment} out{place} = value; }}" for place, one in enumerate(chosen, first)]
    return (
        _extended(vertex, [*inputs, *uniforms, *passed("out")], moved),
        _extended(fragment, [*uniforms, *passed("in"), *outs], drawn),
    )


def _extended(source: str, declared: Sequence[str], statements: Sequence[str]) -> str:
    """Return a shader that declares more before its main, and does more at its end."""
    before, main, body = source.partition("void main() {")
    return "\n".join([before, *declared, main + body.rstrip().removesuffix("}"), *statements, "}"])
