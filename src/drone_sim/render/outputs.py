"""Per-pixel outputs of the renderer besides colour: depth, instance, normal, and position in the previous image.

Each output is an entry of `OUTPUTS`. Any selection of them is rendered in one pass, with or without colour, each into
its framebuffer attachment: the number of outputs hardly changes the time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

COLOR = "color"  # the image itself, which can be requested like an output


@dataclass(frozen=True)
class Output:
    """A quantity for each pixel.

    components, dtype: of a pixel; each component is `nothing` where no surface is. vertex, fragment: GLSL that computes
    the pixel's `value` from the vertex and instance attributes in `inputs`, through the varyings in `declared`; `point`
    is the vertex position in world axes relative to the camera.
    """

    components: int
    dtype: type
    fragment: str
    declared: str = ""  # varyings, without `in` or `out`
    vertex: str = ""
    uniforms: str = ""
    inputs: str = ""
    nothing: float = 0.0

    @property
    def is_whole(self) -> bool:
        """Whether its values are integers."""
        return bool(np.issubdtype(self.dtype, np.integer))

    def held(self, most: int) -> type:
        """Return the attachment's dtype for values up to `most`: the CPU renderer is fastest with bytes."""
        return np.uint8 if self.is_whole and most <= np.iinfo(np.uint8).max else self.dtype

    @property
    def kind(self) -> str:
        """The GLSL type of `value`."""
        scalar, vector = ("uint", "uvec") if self.is_whole else ("float", "vec")
        return scalar if self.components == 1 else f"{vector}{self.components}"


OUTPUTS: Mapping[str, Output] = {
    # In perspective, the clip w is the optical z. With parallel rays, depth is `parallel.x` (the near plane) plus the
    # buffer's share of `parallel.y` (far - near). A run-time branch per pixel would double the time.
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
    # A unit vector in the optical frame, towards the camera.
    "normal": Output(
        4,
        np.float32,
        "vec3 n = normalize(normal_); value = vec4(dot(n, ray_) > 0.0 ? -n : n, 1.0);",
        declared="vec3 normal_; vec3 ray_;",
        vertex=(
            "mat3 m = transpose(mat3(row0.xyz, row1.xyz, row2.xyz));"
            " vec3 n = normal / vec3(dot(m[0], m[0]), dot(m[1], m[1]), dot(m[2], m[2]));"  # divided by the scale twice
            " normal_ = mat3(optical_from_world) * (m * n); ray_ = mat3(optical_from_world) * point;"
        ),
        uniforms="uniform mat4 optical_from_world;",
        inputs="in vec3 normal;",
    ),
    # Position of the surface point at the previous image, in the optical frame of that image, m.
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
    """Return the vertex and fragment shader extended by these outputs, which use the attachments from `first` on."""
    chosen = [OUTPUTS[name] for name in names]
    varyings = [part.strip() for output in chosen for part in output.declared.split(";") if part.strip()]

    def declare(direction: str) -> list[str]:
        return [
            f"flat {direction} {part.removeprefix('flat ')};" if part.startswith("flat ") else f"{direction} {part};"
            for part in varyings
        ]

    uniforms = [output.uniforms for output in chosen]
    inputs = [output.inputs for output in chosen if output.inputs not in vertex]
    statements = ["vec3 point = world_point();", *(f"{{ {output.vertex} }}" for output in chosen)]
    outs = [f"layout(location = {place}) out {output.kind} out{place};" for place, output in enumerate(chosen, first)]
    drawn = [
        f"{{ {output.kind} value; {output.fragment} out{place} = value; }}"
        for place, output in enumerate(chosen, first)
    ]
    return (
        _extended(vertex, [*inputs, *uniforms, *declare("out")], statements),
        _extended(fragment, [*uniforms, *declare("in"), *outs], drawn),
    )


def _extended(source: str, declared: Sequence[str], statements: Sequence[str]) -> str:
    """Return a shader with more declarations before its `main` and more statements at the end of `main`."""
    before, main, body = source.partition("void main() {")
    return "\n".join([before, *declared, main + body.rstrip().removesuffix("}"), *statements, "}"])
