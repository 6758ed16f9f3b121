"""Reads textures, which are stored once in a file, and their mapping onto meshes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drone_sim.vrep_files.chunks import Level, level, quaternion_first, unpack
from drone_sim.vrep_files.model import VrepCover, VrepFileError, VrepTexture

_MAX_SIDE = 4096  # px
_HAS_OPACITY, _DECAL = 0x01, 1
_PLANE, _CUBE = 0, 3  # projections of a texture onto a mesh
_MAX_REPEATS = 1e4  # of a texture on a mesh


def read_texture(data: bytes) -> tuple[int, VrepTexture]:
    """Return the number and the texture of a `TEX` chunk. Raises VrepFileError."""
    texture = level(data)
    number, width, height = texture.integers("Ipa", count=3) or (-1, 0, 0)
    channels = 4 if texture.bits("Bst") & _HAS_OPACITY else 3
    pixels = texture.find("Img") or b""
    if not (0 < width <= _MAX_SIDE and 0 < height <= _MAX_SIDE) or len(pixels) != width * height * channels:
        raise VrepFileError(f"a texture of {width} x {height} px in {len(pixels)} bytes")
    image = np.frombuffer(pixels, np.uint8).reshape(height, width, channels)
    return number, VrepTexture(texture.text("Gon"), np.ascontiguousarray(image[::-1]))


def read_cover(
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
