"""The interface of a shape for scene files, the world, the cameras and rviz.

Each shape is a frozen dataclass in its own file. Its base classes state where it can be used; its fields are its keys
in a scene file, if it can be used there.

PyBullet, which only world/ knows, and rviz, which only ros/ knows, get the neutral descriptions below.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Protocol
from xml.etree import ElementTree as Xml

import numpy as np

from drone_sim.files.mesh_files import WHITE
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.shapes.solid import Solid, hull_of


class Files(Protocol):
    """Writer of the files that PyBullet reads; it reads no others. Raises RuntimeError if the disk is full."""

    def write(self, content: bytes, suffix: str) -> str:
        """Write a file; return its path."""

    def mesh(self, path: str, hull: bool = False) -> str:
        """Write a mesh file again, or one with the same convex hull if `hull`; return its path.

        Raises ValueError, in one line that names the file, if it cannot be read.
        """

    def urdf(self, robot: Xml.Element) -> str:
        """Write a URDF that urdf_files.read has checked, and its meshes; return its path. Raises as `mesh` does."""


class Geometry(NamedTuple):
    """A body of one link: its collision and its visual shape.

    type: name of the constant for `shapeType`; collision, visual: the other arguments of createCollisionShape and
    createVisualShape, whose names differ; flags: name of the constant for the collision shape's flags, or ''.
    """

    type: str
    collision: Mapping[str, Any]
    visual: Mapping[str, Any]
    flags: str = ""


class UrdfFile(NamedTuple):
    """A body as a URDF for loadURDF, and the principal moments (kg m²) of each link, by its name.

    The file states the inertia of a sphere, along the same axes: PyBullet takes moments that no solid can have for 0.
    """

    path: str
    moments: Mapping[str, tuple[float, float, float]]


Corner = tuple[float, float, float]


class Primitive(NamedTuple):
    """A marker in rviz.

    scale: along x, y, z; without it a cube, sphere or cylinder measures 1 m. local: shape from marker. file: path of a
    "mesh". corners: of "triangles", three each, counter-clockwise seen from outside, m.
    """

    kind: Literal["cube", "sphere", "cylinder", "mesh", "triangles"]
    scale: tuple[float, float, float]
    local: Matrix = IDENTITY
    file: str = ""
    corners: tuple[Corner, ...] = ()


Rgba = tuple[float, float, float, float]  # 0..1

SECTIONS = 24  # around the axis of round shapes


class Triangles(NamedTuple):
    """Triangles of one material, in the shape's frame.

    corners: (m, 3, 3), m, counter-clockwise seen from outside; uv: (m, 3, 2), v upwards, or None; rgba: 0..1; texture:
    (h, w, 3 or 4) uint8, top row first, or None.
    """

    corners: np.ndarray
    uv: np.ndarray | None = None
    rgba: Rgba = WHITE
    texture: np.ndarray | None = None


def turned(profile: Sequence[tuple[float, float]], sections: int = SECTIONS) -> np.ndarray:
    """Return the corners (m, 3, 3) of the surface of revolution about z of a profile (radius, z), upwards."""
    angles = 2 * np.pi / sections * np.arange(sections)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.ones(sections)])
    rings = np.array([circle * (radius, radius, z) for radius, z in profile])
    low, high = rings[:-1], rings[1:]
    next_low, next_high = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    pairs = np.stack([np.stack([low, next_low, next_high], axis=2), np.stack([low, next_high, high], axis=2)], axis=2)
    corners = pairs.reshape(-1, 3, 3)
    is_degenerate = (corners == np.roll(corners, 1, axis=1)).all(axis=2).any(axis=1)  # on the axis
    return corners[~is_degenerate]


def half_circle(radius: float, length: float = 0.0, sections: int = SECTIONS) -> list[tuple[float, float]]:
    """Return points (radius, z) of half a circle, upwards, with its two quarters `length` apart."""
    angles = np.linspace(0, np.pi / 2, sections // 4 + 1)[:-1]
    upper = [*zip(radius * np.cos(angles), radius * np.sin(angles) + length / 2), (0.0, radius + length / 2)]
    return [*((r, -z) for r, z in reversed(upper)), *upper]


def outer(radius: float) -> float:
    """Return the circumradius of the polygon with the area of the circle, so that silhouettes agree on average."""
    angle = 2.0 * np.pi / SECTIONS
    return float(radius * np.sqrt(angle / np.sin(angle)))


class Shape(ABC):
    """A geometric form, centred on the origin of its frame; metres."""

    word: ClassVar[str]  # name in scene files and messages

    def __str__(self) -> str:
        """Return the shape's name for messages, with the file that it is read from."""
        return self.word


@dataclass(frozen=True)
class SceneShape(Shape):
    """A shape that a scene may contain: a dataclass whose typed fields are its keys in the scene file."""

    default_color: ClassVar[Rgba] = (0.7, 0.7, 0.7, 1.0)  # without one in the scene file

    @abstractmethod
    def for_bullet(self, files: Files, moves: bool) -> Geometry | UrdfFile:
        """Return a description of the body for PyBullet; `moves`: the body will have a mass.

        Raises ValueError, in one line that names the file, if it cannot be read.
        """

    def meshes(self) -> Iterable[tuple[str, Sequence[float]]]:
        """Return path and scale (x, y, z) of the shape's mesh files. Raises as `for_bullet` does."""
        return ()


class DrawnShape(Shape):
    """A shape that the cameras and rviz draw."""

    has_uv: ClassVar[bool] = False  # whether it has texture coordinates

    @property
    def files(self) -> tuple[str, ...]:
        """The files that the shape is read from; it looks different when they are written again."""
        return ()

    @abstractmethod
    def triangles(self) -> Iterable[Triangles]:
        """Return the surface, by material.

        Raises ValueError, in one line that names the file, if it cannot be read.
        """

    def solid(self) -> Solid:
        """Return the convex hull, with which the shape collides if it moves.

        Raises as `triangles` does.
        """
        return hull_of([part.corners for part in self.triangles()])

    def shared(self) -> tuple[DrawnShape, tuple[float, float, float]]:
        """Return a shape whose triangles serve all sizes of this one, and the scale (x, y, z) to this size."""
        return self, (1.0, 1.0, 1.0)

    @abstractmethod
    def for_rviz(self) -> Sequence[Primitive]:
        """Return the markers that rviz draws, without color and texture."""


class ReportedShape(DrawnShape):
    """A shape for which PyBullet reports a type: a shape that a URDF may contain."""

    bullet_type: ClassVar[str]  # name of PyBullet's constant

    @classmethod
    @abstractmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> ReportedShape:
        """Return the shape from `dimensions` in getVisualShapeData, and the mesh file behind PyBullet's."""
