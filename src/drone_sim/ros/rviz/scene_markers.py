"""Markers of the scene: its objects (`scene`), vehicles (`view/bodies`), floor, ground, sky (`view/surroundings`).

Dummies are small balls, paths are lines. Triangles are lit by the same sun as in the cameras' pictures, because rviz's
own lamp moves with the viewpoint, and leaves some sides black.
"""

from __future__ import annotations

import copy
import itertools
import tempfile
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import rospy
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.files.mesh_files import WHITE
from drone_sim.files.resources import identity_of
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.path import Path as ScenePath
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.render import sky, surfaces
from drone_sim.render.programs import TO_SUN
from drone_sim.render.surfaces import Surface
from drone_sim.ros.core import message_conversion
from drone_sim.ros.rviz.marker_topics import TEXT_PERIOD, MarkerTopic, band, namespace, new_marker
from drone_sim.run.simulation import Simulation
from drone_sim.scene.kinds.dummy import Dummy
from drone_sim.shapes.shape import Corner, Primitive, Rgba
from drone_sim.shapes.visual import Visual
from drone_sim.vehicles.vehicle import Vehicle

_PERIOD = 0.19  # s of real time, between two messages
_GLOW = 0.6  # share of light that does not depend on the viewpoint
_KINDS = {
    "cube": Marker.CUBE,
    "sphere": Marker.SPHERE,
    "cylinder": Marker.CYLINDER,
    "mesh": Marker.MESH_RESOURCE,
    "triangles": Marker.TRIANGLE_LIST,
}
_KEEP_MATERIALS = (0.0, 0.0, 0.0, 0.0)  # with this color rviz uses the materials of the mesh file
_DUMMY = (0.9, 0.9, 0.95, 0.8)
_PATH = (0.2, 0.5, 0.9, 0.8)
_WIDTH = 0.01  # m, of a line
_MAX_POINTS = 2000  # of a line
_MAX_TRANSPARENT = 0.98  # opacity below which rviz uses the alpha of a texture
_SUN = np.array(TO_SUN) / np.linalg.norm(TO_SUN)
_LIGHT_BELOW, _LIGHT_ABOVE, _LIGHT_SUN = np.array([(0.42, 0.41, 0.40), (0.52, 0.54, 0.57), (0.54, 0.52, 0.48)])

_SKY = 5000.0  # m, radius
_GROUND_HEIGHT = -0.06  # m; the floor is higher
_SECTORS = 48
# Color of the ground by distance (m) from the floor: darker than the floor; far away, as the sky at the horizon.
_GROUND = (
    (0.0, (0.40, 0.43, 0.39)),
    (12.0, (0.45, 0.48, 0.45)),
    (40.0, (0.58, 0.60, 0.59)),
    (120.0, (0.70, 0.72, 0.735)),
    (600.0, (0.762, 0.79, 0.813)),
)
_GREY = (0.6, 0.6, 0.6, 1.0)


