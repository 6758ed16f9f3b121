"""Make PyBullet bodies: the floor, and the objects of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple
from xml.etree import ElementTree as Xml

import pybullet

from drone_sim.files import urdf_files
from drone_sim.mechanics.frames import from_rpy, to_quaternion
from drone_sim.mechanics.state import Pose
from drone_sim.shapes.visual import GROUND
from drone_sim.world.own_files import OwnFiles

_FLOOR_TILE = 2.0  # m covered by one floor texture
_FLOOR_THICKNESS = 0.1  # m, below z = 0
_GROUND_REACH = 2000.0  # m from the origin, along either axis
_BELOW = 1e-3  # m that the ground is drawn below the floor, for PyBullet's own renderer to tell them apart


class Shape(NamedTuple):
    """An object: what, where (m, rad), how it looks (rgba 0..1), how heavy (kg, 0 stands still).

    kind and size (m): box: length, width, height; cylinder: radius, length; sphere: radius; mesh: scale x, y, z
    (no unit); urdf: none.
    """

    kind: str
    size: Sequence[float]
    position: Sequence[float]
    rpy: Sequence[float] = (0.0, 0.0, 0.0)
    color: Sequence[float] = (1.0, 1.0, 1.0, 1.0)
    mass: float = 0.0
    file: str = ""
    texture: str = ""

    @property
    def pose(self) -> Pose:
        """Where it stands."""
        x, y, z = self.position
        return Pose((x, y, z), to_quaternion(from_rpy((0, 0, 0), self.rpy)))


def create(client: int, shape: Shape, files: OwnFiles) -> int:
    """Add an object without its texture; return its body id.

    Raises ValueError, in one line, for a file that cannot be read.
    """
    position, orientation = shape.pose
    try:
        if shape.kind == "urdf":
            path = files.urdf(_checked_urdf(shape.file))
            return pybullet.loadURDF(path, position, orientation, useFixedBase=shape.mass == 0, physicsClientId=client)
        collision, visual = _geometry(shape, files)
        solid = pybullet.createCollisionShape(physicsClientId=client, **collision)
        seen = pybullet.createVisualShape(rgbaColor=shape.color, physicsClientId=client, **visual)
        return pybullet.createMultiBody(shape.mass, solid, seen, position, orientation, physicsClientId=client)
    except pybullet.error as error:
        raise ValueError(f"{shape.kind} {shape.file}: PyBullet cannot make it ({error})") from None


def _checked_urdf(path: str) -> Xml.Element:
    try:
        return urdf_files.read(path)
    except OSError as error:
        raise ValueError(f"urdf {path}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(f"urdf {path}: {error}") from None


def dress(client: int, body: int, visual: int, path: str) -> None:
    """Cover a visual shape of a body (-1: all of its root link's) with the image at `path`."""
    image = pybullet.loadTexture(path, physicsClientId=client)
    pybullet.changeVisualShape(body, -1, visual, textureUniqueId=image, physicsClientId=client)


def _geometry(shape: Shape, files: OwnFiles) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return PyBullet's arguments for the collision and for the visual shape, which differ in their words."""
    if shape.kind == "box":
        both: dict[str, Any] = {"shapeType": pybullet.GEOM_BOX, "halfExtents": [length / 2 for length in shape.size]}
        return both, both
    if shape.kind == "sphere":
        both = {"shapeType": pybullet.GEOM_SPHERE, "radius": shape.size[0]}
        return both, both
    if shape.kind == "cylinder":
        both = {"shapeType": pybullet.GEOM_CYLINDER, "radius": shape.size[0]}
        return {**both, "height": shape.size[1]}, {**both, "length": shape.size[1]}
    both = {"shapeType": pybullet.GEOM_MESH, "meshScale": list(shape.size)}
    seen = {**both, "fileName": files.mesh(shape.file)}
    if shape.mass == 0:  # what stands still may be hollow; what moves is its convex hull
        return {**seen, "flags": pybullet.GEOM_FORCE_CONCAVE_TRIMESH}, seen
    return {**both, "fileName": files.mesh(shape.file, hull=True)}, seen


def create_floor(client: int, files: OwnFiles, size: float, ground: bool) -> int:
    """Add a square floor with its top at z = 0, `size` metres a side; return its body id.

    With `ground`, bare ground surrounds it at the same height. It is of the same body, as its second visual shape:
    every body costs a step some 4 % of its time, whether anything comes near it or not.
    """
    half, depth = size / 2, _FLOOR_THICKNESS / 2
    boxes = [(half, half, 0.0, 0.0)]  # half lengths in x and y, and centre
    seen = [(_floor_mesh(size), (1.0, 1.0, 1.0, 1.0), 0.0)]
    if ground:
        reach, wide = _GROUND_REACH, (_GROUND_REACH - half) / 2
        boxes += [(reach, wide, 0.0, half + wide), (reach, wide, 0.0, -half - wide)]
        boxes += [(wide, half, half + wide, 0.0), (wide, half, -half - wide, 0.0)]
        seen.append((_floor_mesh(2 * reach), (*GROUND, 1.0), -_BELOW))
    solid = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * len(boxes),
        halfExtents=[[x, y, depth] for x, y, _, _ in boxes],
        collisionFramePositions=[[x, y, -depth] for _, _, x, y in boxes],
        physicsClientId=client,
    )
    visual = pybullet.createVisualShapeArray(
        shapeTypes=[pybullet.GEOM_MESH] * len(seen),
        fileNames=[files.write(mesh, ".obj") for mesh, _, _ in seen],
        rgbaColors=[color for _, color, _ in seen],
        visualFramePositions=[[0, 0, z] for _, _, z in seen],
        physicsClientId=client,
    )
    return int(pybullet.createMultiBody(0, solid, visual, physicsClientId=client))


def _floor_mesh(size: float) -> bytes:
    """Return a square whose texture repeats every _FLOOR_TILE metres, centred, as an OBJ file."""
    half, reach = size / 2, size / 2 / _FLOOR_TILE
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    lines = [f"v {x * half} {y * half} 0" for x, y in corners]
    lines += [f"vt {x * reach} {y * reach}" for x, y in corners]
    lines += ["vn 0 0 1", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1", ""]
    return "\n".join(lines).encode()
