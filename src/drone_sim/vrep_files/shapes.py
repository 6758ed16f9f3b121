"""Reads shapes, with mass and inertia: a mesh with its texture, or a compound of meshes and compounds.

A mesh has vertices and faces, stored in place or in pools shared by all shapes, a colour, and may be a primitive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from drone_sim.mechanics.state import Pose
from drone_sim.vrep_files.chunks import Level, finite, level, levels, position_first, quaternion_first, unpack
from drone_sim.vrep_files.model import (
    Rgba,
    VrepCover,
    VrepFileError,
    VrepInertia,
    VrepMesh,
    VrepPrimitive,
    VrepShape,
    VrepTexture,
)

MAX_TRIANGLES = 3_000_000  # of a file
_PRIMITIVES = ("", "plane", "disc", "cuboid", "spheroid", "cylinder", "cone", "heightfield", "capsule")
_NO_OPACITY = 4  # bit of `Var`: ignore `Trf`
_GREY: Rgba = (0.7, 0.7, 0.7, 1.0)
_MAX_SIDE = 4096  # px
_HAS_OPACITY, _DECAL = 0x01, 1
_PLANE, _CUBE = 0, 3  # projections of a texture onto a mesh
_MAX_REPEATS = 1e4  # of a texture on a mesh
_PACKED_OFFSETS = (31, 8191, 2097151, 536870911)  # offset of a packed index difference with 0 to 3 extra bytes


@dataclass
class Pools:
    """Vertices, faces and textures that are stored once in a file and shared by its shapes."""

    vertices: list[np.ndarray] = field(default_factory=list)
    faces: list[np.ndarray] = field(default_factory=list)
    textures: dict[int, VrepTexture] = field(default_factory=dict)
    triangles: int = 0  # read so far, shared meshes counted repeatedly

    def add(self, data: bytes, tag: str) -> None:
        """Add the pools of a `VIN` chunk, or the texture of a `TEX` chunk. Raises VrepFileError."""
        if tag == "TEX":
            self.textures.update([_read_texture(data)])
            return
        for chunk in level(data).chunks:
            if chunk.tag == "Ver":
                self.vertices.append(_vertices(chunk.data))
            elif chunk.tag == "Ind":
                self.faces.append(_triples(np.frombuffer(chunk.data[: len(chunk.data) // 4 * 4], "<i4"), "Ind"))
            elif chunk.tag == "In2":
                self.faces.append(_packed(chunk.data))


def read_mesh(outside: Level, inside: Level, pools: Pools) -> VrepMesh:
    """Return the mesh from its wrapper level (outside) and mesh level (inside). Raises VrepFileError."""
    pose = position_first(inside.numbers("_pf", "Ppf", 7), "_pf")
    transform = np.array(pose.matrix).reshape(3, 4)
    vertices = _from_pool(inside, ("Vev", "Ver"), pools.vertices, _vertices)
    faces = _from_pool(inside, ("Inv", "In2"), pools.faces, _packed)
    pools.triangles += len(faces)
    if pools.triangles > MAX_TRIANGLES:
        raise VrepFileError(f"has more than {MAX_TRIANGLES} triangles")
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise VrepFileError("a face refers to a vertex that does not exist")
    cover = _read_cover(inside, vertices, faces, pools.textures)
    placed = vertices @ transform[:, :3].T + transform[:, 3]
    return VrepMesh(placed, faces, _color(inside), _primitive(inside, pose), cover)


def _from_pool(
    inside: Level, tags: tuple[str, str], pool: list[np.ndarray], read: Callable[[bytes], np.ndarray]
) -> np.ndarray:
    """Return the array in the pool at the index of the first tag or, without it, the array under the second tag."""
    index = inside.integer(tags[0], default=-1)
    if inside.find(tags[0]) is None:
        data = inside.find(tags[1])
        return np.zeros((0, 3), int) if data is None else read(data)
    if not 0 <= index < len(pool):
        raise VrepFileError(f"{tags[0]}: the file has no mesh {index}")
    return pool[index]


def _vertices(data: bytes) -> np.ndarray:
    vertices = _triples(np.frombuffer(data[: len(data) // 4 * 4], "<f4"), "Ver").astype(float)
    if not (np.abs(vertices) < 1e6).all():  # also false for NaN
        raise VrepFileError("Ver: a vertex is not finite or more than 1000 km away")
    return vertices


def _triples(values: np.ndarray, tag: str) -> np.ndarray:
    if len(values) % 3:
        raise VrepFileError(f"{tag}: {len(values)} numbers; must be a multiple of 3")
    return values.reshape(-1, 3)


def _packed(data: bytes) -> np.ndarray:
    """Return the faces of an `In2` chunk: differences of indices, each packed into 1 to 4 bytes."""
    count = unpack("<i", data, "In2")[0]
    if not 0 <= count <= len(data) - 4:
        raise VrepFileError(f"In2: {count} indices do not fit")
    indices, at, index = [], 4, 0
    for _ in range(count):
        extra = data[at] >> 6 if at < len(data) else 0
        piece = data[at : at + 1 + extra]
        if len(piece) != 1 + extra:
            raise VrepFileError("In2: is truncated")
        difference = piece[0] & 63
        for number, byte in enumerate(piece[1:]):
            difference += byte << (6 + 8 * number)
        index += difference - _PACKED_OFFSETS[extra]
        indices.append(index)
        at += 1 + extra
    return _triples(np.array(indices, dtype=np.int64), "In2")


def _primitive(inside: Level, pose: Pose) -> VrepPrimitive | None:
    data = inside.find("_pr", "Ppr")
    if data is None:
        return None
    width = "d" if inside.find("_pr") is not None else "f"
    kind, *size = unpack(f"<i3{width}", data, "_pr")
    if not 0 < kind < len(_PRIMITIVES):
        return None
    x, y, z = finite(tuple(size), "_pr")
    return VrepPrimitive(_PRIMITIVES[kind], (abs(x), abs(y), abs(z)), pose)


def _color(inside: Level) -> Rgba:
    data = inside.find("Cl0")
    if data is None:
        return _GREY
    parts = level(data)
    opacity = 1.0
    if not parts.bits("Var") & _NO_OPACITY and parts.find("Trf") is not None:
        opacity = min(1.0, max(0.0, finite(unpack("<f", parts.find("Trf") or b"", "Trf"), "Trf")[0]))
    red, green, blue = (min(1.0, max(0.0, value)) for value in _rgb(parts))
    return red, green, blue, opacity


def _rgb(parts: Level) -> Sequence[float]:
    """Return red, green and blue. `Cl3` has one colour; older chunks have ambient and diffuse colours."""
    data = parts.find("Cl3")
    if data is not None:
        return finite(unpack("<3f", data, "Cl3"), "Cl3")
    data = parts.find("Cl2", "Cls")
    if data is None:
        return _GREY[:3]
    light = finite(unpack("<6f", data, "Cl2"), "Cl2")
    diffuse = sum(light[3:]) / 3
    return [(ambient + diffuse / 2) / 0.85 for ambient in light[:3]]


_MAX_DEPTH = 16  # of nested compounds
_MAX_MESHES = 20_000  # of a shape
_MESHES, _COMPOUNDS = ("Gst", "Geo"), ("Gsg", "Wrp")
_NOT_STATIC, _RESPONDABLE = 0x80, 0x01


def read_shape(class_level: Level, pools: Pools) -> VrepShape:
    """Return a shape from its class level. Raises VrepFileError."""
    mass, inertia, meshes = 1.0, None, []
    data = class_level.find("Ge2")
    for chunk in levels(data, 2)[0].chunks if data is not None else ():
        if chunk.tag in (*_MESHES, *_COMPOUNDS):
            wrapper = levels(chunk.data, 3)[0]
            mass = max(0.0, *(wrapper.numbers("_as", "Mas", 1) or (1.0,)))
            inertia = _inertia(wrapper)
            meshes += _meshes(chunk.tag, chunk.data, pools, 0)
    return VrepShape(
        meshes=tuple(meshes),
        mass=mass,
        inertia=inertia,
        is_dynamic=bool(class_level.bits("Sss") & _NOT_STATIC),
        is_respondable=bool(class_level.bits("Ss3", "Ss2") & _RESPONDABLE),
    )


def _meshes(tag: str, data: bytes, pools: Pools, depth: int) -> list[VrepMesh]:
    if depth > _MAX_DEPTH:
        raise VrepFileError(f"compounds are nested deeper than {_MAX_DEPTH}")
    object_levels = levels(data, 3)
    if tag in _MESHES:
        return [read_mesh(object_levels[0], object_levels[1] if len(object_levels) > 1 else Level(), pools)]
    meshes: list[VrepMesh] = []
    for part in (part for inner in object_levels for part in inner.chunks if part.tag in (*_MESHES, *_COMPOUNDS)):
        meshes += _meshes(part.tag, part.data, pools, depth + 1)
        if len(meshes) > _MAX_MESHES:
            raise VrepFileError(f"a compound has more than {_MAX_MESHES} meshes")
    return meshes


def _inertia(wrapper: Level) -> VrepInertia | None:
    numbers = wrapper.numbers("_ne", "Ine", 10)
    if numbers is None:
        return None
    a, b, c = (max(0.0, value) for value in numbers[7:])
    return VrepInertia(position_first(numbers[:7], "_ne"), (a, b, c))


# ---- textures


def _read_texture(data: bytes) -> tuple[int, VrepTexture]:
    """Return the number and the texture of a `TEX` chunk. Raises VrepFileError."""
    texture = level(data)
    number, width, height = texture.integers("Ipa", count=3) or (-1, 0, 0)
    channels = 4 if texture.bits("Bst") & _HAS_OPACITY else 3
    pixels = texture.find("Img") or b""
    if not (0 < width <= _MAX_SIDE and 0 < height <= _MAX_SIDE) or len(pixels) != width * height * channels:
        raise VrepFileError(f"a texture of {width} x {height} px in {len(pixels)} bytes")
    image = np.frombuffer(pixels, np.uint8).reshape(height, width, channels)
    return number, VrepTexture(texture.text("Gon"), np.ascontiguousarray(image[::-1]))


def _read_cover(
    inside: Level, vertices: np.ndarray, faces: np.ndarray, textures: Mapping[int, VrepTexture]
) -> VrepCover | None:
    """Return the texture mapping of a mesh with these vertices in the mesh's frame; None if unknown or without texture.

    Raises VrepFileError.
    """
    data = inside.find("Toj")
    if data is None:
        return None
    cover = level(data)
    number, projection = unpack("<2i", cover.find("_ob", "Tob") or bytes(8), "_ob")
    texture = textures.get(number)
    corners = None if texture is None else _stored_uv(cover, len(faces))
    if texture is None or (corners is None and projection not in (_PLANE, _CUBE)):
        return None
    if corners is None:
        corners = _projected_uv(cover, vertices[faces], projection == _CUBE, texture)
    if not (np.abs(corners) < _MAX_REPEATS).all():  # also false for NaN
        return None
    return VrepCover(texture, corners, cover.integer("Apm") == _DECAL)


def _stored_uv(cover: Level, count: int) -> np.ndarray | None:
    """Return the uv coordinates (count, 3, 2) stored in the file; None if there are none."""
    data = cover.find("Ftc") or b""
    if len(data) != count * 24 or not data:
        return None
    return np.frombuffer(data, "<f4").reshape(-1, 3, 2).astype(float)


def _projected_uv(cover: Level, corners: np.ndarray, on_cube: bool, texture: VrepTexture) -> np.ndarray:
    """Return uv (m, 3, 2) of triangles (m, 3, 3), projected along z, or along the axis closest to each normal."""
    pose = quaternion_first(cover.numbers("_rc", "Trc", 7), "_rc")
    transform = np.array(pose.matrix).reshape(3, 4)
    local = (corners - transform[:, 3]) @ transform[:, :3]
    axes = np.tile([0, 1], (len(local), 1))
    if on_cube:
        normals = np.abs(np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0]))
        axes = np.array([[1, 2], [2, 0], [0, 1]])[normals.argmax(axis=1)]
    flat = np.take_along_axis(local, axes[:, None, :].repeat(3, axis=1), axis=2)
    height, width = texture.image.shape[:2]
    larger = max(width, height)
    form = "<8x2d" if cover.find("_ob") is not None else "<8x2f"
    scaling = np.array(unpack(form, cover.find("_ob", "Tob") or b"", "_ob"))
    size = scaling * (width / larger, height / larger)
    return flat / np.where(size == 0, 1.0, size) + 0.5
