"""What rviz's markers look like in the browser: one marker, one node of viser's scene."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual.material import PBRMaterial
from visualization_msgs.msg import Marker

from drone_sim.files.resources import resolve
from drone_sim.ros.core.message_conversion import xyz

_LOG = logging.getLogger(__name__)
_PIXELS = 3.0  # width of lines
_LARGEST = 64 << 20  # bytes of a mesh file
_UNLIT = "KHR_materials_unlit"


def show(scene: Any, name: str, marker: Marker, casts: bool = False) -> Any:
    """Put a marker into viser's scene under a name, where its pose says; return its handle, None for nothing to see.

    `casts`: it throws a shadow, if it is solid.
    """
    if marker.type in _SOLID:
        is_solid = marker.color.a >= 1 or marker.mesh_use_embedded_materials
        return _SOLID[marker.type](scene, name, marker, cast_shadow=casts and is_solid, receive_shadow=False)
    make = _MAKERS.get(marker.type)
    return make(scene, name, marker) if make else None


def change(handle: Any, marker: Marker) -> bool:
    """Give what `show` returned other points or other words; tell whether that is possible for a marker of its kind.

    A browser does so at once, where it would make something new in several steps.
    """
    if marker.type == Marker.TEXT_VIEW_FACING:
        handle.text = marker.text
        return True
    ends = _ENDS[marker.type](marker) if marker.type in _ENDS else None
    if ends is None:
        return False
    handle.points = ends
    return True


def place(marker: Marker) -> dict[str, tuple[float, ...]]:
    """Return position (m) and orientation (wxyz) of a marker in its frame."""
    turn = marker.pose.orientation
    wxyz = (turn.w, turn.x, turn.y, turn.z)
    return {"position": xyz(marker.pose.position), "wxyz": wxyz if any(wxyz) else (1.0, 0.0, 0.0, 0.0)}


def _rgb(color: Any) -> tuple[float, float, float]:
    return color.r, color.g, color.b


def _primitive(scene: Any, name: str, marker: Marker, **shade: bool) -> Any:
    add, form, size = _PRIMITIVES[marker.type]
    look = {"color": _rgb(marker.color), "opacity": marker.color.a if marker.color.a < 1 else None}
    return getattr(scene, add)(name, **form, **{size: xyz(marker.scale)}, **look, **shade, **place(marker))


def _arrow(scene: Any, name: str, marker: Marker) -> Any:
    """Return an arrow between two points, whose scale is shaft and head, or along x, whose scale is its size."""
    if len(marker.points) == 2:
        ends, width = _points(marker), marker.scale.x
    else:
        ends, width = np.array([(0.0, 0.0, 0.0), (marker.scale.x, 0.0, 0.0)]), marker.scale.y
    if not np.linalg.norm(ends[1] - ends[0]) > 0:
        return None
    look = {"shaft_radius": width / 2, "head_radius": width, "head_length": 2 * width}
    return scene.add_arrows(name, points=ends[None], colors=_rgb(marker.color), **look, **place(marker))


def _strip_ends(marker: Marker) -> np.ndarray | None:
    """Return the ends of lines from each point to the next, (n, 2, 3), None where there are none."""
    points = _points(marker)
    return np.stack((points[:-1], points[1:]), axis=1) if len(points) > 1 else None


def _list_ends(marker: Marker) -> np.ndarray | None:
    """Return the ends of lines between points two by two, (n, 2, 3), None where there are none."""
    points = _points(marker)
    return points[: len(points) // 2 * 2].reshape(-1, 2, 3) if len(points) > 1 else None


def _lines(scene: Any, name: str, marker: Marker) -> Any:
    ends = _ENDS[marker.type](marker)
    if ends is None:
        return None
    return scene.add_line_segments(name, points=ends, colors=_rgb(marker.color), line_width=_PIXELS, **place(marker))


def _point_cloud(scene: Any, name: str, marker: Marker) -> Any:
    points = _points(marker)
    if not len(points):
        return None
    same = len(marker.colors) == len(points)
    colors = [_rgb(one) for one in marker.colors] if same else [_rgb(marker.color)] * len(points)
    look = {"point_size": max(marker.scale.x, 1e-3), "point_shape": "circle"}
    return scene.add_point_cloud(name, points=points, colors=np.array(colors), **look, **place(marker))


def _text(scene: Any, name: str, marker: Marker) -> Any:
    return scene.add_label(name, marker.text, anchor="bottom-center", **place(marker))


def _triangles(scene: Any, name: str, marker: Marker, **shade: bool) -> Any:
    corners = _points(marker) * xyz(marker.scale)
    corners = corners[: len(corners) // 3 * 3]
    if not len(corners):
        return None
    colors = marker.colors if len(marker.colors) == len(corners) else [marker.color] * len(corners)
    rgba = np.array([(one.r, one.g, one.b, one.a) for one in colors])
    mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=_linear(rgba))
    glb = as_glb(mesh, is_lit=bool(marker.colors), is_clear=bool((rgba[:, 3] < 1).any()))
    return scene.add_glb(name, glb, **shade, **place(marker))


def _mesh(scene: Any, name: str, marker: Marker, **shade: bool) -> Any:
    color = None if marker.mesh_use_embedded_materials else (*_rgb(marker.color), marker.color.a)
    glb = _glb(marker.mesh_resource, color)
    return scene.add_glb(name, glb, scale=xyz(marker.scale), **shade, **place(marker)) if glb else None


@lru_cache(maxsize=64)
def _glb(resource: str, rgba: tuple[float, ...] | None) -> bytes | None:
    """Return a mesh file as glTF, None for one that cannot be read; that is said."""
    try:
        url = urlsplit(resource)
        path = Path(unquote(url.path)) if url.scheme == "file" else resolve(resource)
        if path.stat().st_size > _LARGEST:
            raise ValueError(f"larger than {_LARGEST} bytes")
        loaded = trimesh.load(path, process=False)
        if rgba is not None:
            color = _linear(np.array(rgba))
            for mesh in _meshes(loaded):
                mesh.visual = trimesh.visual.ColorVisuals(mesh, face_colors=np.tile(color, (len(mesh.faces), 1)))
        return as_glb(loaded, is_lit=_take_paint(loaded), is_clear=rgba is not None and rgba[3] < 1)
    except Exception as error:  # trimesh raises what it likes on other people's files
        _LOG.warning("the cockpit cannot show %s: %s", resource, " ".join(str(error).split()))
        return None


def _meshes(loaded: Any) -> Iterable[Any]:
    return loaded.geometry.values() if isinstance(loaded, trimesh.Scene) else [loaded]


def _take_paint(loaded: Any) -> bool:
    """Let textures count as they are, whatever light a material asks rviz for; tell whether there are any."""
    painted = False
    for mesh in _meshes(loaded):
        material: Any = getattr(mesh.visual, "material", None)
        image = getattr(material, "image", None)
        if image is not None:
            glow = 255 * np.asarray([*material.kwargs.get("ke", (0, 0, 0)), 0], dtype=np.float64)
            tint = np.clip(np.add(material.ambient, material.diffuse, dtype=float) + glow, 0, 255).astype(np.uint8)
            mesh.visual.material = PBRMaterial(baseColorTexture=image, baseColorFactor=tint, doubleSided=True)
            painted = True
    return painted


def as_glb(mesh: Any, is_lit: bool, is_clear: bool = False) -> bytes:
    """Return a mesh as glTF, of no metal; one that `is_lit` has its light in its colours, and needs none."""

    def finish(tree: dict[str, Any]) -> None:
        materials = tree.setdefault("materials", [])
        for primitive in (one for mesh in tree["meshes"] for one in mesh["primitives"]):
            if "material" not in primitive:
                primitive["material"] = len(materials)
                materials.append({"doubleSided": True})
        for material in materials:
            material.setdefault("pbrMetallicRoughness", {}).update(metallicFactor=0.0, roughnessFactor=0.9)
            if is_clear:
                material["alphaMode"] = "BLEND"
            if is_lit:
                material["extensions"] = {_UNLIT: {}}
        if is_lit:
            tree["extensionsUsed"] = [*tree.get("extensionsUsed", []), _UNLIT]

    whole = mesh if isinstance(mesh, trimesh.Scene) else trimesh.Scene(mesh)
    return bytes(export_glb(whole, tree_postprocessor=finish))


def _linear(rgba: np.ndarray) -> np.ndarray:
    """Return colours (..., 4), 0..1 as screens take them, as glTF's vertices have them: 0..255, linear in light."""
    clipped = np.clip(rgba, 0, 1)
    rgb = clipped[..., :3]
    clipped[..., :3] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1
    return np.asarray(np.round(clipped * 255), dtype=np.uint8)


