"""Reading of mesh files with trimesh. The import is slow, so it is done only when the first mesh is read."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.resolvers import Resolver

from drone_sim.files import images
from drone_sim.files.mesh_files import (
    KINDS,
    MAX_COORDINATE,
    MAX_PARTS,
    MAX_SIZE,
    MAX_TRIANGLES,
    WHITE,
    Colour,
    MeshPart,
)
from drone_sim.files.resources import ReadFile, read_bytes

# How often a word may occur in a file. Nested <instance_node> elements can double the drawn meshes each time.
_MAX_OCCURRENCES = {
    ".obj": {"usemtl": (rb"usemtl", MAX_PARTS), "f": (rb"\nf", MAX_TRIANGLES)},
    ".dae": {
        "instance_node": (rb"<(?:\w+:)?instance_node", 16),
        "instance_geometry": (rb"<(?:\w+:)?instance_geometry", MAX_PARTS),
    },
}


class _FolderResolver(Resolver):
    """Reads, for trimesh, the materials and textures that a mesh refers to; only regular files up to MAX_SIZE."""

    def __init__(self, folder: Path):
        self._folder = folder
        self.files: list[str] = []
        self.problem = ""

    def get(self, key: str) -> bytes:
        """Return the content of a file. Without a missing file the mesh is white, which is no problem."""
        path = self._folder / key.strip().strip('"')
        self.files.append(str(path))
        try:
            content = read_bytes(path, MAX_SIZE)
            try:
                images.check(content)
            except Image.UnidentifiedImageError:  # a list of materials
                content = _as_utf8(content)
        except FileNotFoundError:
            raise
        except Exception as error:  # trimesh ignores the exception and continues without the file
            self.problem = f"{key:.100}: {getattr(error, 'strerror', None) or error}"
            raise
        return content

    def write(self, name: str, data: Any) -> None:
        raise NotImplementedError

    def namespaced(self, namespace: str) -> Resolver:
        raise NotImplementedError

    def keys(self) -> list[str]:
        return []


def read(path: str) -> ReadFile:
    """Return the parts of a mesh file in its root frame. Raises ValueError, in one line with the file's name."""
    kind = Path(path).suffix.lower()
    if kind not in KINDS:
        raise ValueError(f"mesh {path}: must be one of {', '.join(KINDS)}")
    resolver = _FolderResolver(Path(path).parent)
    try:
        content = read_bytes(path, MAX_SIZE)
        _check_text(content, kind)
        if kind == ".obj":
            content = _as_utf8(content)
        loaded = trimesh.load(io.BytesIO(content), file_type=kind[1:], resolver=resolver, process=False)
        parts = tuple(map(_to_part, _transformed_meshes(loaded)))
        if resolver.problem:
            raise ValueError(resolver.problem)
        _check_parts(parts)
    except (MemoryError, RecursionError):
        raise ValueError(f"mesh {path}: cannot be read (too large)") from None
    except Exception as error:  # trimesh's readers raise exceptions of any type
        reason = str(getattr(error, "strerror", None) or error)
        if not isinstance(error, (ValueError, OSError, IndexError)):
            reason = "it is broken"
        raise ValueError(f"mesh {path}: cannot be read ({' '.join(reason.split()):.200})") from error
    return ReadFile(parts, sum(part.nbytes for part in parts), resolver.files)


def _as_utf8(text: bytes) -> bytes:
    """Replace bytes that are not UTF-8, which occur only in names, so that trimesh need not guess the encoding."""
    return text.decode("utf-8", errors="replace").encode()


def _check_text(content: bytes, kind: str) -> None:
    """Raise ValueError for a file that trimesh would take very long to read."""
    if kind == ".dae":
        if not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") or b"\0" in content:
            raise ValueError("must be XML in UTF-8")
        if b"<!DOCTYPE" in content:
            raise ValueError("must have no DOCTYPE")
    for word, (pattern, limit) in _MAX_OCCURRENCES.get(kind, {}).items():
        if len(re.findall(pattern, content)) > limit:
            raise ValueError(f"must not contain more than {limit} `{word}`")


