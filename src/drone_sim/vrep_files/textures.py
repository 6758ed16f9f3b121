"""Textures: images that stand once in a file, and how a mesh is covered with one of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drone_sim.vrep_files.chunks import Level, level, quaternion_first, unpack
from drone_sim.vrep_files.model import VrepCover, VrepFileError, VrepTexture

_MAX_SIDE = 4096  # px
_HAS_OPACITY, _DECAL = 0x01, 1
_PLANE, _CUBE = 0, 3  # ways to project a texture on a mesh
_FARTHEST = 1e4  # times that a texture may be repeated


def read_texture(data: bytes) -> tuple[int, VrepTexture]:
    """Return the number of a texture, and the texture, of a `TEX`. Raises VrepFileError."""
    found = level(data)
    number, width, height = found.integers("Ipa", count=3) or (-1, 0, 0)
    channels = 4 if found.bits("Bst") & _HAS_OPACITY else 3
    pixels = found.find("Img") or b""
    if not (0 < width <= _MAX_SIDE and 0 < height <= _MAX_SIDE) or len(pixels) != width * height * channels:
        raise VrepFileError(f"a texture of {width} x {height} px in {len(pixels)} bytes")
    image = np.frombuffer(pixels, np.uint8).reshape(height, width, channels)
    return number, VrepTexture(found.text("Gon"), np.ascontiguousarray(image[::-1]))


def read_cover(
    inside: Level, vertices: np.ndarray, faces: np.ndarray, textures: Mapping[int, VrepTexture]
) -> VrepCover | None:
    """Return what covers a mesh, by its level, and its vertices in its own frame; None where nothing known does.

    Raises VrepFileError.
    """
    data = inside.find("Toj")
    if data is None:
        return None
    own = level(data)
    number, way = unpack("<2i", own.find("_ob", "Tob") or bytes(8), "_ob")
    texture = textures.get(number)
    corners = None if texture is None else _fixed(own, len(faces))
    if texture is None or (corners is None and way not in (_PLANE, _CUBE)):
        return None
    if corners is None:
        corners = _projected(own, vertices[faces], way == _CUBE, texture)
    if not (np.abs(corners) < _FARTHEST).all():  # nor a NaN
        return None
    return VrepCover(texture, corners, own.integer("Apm") == _DECAL)


def _fixed(own: Level, count: int) -> np.ndarray | None:
    """Return coordinates (count, 3, 2) that stand in the file, None where none do."""
    data = own.find("Ftc") or b""
    if len(data) != count * 24 or not data:
        return None
    return np.frombuffer(data, "<f4").reshape(-1, 3, 2).astype(float)


def _projected(own: Level, corners: np.ndarray, on_cube: bool, texture: VrepTexture) -> np.ndarray:
    """Return coordinates (m, 3, 2) of triangles (m, 3, 3), seen along z, or along the axis that each faces."""
    pose = quaternion_first(own.numbers("_rc", "Trc", 7), "_rc")
    turn = np.array(pose.matrix).reshape(3, 4)
    seen = (corners - turn[:, 3]) @ turn[:, :3]
    axes = np.tile([0, 1], (len(seen), 1))
    if on_cube:
        normals = np.abs(np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0]))
        axes = np.array([[1, 2], [2, 0], [0, 1]])[normals.argmax(axis=1)]
    flat = np.take_along_axis(seen, axes[:, None, :].repeat(3, axis=1), axis=2)
    height, width = texture.image.shape[:2]
    larger = max(width, height)
    form = "<8x2d" if own.find("_ob") is not None else "<8x2f"
    scaling = np.array(unpack(form, own.find("_ob", "Tob") or b"", "_ob"))
    size = scaling * (width / larger, height / larger)
    return flat / np.where(size == 0, 1.0, size) + 0.5
