"""What a picture is made of besides its colours: for each pixel a depth, an instance, a normal, a place before.

An output is a line of `OUTPUTS`. Any of them are drawn in one pass, with the colours or without, into an attachment
each: how many are asked for at once hardly matters. Attachments hold whole numbers, the bits of floats, since these are
not blended where there is glass.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

COLOR = "color"  # the picture itself, which may be asked for like an output


@dataclass(frozen=True)
class Output:
    """A quantity for each pixel.

    components, dtype: of a pixel; all are 0 where nothing is. vertex, fragment: GLSL that computes the `value` that the
    pixel gets, from the vertices' and instances' attributes in `inputs`, by what `declared` hands on; `point` stands
    for the vertex's place in the world relative to the camera.
    """

    components: int
    dtype: type
    fragment: str
    declared: str = ""  # what the vertex shader hands on, without in or out
    vertex: str = ""
    uniforms: str = ""
    inputs: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether it counts something."""
        return bool(np.issubdtype(self.dtype, np.integer))

    @property
    def kind(self) -> str:
        """The GLSL type of `value`."""
        return self.held_as if self.is_whole else _glsl("float", "vec", self.components)

    @property
    def held_as(self) -> str:
        """The GLSL type of what the attachment holds."""
        return _glsl("uint", "uvec", self.components)

    @property
    def bits(self) -> str:
        """What the attachment holds of `value`."""
        return "value" if self.is_whole else "floatBitsToUint(value)"


def _glsl(one: str, several: str, components: int) -> str:
    return one if components == 1 else f"{several}{components}"


OUTPUTS: Mapping[str, Output] = {
    # The clip w is the optical z in perspective. Where rays are parallel, depth is `parallel.x`, the near plane's, and
    # the buffer's part of `parallel.y`, the way to the far one.
    "depth": Output(
        1,
        np.float32,
        "value = parallel.y > 0.0 ? parallel.x + parallel.y * gl_FragCoord.z : 1.0 / gl_FragCoord.w;",
        uniforms="uniform vec2 parallel;",
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
    outs = [f"layout(location = {place}) out {one.held_as} out{place};" for place, one in enumerate(chosen, first)]
    drawn = [
        f"{{ {one.kind} value; {one.fragment} out{place} = {one.bits}; }}" for place, one in enumerate(chosen, first)
    ]
    return (
        _extended(vertex, [*inputs, *uniforms, *passed("out")], moved),
        _extended(fragment, [*uniforms, *passed("in"), *outs], drawn),
    )


def _extended(source: str, declared: Sequence[str], statements: Sequence[str]) -> str:
    """Return a shader that declares more before its main, and does more at its end."""
    before, main, body = source.partition("void main() {")
    return "\n".join([before, *declared, main + body.rstrip().removesuffix("}"), *statements, "}"])


def finished(name: str, drawn: np.ndarray) -> np.ndarray:
    """Return an output as `Renderer.render_outputs` hands it out."""
    if name == "depth":  # in half the time of an assignment by a mask
        cv2.copyTo(_nothing(drawn.shape), (drawn == 0.0).view(np.uint8), drawn)
    if name == "before":
        drawn[drawn[..., 3] == 0.0] = np.nan
    return drawn[..., :3] if drawn.ndim == 3 else drawn


@lru_cache(maxsize=8)
def _nothing(shape: tuple[int, ...]) -> np.ndarray:
    return np.full(shape, np.nan, dtype=np.float32)
