"""Mesh files as glTF, which the browsers get from `/mesh/HASH.glb`."""

from __future__ import annotations

import hashlib
import logging
import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np

from drone_sim.files.resources import resolve
from drone_sim.ros.cockpit.server.access_control import Content

_LOG = logging.getLogger(__name__)
_MAX_SIZE = 64 << 20  # bytes of a mesh file
_MAX_MESHES = 200  # in memory; the least recently used are removed
_FOLDER, _ENDING, _KIND = "mesh/", ".glb", "model/gltf-binary"
_File = tuple[str, int, int]  # resource, time of its last change, size


class MeshStore:
    """Meshes as glTF, by URL relative to the page. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._urls: dict[_File, str | None] = {}
        self._contents: OrderedDict[str, bytes] = OrderedDict()

    def url(self, resource: str) -> str | None:
        """Return the URL for browsers of a mesh file with a `file:` or `package:` URL.

        Return None for an unreadable file, after one line in the log for each file.
        """
        try:
            url = urlsplit(resource)
            path = Path(unquote(url.path)) if url.scheme == "file" else resolve(resource)
            state = path.stat()
            file = resource, state.st_mtime_ns, state.st_size
            if not self._is_known(file):
                self._store(file, as_glb(path))
        except Exception as error:  # for a broken file, trimesh raises exceptions of any type
            file = resource, 0, 0
            if not self._is_known(file):
                _LOG.warning("the cockpit cannot show %s: %s", resource, " ".join(str(error).split()))
                self._store(file, None)
        with self._lock:
            return self._urls.get(file)

    def find(self, path: str) -> Content:
        """Return type and content of the mesh with a URL path; None if there is none."""
        with self._lock:
            url = path.removeprefix("/")
            content = self._contents.get(url)
            if content is None:
                return None
            self._contents.move_to_end(url)
        return _KIND, content

    def _is_known(self, file: _File) -> bool:
        with self._lock:
            url = self._urls.get(file, "unknown")
            return url is None or url in self._contents

    def _store(self, file: _File, content: bytes | None) -> None:
        with self._lock:
            if content is None:
                self._urls[file] = None
                return
            url = f"{_FOLDER}{hashlib.sha256(content).hexdigest()[:24]}{_ENDING}"
            self._urls[file] = url
            self._contents[url] = content
            while len(self._contents) > _MAX_MESHES:
                self._contents.popitem(last=False)


def as_glb(path: Path) -> bytes:
    """Return a mesh file as glTF without metallic materials. Raises OSError, ValueError, and what trimesh raises."""
    import trimesh  # slow import
    from trimesh.exchange.gltf import export_glb
    from trimesh.visual.material import PBRMaterial

    if path.stat().st_size > _MAX_SIZE:
        raise ValueError(f"larger than {_MAX_SIZE} bytes")
    loaded = trimesh.load(path, process=False)
    scene = loaded if isinstance(loaded, trimesh.Scene) else trimesh.Scene(loaded)
    # Textured meshes get a single color: the sum of the ambient, diffuse and emissive light that rviz uses.
    for mesh in scene.geometry.values():
        material: Any = getattr(mesh.visual, "material", None)
        image = getattr(material, "image", None)
        if image is not None:
            glow = 255 * np.asarray([*material.kwargs.get("ke", (0, 0, 0)), 0], dtype=np.float64)
            tint = np.clip(np.add(material.ambient, material.diffuse, dtype=float) + glow, 0, 255).astype(np.uint8)
            mesh.visual.material = PBRMaterial(baseColorTexture=image, baseColorFactor=tint, doubleSided=True)
    return bytes(export_glb(scene, tree_postprocessor=_set_materials))


def _set_materials(tree: dict[str, Any]) -> None:
    """Give each primitive of a glTF a material, and make no material metallic."""
    materials = tree.setdefault("materials", [])
    for primitive in (primitive for mesh in tree["meshes"] for primitive in mesh["primitives"]):
        if "material" not in primitive:
            primitive["material"] = len(materials)
            materials.append({"doubleSided": True})
    for material in materials:
        material.setdefault("pbrMetallicRoughness", {}).update(metallicFactor=0.0, roughnessFactor=0.9)