class _Markers:
    """Base class of publishers; `_published` is the state of the last message."""

    name = ""
    period = TEXT_PERIOD  # s of real time

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise for the scene of `simulation`; textured visuals are written to `files`."""
        self._simulation, self._files = simulation, files
        self._published: Any = None
        self._topic = MarkerTopic(f"{namespace(simulation)}/{self.name}", self.period)


class SceneMarkers(_Markers):
    """Publisher of all objects in the scene but the floor. Each marker's namespace is the object's name."""

    name, period = "scene", _PERIOD

    def update(self) -> None:
        """Publish the objects if any has changed and there are subscribers."""
        self._topic.repeat()
        if not self._topic.is_due():
            return
        (visuals, poses), names = self._simulation.scene.visuals(), self._simulation.scene.visual_names()
        bodiless = [*bodiless_markers(self._simulation.scene.objects.values())]
        before = self._published
        if before and (visuals, names, bodiless) == before[:3] and np.array_equal(poses, before[3]):
            return
        self._published = visuals, names, copy.deepcopy(bodiless), poses
        markers = [Marker(action=Marker.DELETEALL)]
        for name, visual, pose in zip(names, visuals, poses):
            for marker in markers_of(visual, tuple(pose[:3].ravel().tolist()), self._files):
                marker.ns = name
                markers.append(marker)
        markers += bodiless
        for marker in markers:
            marker.frame_locked = True
        self._topic.show(markers)


class VehicleMarkers(_Markers):
    """Publisher of the vehicles, when one is added or removed. Markers move with the frames of links."""

    name = "view/bodies"

    def update(self) -> None:
        """Publish the vehicles if any was added or removed and there are subscribers."""
        self._topic.repeat()
        if self._simulation.topology_version != self._published and self._topic.is_due():
            self._published = self._simulation.topology_version
            markers = [marker for vehicle in self._simulation.vehicles.values() for marker in self._markers(vehicle)]
            self._topic.show([Marker(action=Marker.DELETEALL), *markers])

    def _markers(self, vehicle: Vehicle) -> list[Marker]:
        markers = []
        for visual, (link, matrix) in zip(
            self._simulation.world.pictures.visuals([vehicle.body.number]), vehicle.body.visual_places
        ):
            for marker in markers_of(visual, matrix, self._files):
                marker.header.frame_id = message_conversion.frame(vehicle.parameters, link)
                marker.ns, marker.frame_locked = vehicle.name, True
                markers.append(marker)
        return markers


def markers_of(visual: Visual, matrix: frames.Matrix, files: RvizMeshes) -> Sequence[Marker]:
    """Return the markers of a visual at the pose `matrix`, with its texture if it has one."""
    if visual.texture and visual.shape.has_uv:
        try:
            marker = _marker(Marker.MESH_RESOURCE, matrix, (1, 1, 1), _KEEP_MATERIALS)
            marker.mesh_resource, marker.mesh_use_embedded_materials = files.resource(visual, _GLOW), True
            return [marker]
        except (ValueError, OSError) as error:
            rospy.logwarn_throttle(5, f"rviz shows an object without its texture: {error}")
    return [marker_of(primitive, matrix, visual.rgba) for primitive in visual.shape.for_rviz()]


def marker_of(primitive: Primitive, matrix: frames.Matrix, rgba: Rgba) -> Marker:
    """Return the marker of a primitive in a shape whose pose is `matrix`."""
    pose = frames.multiply(matrix, primitive.local)
    marker = _marker(_KINDS[primitive.kind], pose, primitive.scale, rgba)
    if primitive.kind == "triangles":
        _set_triangles(marker, primitive.corners, pose, rgba)
    if primitive.kind == "mesh":
        has_materials = rgba == WHITE
        marker.mesh_resource, marker.mesh_use_embedded_materials = f"file://{primitive.file}", has_materials
        marker.color = ColorRGBA(*(_KEEP_MATERIALS if has_materials else rgba))
    return marker


def _marker(kind: int, matrix: frames.Matrix, size: Sequence[float], rgba: Sequence[float]) -> Marker:
    return Marker(type=kind, pose=message_conversion.pose(matrix), scale=Vector3(*size), color=ColorRGBA(*rgba))


def bodiless_markers(objects: Iterable[SceneObject]) -> Iterator[Marker]:
    """Yield a marker for each dummy and each path in `objects`, in the frame `world`."""
    for item in objects:
        if isinstance(item, Dummy):
            ball = new_marker(Marker.SPHERE, _DUMMY, [item.size] * 3, ns=item.name)
            ball.pose.position = Point(*frames.position(item.matrix()))
            yield ball
        elif isinstance(item, ScenePath):
            step, matrix = -(-len(item.points) // _MAX_POINTS), item.matrix()
            points = [frames.transform(matrix, point) for point in (*item.points[:-1:step], item.points[-1])]
            yield new_marker(Marker.LINE_STRIP, _PATH, (_WIDTH, 0, 0), points, ns=item.name)


def _set_triangles(marker: Marker, corners: tuple[Corner, ...], matrix: Matrix, rgba: Sequence[float]) -> None:
    """Set the points of a marker at the pose `matrix` to triangles (three corners each, m), with lit colors."""
    points, normals = _points_and_normals(corners)
    scale = marker.scale.x, marker.scale.y, marker.scale.z
    marker.type, marker.points = Marker.TRIANGLE_LIST, points
    colors: Any = np.minimum(_light(normals / scale, matrix) * rgba[:3], 1.0).tolist()
    for red, green, blue in colors:
        marker.colors += [ColorRGBA(red, green, blue, rgba[3])] * 3


@lru_cache
def _points_and_normals(corners: tuple[Corner, ...]) -> tuple[list[Point], np.ndarray]:
    """Return the corners as points, and the triangles' normals (m, 3), which are not unit vectors."""
    first, second, third = np.moveaxis(np.reshape(corners, (-1, 3, 3)), 1, 0)
    return [Point(*corner) for corner in corners], np.cross(second - first, third - first)


