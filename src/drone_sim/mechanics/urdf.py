"""Reader of a drone's URDF as one rigid body, since V-REP's force sensors hold its links together rigidly.

PyBullet's own URDF_MERGE_FIXED_LINKS adds up the links' inertias without the terms that their rotations and offsets
bring, and an unmerged drone of five links costs twice the time per step. So the links are merged here, by the
parallel axis theorem:

    m = sum m_i      c = sum m_i c_i / m      I = sum R_i I_i R_i^T + m_i (|d|² 1 - d d^T),  d = c_i - c
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as Xml

import numpy as np

from drone_sim.files import urdf_files
from drone_sim.files.resources import is_file, read_bytes
from drone_sim.mechanics.frames import IDENTITY, Matrix, from_rpy, multiply, position, to_rpy, transform
from drone_sim.mechanics.inertia import Inertial, combined

_MAX_CACHED = 8  # URDFs


class UrdfError(ValueError):
    """A URDF cannot be used; the message is one line with the file, the element and the reason."""


class BladesLink(NamedTuple):
    """A visual that rotates about a joint's z axis: its index, joint, root from joint, joint from visual."""

    visual: int
    joint_name: str
    joint: Matrix
    local: Matrix


@dataclass(frozen=True)
class RigidBody:
    """All links of a URDF as one body, in the frame of the root link (metres, kilograms)."""

    mass: float
    inertials: dict[str, Inertial]  # by link
    centre_of_mass: np.ndarray  # (3,)
    inertia: np.ndarray  # (3, 3), about the centre of mass, root link's axes
    links: dict[str, Matrix]  # root from link, joints at zero
    parents: dict[str, tuple[str, Matrix]]  # by link, except the root: its parent, and parent from link
    blade_joints: dict[str, str]  # by link that rotates about its z axis: its joint
    visuals: tuple[tuple[str, Matrix], ...]  # of each visual: its link, and link from visual
    blades: tuple[BladesLink, ...]
    xml: str  # the same body as a URDF of one link


def read(path: str) -> RigidBody:
    """Return the URDF at `path` as one rigid body, which must not be changed. Raises UrdfError."""
    try:
        content, folder = read_bytes(path, urdf_files.MAX_SIZE), Path(path).absolute().parent
        if not all(map(is_file, _merged(content, folder)[1])):
            _merged.cache_clear()  # reading again raises an error with the missing mesh
        return _merged(content, folder)[0]
    except OSError as error:
        raise UrdfError(f"{path}: {error.strerror or error}") from None
    except ValueError as error:
        raise UrdfError(f"{path}: {' '.join(str(error).split())}") from None


@lru_cache(maxsize=_MAX_CACHED)  # all flights of a plan have the same vehicle
def _merged(content: bytes, folder: Path) -> tuple[RigidBody, list[Path]]:
    """Return the body of a URDF, and the meshes that must exist for it."""
    robot = urdf_files.parse(content, folder, ("fixed", "continuous"))
    return _merge(robot), [Path(mesh.attrib["filename"]) for mesh in robot.iter("mesh")]


def _merge(robot: Xml.Element) -> RigidBody:
    links = {link.attrib["name"]: link for link in robot.findall("link")}
    joints = {_link_name(joint, "child"): joint for joint in robot.findall("joint")}
    poses = {name: _pose(name, joints) for name in links}
    roots = [name for name in links if name not in joints]
    inertials = {}
    for name, link in links.items():
        centre = np.array(transform(poses[name], origin_of(link.find("inertial"))[3::4]))
        inertials[name] = Inertial(mass_of(link), centre, inertia_tensor(link, poses[name]))
    whole = combined(list(inertials.values()))
    rotating = {name: joint.attrib["name"] for name, joint in joints.items() if joint.attrib["type"] == "continuous"}
    visuals = [(name, visual) for name, link in links.items() for visual in link.findall("visual")]
    return RigidBody(
        mass=whole.mass,
        inertials=inertials,
        centre_of_mass=whole.centre,
        inertia=whole.inertia,
        links=poses,
        parents={name: (_link_name(joint, "parent"), origin_of(joint)) for name, joint in joints.items()},
        blade_joints=rotating,
        visuals=tuple((name, origin_of(visual)) for name, visual in visuals),
        blades=tuple(
            BladesLink(index, rotating[name], poses[name], origin_of(visual))
            for index, (name, visual) in enumerate(visuals)
            if name in rotating
        ),
        xml=_one_link(robot, roots[0], poses, whole),
    )


def _pose(link: str, joints: dict[str, Xml.Element]) -> Matrix:
    pose = IDENTITY
    while link in joints:
        joint = joints[link]
        pose = multiply(origin_of(joint), pose)
        link = _link_name(joint, "parent")
    return pose


def _link_name(joint: Xml.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.attrib["link"]


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))


def origin_of(element: Xml.Element | None) -> Matrix:
    """Return the transform of an element's <origin>, parent from element; IDENTITY if there is none."""
    origin = None if element is None else element.find("origin")
    if origin is None:
        return IDENTITY
    return from_rpy(_numbers(origin.attrib["xyz"]), _numbers(origin.attrib["rpy"]))


def mass_of(link: Xml.Element) -> float:
    """Return a link's mass (kg), 0 if it has none."""
    element = link.find("inertial/mass")
    return 0.0 if element is None else float(element.attrib["value"])


def inertia_tensor(link: Xml.Element, pose: Matrix = IDENTITY) -> np.ndarray:
    """Return a link's inertia (3, 3), kg m², or 0, along the axes of the frame in which it is at `pose`."""
    element = link.find("inertial/inertia")
    if element is None:
        return np.zeros((3, 3))
    xx, xy, xz, yy, yz, zz = (float(element.attrib[key]) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    rotation = np.array(multiply(pose, origin_of(link.find("inertial")))).reshape(3, 4)[:, :3]
    return rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T


def _one_link(robot: Xml.Element, root: str, poses: dict[str, Matrix], whole: Inertial) -> str:
    """Return a URDF of one link with the collisions and visuals of all, and the inertia of the whole."""
    merged = Xml.Element("robot", name=robot.get("name", "drone"))
    link = Xml.SubElement(merged, "link", name=root)
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "origin", xyz=" ".join(repr(float(x)) for x in whole.centre))
    Xml.SubElement(inertial, "mass", value=repr(whole.mass))
    upper = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    Xml.SubElement(inertial, "inertia", {key: repr(float(whole.inertia[at])) for key, at in upper.items()})
    for kind in ("collision", "visual"):
        for source in robot.findall("link"):
            for element in source.findall(kind):
                matrix = multiply(poses[source.attrib["name"]], origin_of(element))
                xyz, rpy = (" ".join(map(repr, three)) for three in (position(matrix), to_rpy(matrix)))
                moved = copy.deepcopy(element)
                for origin in moved.findall("origin"):
                    moved.remove(origin)
                Xml.SubElement(moved, "origin", xyz=xyz, rpy=rpy)
                link.append(moved)
    return Xml.tostring(merged, encoding="unicode")
