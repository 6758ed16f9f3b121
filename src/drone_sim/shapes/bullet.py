"""What PyBullet is told of a shape: its words, without PyBullet, which only world/ knows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol
from xml.etree import ElementTree as Xml


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
