"""Bodies of several shapes, and of several links with joints between them, told to PyBullet as a URDF of our own.

Of all that PyBullet takes, a URDF alone has neither a limit of parts nor of links, and says every inertia.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import NamedTuple
from xml.etree import ElementTree as Xml

import pybullet

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.state import Pose
from drone_sim.shapes.compound import Part
from drone_sim.shapes.mass import PrincipalInertia
from drone_sim.shapes.shape import Geometry
from drone_sim.world.bullet_files import BulletFiles

_NO_LIMIT = 1e9
_FASTEST = 1e4  # rad/s or m/s of a joint; PyBullet's own limit is 100
_NO_INERTIA = PrincipalInertia((0.0, 0.0, 0.0))


class Hinge(NamedTuple):
    """How a link hangs on another: by a joint about or along z.

    parent: index of the other link; local: that link's frame from the joint's; motion: "revolute", "prismatic", or
    "fixed" for none; limits: rad or m, None for none; value: rad or m, at the beginning.
    """

    parent: int
    local: Matrix
    motion: str
    limits: tuple[float, float] | None
    value: float


class Link(NamedTuple):
    """A rigid body of an assembly. Its frame is that of its hinge, as it has moved; the first has none.

    local: the link's frame from that of the parts; mass: kg; inertia: in the frame of the parts.
    """

    parts: Sequence[Part]
    local: Matrix = IDENTITY
    mass: float = 0.0
    inertia: PrincipalInertia = _NO_INERTIA
    hinge: Hinge | None = None


def create(client: int, files: BulletFiles, links: Sequence[Link], pose: Pose) -> tuple[int, list[int]]:
    """Add an assembly with its first link's frame at a pose; return its body id, and PyBullet's number of each link.

    It stands still where its first link has no mass. Raises ValueError, in one line, for a file that cannot be read.
    """
    path = files.write(_urdf(files, links), ".urdf")
    try:
        body = pybullet.loadURDF(
            path,
            pose.position,
            pose.orientation,
            useFixedBase=links[0].mass == 0,
            flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )
    except pybullet.error as error:
        raise ValueError(f"a body of {len(links)} links: PyBullet cannot make it ({error})") from None
    finally:
        os.unlink(path)  # or there would be one more file for every body that has come
    names = [pybullet.getJointInfo(body, number, client)[12] for number in range(len(links) - 1)]
    numbers = [-1, *(names.index(f"l{index}".encode()) for index in range(1, len(links)))]
    for link, number in zip(links, numbers):
        if link.hinge is not None:
            _settle(client, body, number, link.hinge)
        if link.mass:
            moments = list(link.inertia.moments)
            pybullet.changeDynamics(body, number, localInertiaDiagonal=moments, physicsClientId=client)
    return body, numbers


def _settle(client: int, body: int, number: int, hinge: Hinge) -> None:
    """Let a link be of V-REP's material, and its joint turn freely."""
    pybullet.changeDynamics(body, number, lateralFriction=1, restitution=0, physicsClientId=client)
    pybullet.changeDynamics(body, number, jointDamping=0, maxJointVelocity=_FASTEST, physicsClientId=client)
    if hinge.motion != "fixed":
        pybullet.setJointMotorControl2(body, number, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client)
        pybullet.resetJointState(body, number, hinge.value, 0, client)


# ---- as a URDF


def _urdf(files: BulletFiles, links: Sequence[Link]) -> bytes:
    robot = Xml.Element("robot", name="assembly")
    for index, link in enumerate(links):
        _add_link(files, robot, index, link)
    for index, link in enumerate(links):
        if link.hinge is not None:
            _add_joint(robot, index, link.hinge)
    Xml.indent(robot)  # PyBullet cuts long lines
    return Xml.tostring(robot)


def _add_link(files: BulletFiles, robot: Xml.Element, index: int, link: Link) -> None:
    element = Xml.SubElement(robot, "link", name=f"l{index}")
    inertial = Xml.SubElement(element, "inertial")
    _add_origin(inertial, frames.multiply(link.local, link.inertia.frame))
    Xml.SubElement(inertial, "mass", value=repr(link.mass))
    # PyBullet refuses moments that no solid has, such as V-REP lets one have: they are set afterwards, as they are.
    a = b = c = repr(max(link.inertia.moments))
    Xml.SubElement(inertial, "inertia", ixx=a, iyy=b, izz=c, ixy="0", ixz="0", iyz="0")
    for number, part in enumerate(link.parts):
        told = part.shape.for_bullet(files, moves=link.mass != 0)
        assert isinstance(told, Geometry), "a URDF cannot be a part of another body"
        place = frames.multiply(link.local, part.local)
        seen = _add_shape(element, "visual", place, told)
        material = Xml.SubElement(seen, "material", name=f"m{index}_{number}")
        Xml.SubElement(material, "color", rgba=" ".join(map(repr, part.color)))
        solid = _add_shape(element, "collision", place, told)
        if told.flags:
            solid.set("concave", "yes")


def _add_joint(robot: Xml.Element, index: int, hinge: Hinge) -> None:
    kind = "continuous" if hinge.motion == "revolute" and hinge.limits is None else hinge.motion
    joint = Xml.SubElement(robot, "joint", name=f"j{index}", type=kind)
    Xml.SubElement(joint, "parent", link=f"l{hinge.parent}")
    Xml.SubElement(joint, "child", link=f"l{index}")
    _add_origin(joint, hinge.local)
    Xml.SubElement(joint, "axis", xyz="0 0 1")
    if hinge.limits is not None or hinge.motion == "prismatic":
        low, high = map(repr, hinge.limits or (-_NO_LIMIT, _NO_LIMIT))
        Xml.SubElement(joint, "limit", lower=low, upper=high, effort=repr(_NO_LIMIT), velocity=repr(_NO_LIMIT))


def _add_shape(element: Xml.Element, kind: str, place: Matrix, told: Geometry) -> Xml.Element:
    shape = Xml.SubElement(element, kind)
    _add_origin(shape, place)
    word, attributes = _geometry(told, kind)
    Xml.SubElement(Xml.SubElement(shape, "geometry"), word, attributes)
    return shape


def _geometry(told: Geometry, kind: str) -> tuple[str, dict[str, str]]:
    """Return a URDF's word for a shape, and its attributes."""
    given = told.visual if kind == "visual" else told.collision
    if told.type == "GEOM_BOX":
        return "box", {"size": " ".join(repr(2 * half) for half in given["halfExtents"])}
    if told.type == "GEOM_MESH":
        scale = " ".join(repr(float(one)) for one in given.get("meshScale", (1.0, 1.0, 1.0)))
        return "mesh", {"filename": given["fileName"], "scale": scale}
    radius = {"radius": repr(given["radius"])}
    if told.type == "GEOM_SPHERE":
        return "sphere", radius
    word = "capsule" if told.type == "GEOM_CAPSULE" else "cylinder"
    return word, {**radius, "length": repr(given["height" if "height" in given else "length"])}


def _add_origin(element: Xml.Element, matrix: Matrix) -> None:
    xyz, rpy = (" ".join(map(repr, three)) for three in (frames.position(matrix), frames.to_rpy(matrix)))
    Xml.SubElement(element, "origin", xyz=xyz, rpy=rpy)
