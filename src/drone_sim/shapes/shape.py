"""What a shape is: all that a scene file, the world, the cameras and rviz have to know of one.

Each shape is one frozen dataclass in a file of its own, which says what it is by its base classes; its fields are
its keys in a scene file, where it stands in one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from drone_sim.shapes.bullet import Files, Geometry, UrdfFile
from drone_sim.shapes.primitive import Primitive
from drone_sim.shapes.solid import Solid, hull_of
from drone_sim.shapes.triangles import Rgba, Triangles


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