def _points(marker: Marker) -> np.ndarray:
    return np.array([xyz(one) for one in marker.points], dtype=float).reshape(-1, 3)


# viser's function, its arguments, and the one that is a marker's scale
_PRIMITIVES: dict[int, tuple[str, dict[str, float], str]] = {
    Marker.CUBE: ("add_box", {}, "dimensions"),
    Marker.SPHERE: ("add_icosphere", {"radius": 0.5}, "scale"),
    Marker.CYLINDER: ("add_cylinder", {"radius": 0.5, "height": 1.0}, "scale"),  # rviz's may be an ellipse, too
}
_ENDS = {Marker.LINE_STRIP: _strip_ends, Marker.LINE_LIST: _list_ends}
_MAKERS = {
    Marker.ARROW: _arrow,
    Marker.LINE_STRIP: _lines,
    Marker.LINE_LIST: _lines,
    Marker.CUBE_LIST: _point_cloud,
    Marker.SPHERE_LIST: _point_cloud,
    Marker.POINTS: _point_cloud,
    Marker.TEXT_VIEW_FACING: _text,
}
_SOLID = {
    Marker.CUBE: _primitive,
    Marker.SPHERE: _primitive,
    Marker.CYLINDER: _primitive,
    Marker.TRIANGLE_LIST: _triangles,
    Marker.MESH_RESOURCE: _mesh,
}