def _transformed_meshes(loaded: Any) -> Iterator[trimesh.Trimesh]:
    """Yield the meshes of a file in metres, in its root frame."""
    if isinstance(loaded, trimesh.Trimesh):
        if len(loaded.faces):
            yield loaded
        return
    if not isinstance(loaded, trimesh.Scene):
        return  # points or lines, which are not drawn
    metres = trimesh.units.unit_conversion(loaded.units, "meters") if loaded.units else 1.0  # COLLADA has units
    nodes = loaded.graph.nodes_geometry
    if len(nodes) > MAX_PARTS:
        raise ValueError(f"{len(nodes)} parts; at most {MAX_PARTS} are allowed")
    for node in nodes:
        transform, name = loaded.graph[node]
        part = loaded.geometry[name]
        if isinstance(part, trimesh.Trimesh) and len(part.faces):
            part = part.copy()
            part.apply_transform(transform)
            part.apply_scale(metres)
            yield part


def _to_part(mesh: trimesh.Trimesh) -> MeshPart:
    vertices = np.array(mesh.vertices, dtype=np.float64)
    faces = np.array(mesh.faces)
    if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
        raise ValueError("a vertex must have 3 numbers, and a face 3 corners or 4")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError("a face names a vertex that does not exist")
    if not np.isfinite(vertices).all():
        raise ValueError("a vertex is not finite")
    uv, rgba, texture = _material(mesh)
    if uv is not None and (uv.shape != (len(vertices), 2) or not np.isfinite(uv).all()):
        uv = None
    for array in (vertices, faces, uv, texture):
        if array is not None:
            array.setflags(write=False)
    return MeshPart(vertices, faces, uv, rgba, None if uv is None else texture)


def _check_parts(parts: tuple[MeshPart, ...]) -> None:
    count = sum(len(part.faces) for part in parts)
    if not count:
        raise ValueError("holds no triangles")
    if count > MAX_TRIANGLES:
        raise ValueError(f"{count} triangles; at most {MAX_TRIANGLES} are allowed")
    if max(np.abs(part.vertices).max() for part in parts) > MAX_COORDINATE:
        raise ValueError(f"a vertex is more than {MAX_COORDINATE:g} m from the origin")


def _material(part: Any) -> tuple[np.ndarray | None, Colour, np.ndarray | None]:
    """Return uv (n, 2) or None, base colour, and texture or None, of a trimesh part."""
    kind = getattr(part.visual, "kind", None)
    if kind in ("vertex", "face"):
        return None, _to_colour(part.visual.main_color), None
    if kind != "texture":
        return None, WHITE, None
    uv = part.visual.uv
    uv = None if uv is None else np.array(uv, dtype=np.float64)[:, :2]
    material = part.visual.material
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    if image is None or uv is None:
        return uv, _base_colour(material), None
    return uv, _base_colour(material), np.array(image.convert("RGBA" if "A" in image.getbands() else "RGB"))


def _base_colour(material: Any) -> Colour:
    factor = getattr(material, "baseColorFactor", None)
    if factor is None:
        factor = getattr(material, "diffuse", None)
    if factor is None:
        return WHITE
    red, green, blue, alpha = _to_colour(factor)
    options: dict[str, Any] = getattr(material, "kwargs", None) or {}
    opacity = options.get("d")  # MTL's dissolve, which trimesh does not use
    return (red, green, blue, min(1.0, max(0.0, float(opacity[0]))) if opacity else alpha)


def _to_colour(values: Any) -> Colour:
    values = np.asarray(values)
    scaled = values / 255.0 if values.dtype == np.uint8 else np.clip(np.nan_to_num(values.astype(float)), 0, 1)
    red, green, blue, alpha = (float(value) for value in scaled[:4])
    return (red, green, blue, alpha)
