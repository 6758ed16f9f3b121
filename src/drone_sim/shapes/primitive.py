"""What rviz can draw, in its words but without ROS, which only ros/ knows."""

from __future__ import annotations

from typing import Literal, NamedTuple

from drone_sim.mechanics.frames import IDENTITY, Matrix

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