def _light(normals: np.ndarray, matrix: Matrix) -> np.ndarray:
    """Return the RGB light (m, 3) on surfaces with these normals (m, 3), as the cameras' shaders compute it."""
    world_normals = normals @ np.reshape(matrix, (3, 4))[:, :3].T
    world_normals /= np.maximum(np.linalg.norm(world_normals, axis=1, keepdims=True), 1e-30)
    above = 0.5 + 0.5 * world_normals[:, 2:]
    ambient = (1 - above) * _LIGHT_BELOW + above * _LIGHT_ABOVE
    return np.asarray(ambient + _LIGHT_SUN * np.maximum(0.85 * (world_normals @ _SUN)[:, None] + 0.15, 0.0))


# ---- surroundings


class SurroundingsMarkers(_Markers):
    """Publisher of floor, ground and sky, when the scene or its floor is replaced."""

    name = "view/surroundings"

    def update(self) -> None:
        """Publish the surroundings if they have changed and there are subscribers."""
        self._topic.repeat()
        scene = self._simulation.scene
        if self._published == (scene, scene.floor) or not self._topic.is_due():
            return
        self._published = scene, scene.floor
        dome: Any = sky.dome().reshape(-1, 6).tolist()
        markers = [_colored_triangles("sky", _SKY, dome), _ground(self._simulation.parameters.scene.floor.size / 2)]
        markers += [self._floor(visual) for visual in self._simulation.world.pictures.visuals() if visual.floor]
        self._topic.show(markers)

    def _floor(self, visual: Visual) -> Marker:
        marker = new_marker(Marker.MESH_RESOURCE, (0, 0, 0, 0), (1, 1, 1), ns="floor")
        try:
            marker.mesh_resource, marker.mesh_use_embedded_materials = self._files.resource(visual, glow=1.0), True
        except (ValueError, OSError) as error:
            rospy.logwarn(f"rviz shows the floor without its texture: {error}")
            size = self._simulation.parameters.scene.floor.size
            marker.type, marker.color, marker.scale = Marker.CUBE, ColorRGBA(*_GREY), Vector3(size, size, 1e-3)
        return marker


def _ground(half: float) -> Marker:
    """Return a disc with the colors of _GROUND; `half` is half of the floor's side, m."""
    angles = np.linspace(0.0, 2.0 * np.pi, _SECTORS + 1)
    rings = [[(0.0, 0.0, _GROUND_HEIGHT, *_GROUND[0][1])] * len(angles)]
    for distance, color in _GROUND:
        radius = half + distance
        rings.append([(radius * np.cos(a), radius * np.sin(a), _GROUND_HEIGHT, *color) for a in angles])
    corners = [corner for inner, outer in itertools.pairwise(rings) for corner in band(inner, outer)]
    return _colored_triangles("ground", 1.0, corners)


