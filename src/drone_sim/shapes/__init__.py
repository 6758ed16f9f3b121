"""The shapes: one class each, from the scene file to Bullet, to what the cameras draw, and to rviz."""

from __future__ import annotations

from pkgutil import resolve_name

from drone_sim.shapes.shape import ReportedShape, SceneShape, Shape

# Module and class of each, in the order in which messages name them. A shape that is added is added here.
_CLASSES = (
    "box:Box",
    "cylinder:Cylinder",
    "sphere:Sphere",
    "mesh:Mesh",
    "urdf:Urdf",
    "capsule:Capsule",
    "plane:Plane",
)
_SHAPES: tuple[type[Shape], ...] = tuple(resolve_name(f"{__name__}.{one}") for one in _CLASSES)
SCENE_SHAPES = {one.word: one for one in _SHAPES if issubclass(one, SceneShape)}  # by a scene file's word
REPORTED_SHAPES = {one.bullet_type: one for one in _SHAPES if issubclass(one, ReportedShape)}
