"""The shapes: each class describes one for scene files, Bullet, the cameras, and rviz."""

from __future__ import annotations

from pkgutil import resolve_name

from drone_sim.shapes.shape import ReportedShape, SceneShape, Shape

# Module and class of each shape, in the order in which messages name them. Add new shapes here.
_CLASSES = (
    "box:Box",
    "cylinder:Cylinder",
    "sphere:Sphere",
    "mesh:Mesh",
    "urdf:Urdf",
    "capsule:Capsule",
    "plane:Plane",
)
_SHAPES: tuple[type[Shape], ...] = tuple(resolve_name(f"{__name__}.{name}") for name in _CLASSES)
SCENE_SHAPES = {shape.word: shape for shape in _SHAPES if issubclass(shape, SceneShape)}  # by name in scene files
REPORTED_SHAPES = {shape.bullet_type: shape for shape in _SHAPES if issubclass(shape, ReportedShape)}
