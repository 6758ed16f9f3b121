"""Bodies of several shapes, or of several links with joints; PyBullet gets them as a URDF that is written here.

Among PyBullet's ways to create a body, only a URDF has no limit of parts or links and states every inertia.
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
_MAX_VELOCITY = 1e4  # rad/s or m/s of a joint; PyBullet's own limit is 100
_NO_INERTIA = PrincipalInertia((0.0, 0.0, 0.0))


class LinkJoint(NamedTuple):
    """How a link is attached to its parent: by a joint about or along z.

    parent: index of the parent link; local: the parent's frame from the joint's; motion: "revolute", "prismatic", or
    "fixed"; limits: rad or m, None: unlimited; value: initial position, rad or m.
    """

    parent: int
    local: Matrix
    motion: str
    limits: tuple[float, float] | None
    value: float


class Link(NamedTuple):
    """A rigid body of an assembly. Its frame is its joint's frame after the motion; the first link has no joint.

    local: link from parts; mass: kg; inertia: in the frame of the parts.
    """

    parts: Sequence[Part]
    local: Matrix = IDENTITY
    mass: float = 0.0
    inertia: PrincipalInertia = _NO_INERTIA
    joint: LinkJoint | None = None


def create(client: int, files: BulletFiles, links: Sequence[Link], pose: Pose) -> tuple[int, list[int]]:
    """Create an assembly with the first link's frame at a pose; return its body id, and PyBullet's number of each link.

    It is fixed to the world if its first link has no mass. Raises ValueError, in one line, for an unreadable file.
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
        raise ValueError(f"a body of {len(links)} links: PyBullet cannot create it ({error})") from None
    finally:
        os.unlink(path)  # otherwise every new body would leave a file
    names = [pybullet.getJointInfo(body, number, client)[12] for number in range(len(links) - 1)]
    numbers = [-1, *(names.index(f"l{index}".encode()) for index in range(1, len(links)))]
    for link, number in zip(links, numbers):
        if link.joint is not None:
            _set_joint(client, body, number, link.joint)
        if link.mass:
            moments = list(link.inertia.moments)
            pybullet.changeDynamics(body, number, localInertiaDiagonal=moments, physicsClientId=client)
    return body, numbers


def _set_joint(client: int, body: int, number: int, joint: LinkJoint) -> None:
    """Give a link V-REP's material, and let its joint move freely."""
    pybullet.changeDynamics(body, number, lateralFriction=1, restitution=0, physicsClientId=client)
    pybullet.changeDynamics(body, number, jointDamping=0, maxJointVelocity=_MAX_VELOCITY, physicsClientId=client)
    if joint.motion != "fixed":
        pybullet.setJointMotorControl2(body, number, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client)
        pybullet.resetJointState(body, number, joint.value, 0, client)


# ---- as a URDF


def _urdf(files: BulletFiles, links: Sequence[Link]) -> bytes:
    robot = Xml.Element("robot", name="assembly")
    for index, link in enumerate(links):
        _add_link(files, robot, index, link)
    for index, link in enumerate(links):
        if link.joint is not None:
            _add_joint(robot, index, link.joint)
    Xml.indent(robot)  # PyBullet truncates long lines
    return Xml.tostring(robot)


def _add_link(files: BulletFiles, robot: Xml.Element, index: int, link: Link) -> None:
    element = Xml.SubElement(robot, "link", name=f"l{index}")
    inertial = Xml.SubElement(element, "inertial")
    _add_origin(inertial, frames.multiply(link.local, link.inertia.frame))
    Xml.SubElement(inertial, "mass", value=repr(link.mass))
    # PyBullet refuses moments that no solid can have, but V-REP allows them: the true ones are set afterwards.
    a = b = c = repr(max(link.inertia.moments))
    Xml.SubElement(inertial, "inertia", ixx=a, iyy=b, izz=c, ixy="0", ixz="0", iyz="0")
    for number, part in enumerate(link.parts):
        geometry = part.shape.for_bullet(files, moves=link.mass != 0)
        assert isinstance(geometry, Geometry), "a URDF cannot be a part"
        pose = frames.multiply(link.local, part.local)
        visual = _add_shape(element, "visual", pose, geometry)
        material = Xml.SubElement(visual, "material", name=f"m{index}_{number}")
        Xml.SubElement(material, "color", rgba=" ".join(map(repr, part.color)))
        collision = _add_shape(element, "collision", pose, geometry)
        if geometry.flags:
            collision.set("concave", "yes")


def _add_joint(robot: Xml.Element, index: int, joint: LinkJoint) -> None:
    kind = "continuous" if joint.motion == "revolute" and joint.limits is None else joint.motion
    element = Xml.SubElement(robot, "joint", name=f"j{index}", type=kind)
    Xml.SubElement(element, "parent", link=f"l{joint.parent}")
    Xml.SubElement(element, "child", link=f"l{index}")
    _add_origin(element, joint.local)
    Xml.SubElement(element, "axis", xyz="0 0 1")
    if joint.limits is not None or joint.motion == "prismatic":
        low, high = map(repr, joint.limits or (-_NO_LIMIT, _NO_LIMIT))
        Xml.SubElement(element, "limit", lower=low, upper=high, effort=repr(_NO_LIMIT), velocity=repr(_NO_LIMIT))


def _add_shape(element: Xml.Element, kind: str, pose: Matrix, geometry: Geometry) -> Xml.Element:
    shape = Xml.SubElement(element, kind)
    _add_origin(shape, pose)
    tag, attributes = _geometry(geometry, kind)
    Xml.SubElement(Xml.SubElement(shape, "geometry"), tag, attributes)
    return shape


def _geometry(geometry: Geometry, kind: str) -> tuple[str, dict[str, str]]:
    """Return the URDF tag of a shape, and its attributes."""
    arguments = geometry.visual if kind == "visual" else geometry.collision
    if geometry.type == "GEOM_BOX":
        return "box", {"size": " ".join(repr(2 * half) for half in arguments["halfExtents"])}
    if geometry.type == "GEOM_MESH":
        scale = " ".join(repr(float(factor)) for factor in arguments.get("meshScale", (1.0, 1.0, 1.0)))
        return "mesh", {"filename": arguments["fileName"], "scale": scale}
    radius = {"radius": repr(arguments["radius"])}
    if geometry.type == "GEOM_SPHERE":
        return "sphere", radius
    tag = "capsule" if geometry.type == "GEOM_CAPSULE" else "cylinder"
    return tag, {**radius, "length": repr(arguments["height" if "height" in arguments else "length"])}


def _add_origin(element: Xml.Element, matrix: Matrix) -> None:
    xyz, rpy = (" ".join(map(repr, three)) for three in (frames.position(matrix), frames.to_rpy(matrix)))
    Xml.SubElement(element, "origin", xyz=xyz, rpy=rpy)
