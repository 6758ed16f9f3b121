"""Mesh files as glTF, which the browsers get from `/mesh/HASH.glb`."""

from __future__ import annotations

import hashlib
import logging
import threading
from collections import OrderedDict
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual.material import PBRMaterial

from drone_sim.files.resources import resolve
from drone_sim.ros.cockpit.server.access_control import Content

_LOG = logging.getLogger(__name__)
_LARGEST = 64 << 20  # bytes of a mesh file
_MOST = 200  # meshes that are kept; those that nobody has asked for since longest go
_FOLDER, _ENDING, _KIND = "/mesh/", ".glb", "model/gltf-binary"
_File = tuple[str, int, int]  # resource, time of its last change, size


class MeshStore:
    """The meshes of what is shown, each once; any thread may call."""

    def __init__(self) -> None:
        """Begin with none."""
        self._lock = threading.Lock()
        self._addresses: dict[_File, str | None] = {}
        self._contents: OrderedDict[str, bytes] = OrderedDict()

    def url(self, resource: str) -> str | None:
        """Return the address of a mesh file, which has a `file:` or `package:` URL; None for one that cannot be read.

        That is told in the log, once.
        """
        try:
            path = _path(resource)
            state = path.stat()
            file = resource, state.st_mtime_ns, state.st_size
            if not self._knows(file):
                self._keep(file, as_glb(path))
        except Exception as error:  # trimesh raises what it likes on other people's files
            file = resource, 0, 0
            if not self._knows(file):
                _LOG.warning("the cockpit cannot show %s: %s", resource, " ".join(str(error).split()))
                self._keep(file, None)
        with self._lock:
            return self._addresses.get(file)

    def find(self, path: str) -> Content:
        """Return type and content of what is asked for by its path, None for no mesh."""
        with self._lock:
            content = self._contents.get(path)
            if content is None:
                return None
            self._contents.move_to_end(path)
        return _KIND, content

    def _knows(self, file: _File) -> bool:
        with self._lock:
            address = self._addresses.get(file, "unknown")
            return address is None or address in self._contents

    def _keep(self, file: _File, content: bytes | None) -> None:
        address = None
        if content is not None:
            address = f"{_FOLDER}{hashlib.sha256(content).hexdigest()[:24]}{_ENDING}"
        with self._lock:
            self._addresses[file] = address
            if address is not None and content is not None:
                self._contents[address] = content
                while len(self._contents) > _MOST:
                    self._contents.popitem(last=False)


def _path(resource: str) -> Path:
    url = urlsplit(resource)
    return Path(unquote(url.path)) if url.scheme == "file" else resolve(resource)


def as_glb(path: Path) -> bytes:
    """Return a mesh file as glTF, of no metal. Raises OSError, ValueError, and whatever trimesh does."""
    if path.stat().st_size > _LARGEST:
        raise ValueError(f"larger than {_LARGEST} bytes")
    loaded = trimesh.load(path, process=False)
    _take_paint(loaded)
    whole = loaded if isinstance(loaded, trimesh.Scene) else trimesh.Scene(loaded)
    return bytes(export_glb(whole, tree_postprocessor=_finish))


def _meshes(loaded: Any) -> Iterable[Any]:
    return loaded.geometry.values() if isinstance(loaded, trimesh.Scene) else [loaded]


def _take_paint(loaded: Any) -> None:
    """Give textured meshes one brightness, the sum of the shares of light that their material defines for rviz."""
    for mesh in _meshes(loaded):
        material: Any = getattr(mesh.visual, "material", None)
        image = getattr(material, "image", None)
        if image is not None:
            glow = 255 * np.asarray([*material.kwargs.get("ke", (0, 0, 0)), 0], dtype=np.float64)
            tint = np.clip(np.add(material.ambient, material.diffuse, dtype=float) + glow, 0, 255).astype(np.uint8)
            mesh.visual.material = PBRMaterial(baseColorTexture=image, baseColorFactor=tint, doubleSided=True)


def _finish(tree: dict[str, Any]) -> None:
    """Give all that is in a glTF a material, of no metal."""
    materials = tree.setdefault("materials", [])
    for primitive in (one for mesh in tree["meshes"] for one in mesh["primitives"]):
        if "material" not in primitive:
            primitive["material"] = len(materials)
            materials.append({"doubleSided": True})
    for material in materials:
        material.setdefault("pbrMetallicRoughness", {}).update(metallicFactor=0.0, roughnessFactor=0.9)
