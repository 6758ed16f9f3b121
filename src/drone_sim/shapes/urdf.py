"""A URDF as an object of a scene: links and joints with their shapes; mass and inertia also where it states none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

import numpy as np

from drone_sim.config.types import File
from drone_sim.files import urdf_files
from drone_sim.mechanics import frames, urdf
from drone_sim.shapes.box import Box
from drone_sim.shapes.capsule import Capsule
from drone_sim.shapes.compound import Part
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.mass import PrincipalInertia, inertia_of, principal
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.shape import WHITE, Files, SceneShape, UrdfFile
from drone_sim.shapes.sphere import Sphere

_DEFAULT_MASS = 1.0  # kg, of a moving link without a stated mass, as in PyBullet
_ROUNDING = 1e-9  # fraction of the largest moment


@dataclass(frozen=True)
class Urdf(SceneShape):
    """A URDF, which states its own looks and masses; with a mass of 0 its root link is fixed to the world."""

    word = "urdf"

    file: File
    size: tuple[()] = ()

    def __str__(self) -> str:
        return f"{self.word} {self.file}"

    def for_bullet(self, files: Files, moves: bool) -> UrdfFile:
        """Return the checked and cleaned file, with the inertia of each link."""
        robot = self._robot()
        try:
            moments = _complete_inertials(robot)
        except ValueError as error:
            raise ValueError(f"{self}: {error}") from None
        return UrdfFile(files.urdf(robot), moments)

    def meshes(self) -> Iterator[tuple[str, Sequence[float]]]:
        """Yield path and scale of the meshes of its visuals and collisions."""
        for mesh in self._robot().iter("mesh"):
            yield mesh.attrib["filename"], [float(word) for word in mesh.attrib["scale"].split()]

    def _robot(self) -> Xml.Element:
        try:
            return urdf_files.read(self.file)
        except OSError as error:
            raise ValueError(f"{self}: {error.strerror or error}") from None
        except ValueError as error:
            raise ValueError(f"{self}: {error}") from None


def _complete_inertials(robot: Xml.Element) -> dict[str, tuple[float, float, float]]:
    """Write an <inertial> into each link of a checked URDF; return the links' principal moments (kg m²), by name.

    A link with a mass and no inertia is evenly filled. One without <inertial> has no mass if a fixed joint holds it,
    else 1 kg. Raises ValueError, in one line, for a tensor with a negative moment, and for a mesh that cannot be read.
    """
    fixed = (joint for joint in robot.findall("joint") if joint.get("type") == "fixed")
    held = {joint.findall("child")[0].attrib["link"] for joint in fixed}
    return {name: _complete(link, name in held) for link in robot.findall("link") for name in [link.attrib["name"]]}


def _complete(link: Xml.Element, is_held: bool) -> tuple[float, float, float]:
    has_inertial = link.find("inertial") is not None
    mass = urdf.mass_of(link) if has_inertial else 0.0 if is_held else _DEFAULT_MASS
    tensor, centre = urdf.inertia_tensor(link), frames.position(urdf.origin_of(link.find("inertial")))
    inertia = principal(tensor, np.array(centre)) if tensor.any() else _evenly_filled(link, mass)
    least = min(inertia.moments)
    if least < -_ROUNDING * max(map(abs, inertia.moments)):
        raise ValueError(f"link {link.attrib['name']}: inertia: principal moment {least:g} kg m²: must be 0 or more")
    _write(link, mass, inertia)
    return inertia.moments


def _evenly_filled(link: Xml.Element, mass: float) -> PrincipalInertia:
    """Return the inertia of a mass that fills the link's collision shapes, or else its visuals."""
    parts = [*_parts(link, "collision")] or [*_parts(link, "visual")]
    if mass and parts:
        return inertia_of(parts, mass)
    return PrincipalInertia((mass, mass, mass), urdf.origin_of(link.find("inertial")))


def _parts(link: Xml.Element, kind: str) -> Iterator[Part]:
    for element in link.findall(kind):
        shape = _shape(element.findall("geometry/*")[0])
        if shape is not None:
            yield Part(shape, urdf.origin_of(element), WHITE)


def _shape(geometry: Xml.Element) -> SceneShape | None:
    """Return a shape; None for a plane, which has no volume."""
    if geometry.tag == "mesh":
        x, y, z = _numbers(geometry, "scale")
        return Mesh(geometry.attrib["filename"], (x, y, z))
    if geometry.tag == "box":
        x, y, z = _numbers(geometry, "size")
        return Box((x, y, z))
    if geometry.tag == "plane":
        return None
    (radius,) = _numbers(geometry, "radius")
    if geometry.tag == "sphere":
        return Sphere((radius,))
    (length,) = _numbers(geometry, "length")
    return Cylinder((radius, length)) if geometry.tag == "cylinder" else Capsule((radius, length))


def _numbers(geometry: Xml.Element, attribute: str) -> list[float]:
    return [float(word) for word in geometry.attrib[attribute].split()]


def _write(link: Xml.Element, mass: float, inertia: PrincipalInertia) -> None:
    for old in link.findall("inertial"):
        link.remove(old)
    inertial = Xml.SubElement(link, "inertial")
    frame = inertia.frame
    xyz, rpy = (" ".join(map(repr, three)) for three in (frames.position(frame), frames.to_rpy(frame)))
    Xml.SubElement(inertial, "origin", xyz=xyz, rpy=rpy)
    Xml.SubElement(inertial, "mass", value=repr(mass))
    a = b = c = repr(max(inertia.moments))
    Xml.SubElement(inertial, "inertia", ixx=a, iyy=b, izz=c, ixy="0", ixz="0", iyz="0")