def _colored_triangles(name: str, scale: float, corners: Sequence[Sequence[float]]) -> Marker:
    """Return a marker of triangles; each corner is x, y, z, red, green, blue."""
    points = [corner[:3] for corner in corners]
    marker = new_marker(Marker.TRIANGLE_LIST, (1, 1, 1, 1), [scale] * 3, points, ns=name)
    marker.colors = [ColorRGBA(*corner[3:], 1.0) for corner in corners]
    return marker


# ---- textures


class RvizMeshes:
    """Temporary folder with files of visuals, each with a new name: rviz never reads a file of one name again."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory | None = None  # made for the first file
        self._written: dict[Hashable, str] = {}

    def resource(self, visual: Visual, glow: float) -> str:
        """Return the URL of a visual's mesh, textured as in the cameras' pictures, and tinted with its rgba.

        `glow` (0..1) is the share of light that does not depend on the viewpoint; rviz's only lamp moves with the
        viewpoint. Raises ValueError for a file that cannot be read, OSError for one that cannot be written.
        """
        key = (replace(visual, key=None), glow, *map(identity_of, (*visual.shape.files, visual.texture)))
        if key not in self._written:
            self._written[key] = self._write(visual, glow)
        return self._written[key]

    def close(self) -> None:
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self._written.clear()

    def _write(self, visual: Visual, glow: float) -> str:
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_rviz_")
        stem = Path(self._folder.name) / f"{len(self._written)}"
        lines, materials, first = [f"mtllib {stem.name}.mtl"], [], 1
        for number, surface in enumerate(surfaces.load(visual)):
            image = "" if surface.texture is None else f"{stem.name}_{number}.png"
            if surface.texture is not None:
                path = stem.with_name(image)
                order = cv2.COLOR_RGBA2BGRA if surface.texture.shape[2] == 4 else cv2.COLOR_RGB2BGR
                if not cv2.imwrite(str(path), cv2.cvtColor(surface.texture, order)):
                    raise OSError(f"{path}: cannot be written")
            materials += _material(number, surface, visual.rgba, glow, image)
            lines += [f"usemtl {number}", *_triangles(surface, first)]
            first += len(surface.vertices)
        stem.with_suffix(".mtl").write_text("\n".join([*materials, ""]), encoding="utf-8")
        stem.with_suffix(".obj").write_text("\n".join([*lines, ""]), encoding="utf-8")
        return f"file://{stem}.obj"


def _material(number: int, surface: Surface, tint: tuple[float, ...], glow: float, image: str) -> list[str]:
    red, green, blue, alpha = np.multiply(tint, surface.rgba)
    if surface.transparent:
        alpha = min(alpha, _MAX_TRANSPARENT)
    lines = [f"newmtl {number}", "Ka 0 0 0", "Ks 0 0 0", f"d {alpha:g}", "illum 1"]
    for name, share in (("Kd", 1 - glow), ("Ke", glow)):
        lines.append(f"{name} {red * share:g} {green * share:g} {blue * share:g}")
    return [*lines, f"map_Kd {image}"] if image else lines


def _triangles(surface: Surface, first: int) -> list[str]:
    """Return the OBJ lines of a surface; its vertices are numbered from `first`."""
    uv = np.zeros((len(surface.vertices), 2)) if surface.uv is None else surface.uv
    vertices: Any = surface.vertices.tolist()  # a str, by the types of numpy 2.2
    normals: Any = surface.normals.tolist()
    lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices]
    lines += [f"vt {u:.7g} {v:.7g}" for u, v in np.asarray(uv, float).tolist()]
    lines += [f"vn {x:.5g} {y:.5g} {z:.5g}" for x, y, z in normals]
    lines += [f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}" for a, b, c in (surface.faces.astype(int) + first).tolist()]
    return lines
