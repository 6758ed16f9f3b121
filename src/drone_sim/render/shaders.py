"""The shaders, GLSL 3.30. World coordinates have the world's axes and the camera as origin."""

# Projection of a point or direction. With several tiles everything is drawn for each tile, clipped to its rectangle.
VIEW = """
#version 330 core
#ifdef TILES
uniform mat4 clip_from_world[TILES];
uniform vec4 bounds[TILES];
out float gl_ClipDistance[4];
vec4 seen(vec4 point) {
    int tile = gl_InstanceID % TILES;
    vec4 p = clip_from_world[tile] * point;
    vec4 b = bounds[tile] * p.w;
    gl_ClipDistance[0] = p.x - b.x;
    gl_ClipDistance[1] = p.y - b.y;
    gl_ClipDistance[2] = b.z - p.x;
    gl_ClipDistance[3] = b.w - p.y;
    return p;
}
#else
uniform mat4 clip_from_world;
vec4 seen(vec4 point) { return clip_from_world * point; }
#endif
"""

# Per instance: the rows of the matrix world-from-mesh, which may scale. `paint.a` is the alpha written to the image.
INPUTS = (
    VIEW
    + """
in vec3 position;
in vec4 row0;
in vec4 row1;
in vec4 row2;
vec3 world_point() {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(row0, p), dot(row1, p), dot(row2, p));
}
"""
)

# Light is computed per vertex: floors and boxes have one normal per face, and round objects have enough vertices.
# FLAT saves the interpolation of the colour on floors, where it is constant.
SURFACE_VERTEX = (
    INPUTS
    + """
uniform vec3 to_sun;
in vec3 normal;
in vec4 paint;
#ifdef FLAT
flat
#endif
out vec4 colour;
#ifdef TEXTURED
in vec2 uv;
out vec2 texel;
#endif
void main() {
    vec3 n = normalize(vec3(dot(row0.xyz, normal), dot(row1.xyz, normal), dot(row2.xyz, normal)));
    vec3 ambient = mix(vec3(0.42, 0.41, 0.40), vec3(0.52, 0.54, 0.57), 0.5 + 0.5 * n.z);
    vec3 light = ambient + vec3(0.54, 0.52, 0.48) * max(0.85 * dot(n, to_sun) + 0.15, 0.0);
    colour = vec4(min(paint.rgb * light, 1.0), paint.a);
#ifdef TEXTURED
    texel = uv;
#endif
    gl_Position = seen(vec4(world_point(), 1.0));
}
"""
)

SURFACE_FRAGMENT = """
#version 330 core
#ifdef FLAT
flat
#endif
in vec4 colour;
#ifdef TEXTURED
in vec2 texel;
uniform sampler2D image;
#endif
layout(location = 0) out vec4 pixel;
void main() {
#ifdef TEXTURED
    pixel = colour * texture(image, texel);
#else
    pixel = colour;
#endif
}
"""

# Without colour: depth only, and the outputs that `with_outputs` adds.
BARE_VERTEX = (
    INPUTS
    + """
void main() {
    gl_Position = seen(vec4(world_point(), 1.0));
}
"""
)

BARE_FRAGMENT = """
#version 330 core
void main() {
}
"""

# A single object, for counting its pixels: all its fragments get the same depth; vertices are clipped as usual.
ALONE_VERTEX = (
    INPUTS
    + """
uniform float only;
in float identity;
void main() {
    gl_Position = identity == only ? seen(vec4(world_point(), 1.0)) : vec4(2.0, 2.0, 2.0, 1.0);
}
"""
)

ALONE_FRAGMENT = """
#version 330 core
void main() { gl_FragDepth = 0.5; }
"""

# Every vertex is projected along the light onto the floor; vertices below the floor only move vertically.
SHADOW_VERTEX = (
    INPUTS
    + """
uniform vec3 to_sun;
uniform float floor_height;
void main() {
    vec3 p = world_point();
    p.xy -= to_sun.xy * (max(p.z - floor_height, 0.0) / to_sun.z);
    gl_Position = seen(vec4(p.xy, floor_height, 1.0));
}
"""
)

SHADOW_FRAGMENT = """
#version 330 core
out vec4 pixel;
void main() { pixel = vec4(0.0, 0.0, 0.0, 1.0); }
"""

# A coarse dome around the camera, at the far plane, with vertices where the gradient changes.
SKY_VERTEX = (
    VIEW
    + """
in vec3 direction;
in vec3 tint;
out vec3 colour;
void main() {
    colour = tint;
    gl_Position = seen(vec4(direction, 0.0)).xyww;
}
"""
)

SKY_FRAGMENT = """
#version 330 core
in vec3 colour;
out vec4 pixel;
void main() { pixel = vec4(colour, 1.0); }
"""
