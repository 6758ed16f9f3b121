"""What a shape is: all that a scene file, the world, the cameras and rviz have to know of one.

Each shape is one frozen dataclass in a file of its own, which says what it is by its base classes; its fields are
its keys in a scene file, where it stands in one.

PyBullet, which only world/ knows, and rviz, which only ros/ knows, are told of it in words of theirs.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Protocol
from xml.etree import ElementTree as Xml

import numpy as np

from drone_sim.files.mesh_part import WHITE
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.shapes.solid import Solid, hull_of


class Files(Protocol):
    """Writes what PyBullet is to read: it is given no other files. Raises RuntimeError where the disk is full."""

    def write(self, content: bytes, suffix: str) -> str:
        """Write a file; return its path."""

    def mesh(self, path: str, hull: bool = False) -> str:
        """Write a mesh file once more, or what has the same convex `hull`; return its path.

        Raises ValueError, in one line that names the file, for one that cannot be read.
        """

    def urdf(self, robot: Xml.Element) -> str:
        """Write a URDF that urdf_files.read has checked, and its meshes; return its path. Raises what `mesh` does."""


class Geometry(NamedTuple):
    """A body of one link: its collision and its visual shape.

    type: name of the constant for `shapeType`; collision, visual: the other arguments of createCollisionShape and
    createVisualShape, which differ in their words; flags: name of the constant for the collision shape's, or none.
    """

    type: str
    collision: Mapping[str, Any]
    visual: Mapping[str, Any]
    flags: str = ""


class UrdfFile(NamedTuple):
    """A body as a URDF says, which loadURDF reads, and the principal moments (kg m²) of each link, by its name.

    In the file is a sphere's inertia, along the same axes: PyBullet takes moments that no solid has for 0.
    """

    path: str
    moments: Mapping[str, tuple[float, float, float]]


Corner = tuple[float, float, float]


class Primitive(NamedTuple):
    """One marker.

    scale: along x, y, z; a cube, sphere or cylinder is of 1 m without it. local: the shape's frame from its own.
    file: path of a "mesh". corners: of "triangles", three each, counter-clockwise seen from outside, m.
    """

    kind: Literal["cube", "sphere", "cylinder", "mesh", "triangles"]
    scale: tuple[float, float, float]
    local: Matrix = IDENTITY
    file: str = ""
    corners: tuple[Corner, ...] = ()


Rgba = tuple[float, float, float, float]  # 0..1

SECTIONS = 24  # of what is round, around its axis


class Triangles(NamedTuple):
    """One material's triangles, in the shape's frame.

    corners: (m, 3, 3), m, counter-clockwise seen from outside; uv: (m, 3, 2), v upwards, or None; rgba: 0..1;
    texture: (h, w, 3 or 4) uint8, top row first, or None.
    """

    corners: np.ndarray
    uv: np.ndarray | None = None
    rgba: Rgba = WHITE
    texture: np.ndarray | None = None


def turned(profile: Sequence[tuple[float, float]], sections: int = SECTIONS) -> np.ndarray:
    """Return the corners (m, 3, 3) of what a line of points (radius, z), upwards, makes as it turns about z."""
    angles = 2 * np.pi / sections * np.arange(sections)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.ones(sections)])
    rings = np.array([circle * (radius, radius, z) for radius, z in profile])
    low, high = rings[:-1], rings[1:]
    next_low, next_high = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    both = np.stack([np.stack([low, next_low, next_high], axis=2), np.stack([low, next_high, high], axis=2)], axis=2)
    corners = both.reshape(-1, 3, 3)
    meet = (corners == np.roll(corners, 1, axis=1)).all(axis=2).any(axis=1)  # on the axis
    return corners[~meet]


def half_circle(radius: float, length: float = 0.0, sections: int = SECTIONS) -> list[tuple[float, float]]:
    """Return points (radius, z) of half a circle, upwards, whose upper half is shifted away by a length."""
    angles = np.linspace(0, np.pi / 2, sections // 4 + 1)[:-1]
    upper = [*zip(radius * np.cos(angles), radius * np.sin(angles) + length / 2), (0.0, radius + length / 2)]
    return [*((wide, -z) for wide, z in reversed(upper)), *upper]


def outer(radius: float) -> float:
    """Return the circumradius of the polygon that has the area of the circle: silhouettes agree on average."""
    angle = 2.0 * np.pi / SECTIONS
    return float(radius * np.sqrt(angle / np.sin(angle)))


class Shape(ABC):
    """A form, in its own frame: centred on its origin, metres."""

    word: ClassVar[str]  # by which scene files and messages name it

    def __str__(self) -> str:
        """Return its name for a message, with the file that it is read from."""
        return self.word


@dataclass(frozen=True)
class SceneShape(Shape):
    """What can stand in a scene: a dataclass whose fields, with their types, are its keys there."""

    default_color: ClassVar[Rgba] = (0.7, 0.7, 0.7, 1.0)  # where a scene file says none

    @abstractmethod
    def for_bullet(self, files: Files, moves: bool) -> Geometry | UrdfFile:
        """Return what PyBullet makes a body of; `moves` is whether that will have a mass.

        Raises ValueError, in one line that names the file, for one that cannot be read.
        """

    def meshes(self) -> Iterable[tuple[str, Sequence[float]]]:
        """Return path and scale (x, y, z) of the mesh files that it is made of. Raises what `for_bullet` does."""
        return ()


class DrawnShape(Shape):
    """What the cameras and rviz draw."""

    has_uv: ClassVar[bool] = False  # whether there is something to lay a texture by

    @property
    def files(self) -> tuple[str, ...]:
        """The files that it is read from: another look when they are written anew."""
        return ()

    @abstractmethod
    def triangles(self) -> Iterable[Triangles]:
        """Return its surface, by material.

        Raises ValueError, in one line that names the file, for one that cannot be read.
        """

    def solid(self) -> Solid:
        """Return what it fills: its convex hull, which is what of it collides when it moves.

        Raises what `triangles` does.
        """
        return hull_of([part.corners for part in self.triangles()])

    def shared(self) -> tuple[DrawnShape, tuple[float, float, float]]:
        """Return the shape whose triangles serve all sizes of this one, and the scale (x, y, z) that makes it this."""
        return self, (1.0, 1.0, 1.0)

    @abstractmethod
    def for_rviz(self) -> Sequence[Primitive]:
        """Return what rviz draws of it, its color and texture aside."""


class ReportedShape(DrawnShape):
    """What PyBullet tells of by a constant of its own: what a URDF may hold."""

    bullet_type: ClassVar[str]  # the constant's name

    @classmethod
    @abstractmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> ReportedShape:
        """Return the shape with these `dimensions` of getVisualShapeData, and the mesh file that PyBullet's is of."""
