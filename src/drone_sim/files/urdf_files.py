"""Reading of URDF files: the result has only known elements, a tree of links, and numbers in range.

PyBullet does not check URDFs: two roots, an empty name or a circle of joints crash it or make it hang.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as Xml

from drone_sim.files.mesh_files import KINDS
from drone_sim.files.resources import MEBIBYTE, is_file, locate, read_bytes
from drone_sim.message_text import MAX_NAME, shown

MAX_SIZE = 4 * MEBIBYTE  # bytes of a file
MAX_LINKS = 100
MAX_SHAPES = 500  # visuals and collisions
JOINTS = ("fixed", "continuous", "revolute", "prismatic")


class _Numbers(NamedTuple):
    """Range check of an attribute with `size` numbers."""

    size: int
    low: float
    high: float
    or_zero: bool = False
    default: str = ""

    def check(self, text: str) -> str:
        """Return the text of the numbers in a form that PyBullet reads. Raises ValueError."""
        words = text[:1000].split()
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) != self.size or not all(map(math.isfinite, numbers)):
            raise ValueError(f"{shown(text)}: must be {self.size} finite numbers")
        for number in numbers:
            if not (self.low <= number <= self.high or (self.or_zero and number == 0)):
                zero = "0, or " if self.or_zero else ""
                raise ValueError(f"{shown(text)}: must be {zero}from {self.low:g} to {self.high:g}")
        return " ".join(map(repr, numbers))


_Attributes = Mapping[str, _Numbers]
_Colors = Mapping[str | None, Xml.Element | None]
_LENGTH = _Numbers(1, 1e-6, 1e4)
_MOMENT = _Numbers(1, 1e-12, 1e9, or_zero=True, default="0")
_PRODUCT = _Numbers(1, -1e9, 1e9, default="0")
_ORIGIN: _Attributes = {"xyz": _Numbers(3, -1e4, 1e4, default="0 0 0"), "rpy": _Numbers(3, -1e3, 1e3, default="0 0 0")}
_INERTIA: _Attributes = {
    **{name: _MOMENT for name in ("ixx", "iyy", "izz")},
    **{name: _PRODUCT for name in ("ixy", "ixz", "iyz")},
}
_SHAPES: dict[str, _Attributes] = {
    "box": {"size": _LENGTH._replace(size=3)},
    "cylinder": {"radius": _LENGTH, "length": _LENGTH},
    "capsule": {"radius": _LENGTH, "length": _LENGTH},
    "sphere": {"radius": _LENGTH},
    "plane": {"normal": _Numbers(3, -1, 1)},
    "mesh": {"scale": _Numbers(3, -1e6, 1e6, default="1 1 1")},
}
_JOINT: dict[str, _Attributes] = {
    "axis": {"xyz": _Numbers(3, -1e4, 1e4, default="1 0 0")},
    "dynamics": {name: _Numbers(1, 0, 1e6, default="0") for name in ("damping", "friction")},
    "limit": {
        **{name: _Numbers(1, -1e4, 1e4, default="0") for name in ("lower", "upper")},
        **{name: _Numbers(1, 0, 1e6, default="0") for name in ("effort", "velocity")},
    },
}
_CONTACT: dict[str, _Attributes] = {
    name: {"value": _Numbers(1, 0, 1e6)}
    for name in ("lateral_friction", "rolling_friction", "spinning_friction", "restitution", "stiffness", "damping")
}


class _Builder(Xml.TreeBuilder):
    def doctype(self, *_: str | None) -> None:
        """Raise ValueError: a DOCTYPE can define entities that expand without limit."""
        raise ValueError("must have no DOCTYPE")


def read(path: str, kinds: Sequence[str] = JOINTS) -> Xml.Element:
    """Return a URDF's <robot>, checked, without unknown elements, and with absolute paths of its meshes.

    `kinds` are the allowed types of joints. Raises OSError, and ValueError in one line without the file's name.
    """
    return parse(read_bytes(path, MAX_SIZE), Path(path).parent, kinds)


def parse(content: bytes, folder: Path, kinds: Sequence[str]) -> Xml.Element:
    """Return the <robot> of a URDF in `folder`, as `read` does. Raises the same."""
    parser = Xml.XMLParser(target=_Builder())
    try:
        parser.feed(content)
        robot = parser.close()
    except Xml.ParseError as error:
        raise ValueError(str(error)) from None
    except (LookupError, UnicodeError) as error:  # an unknown encoding
        raise ValueError(str(error)) from None
    if robot.tag != "robot":
        raise ValueError(f"its outermost element must be <robot>, not <{robot.tag:.60}>")
    links, joints = robot.findall("link"), robot.findall("joint")
    if len(robot.findall("link/*/geometry")) > MAX_SHAPES:
        raise ValueError(f"more than {MAX_SHAPES} visuals and collisions")
    _check_tree(links, joints, kinds)
    clean = Xml.Element("robot", name="robot")
    colors = {material.get("name"): material.find("color") for material in robot.findall("material")}
    for link in links:
        with _place_in_errors(_label(link)):
            _add_link(link, clean, folder, colors)
    for joint in joints:
        with _place_in_errors(_label(joint)):
            _add_joint(joint, clean)
    return clean


@contextlib.contextmanager
def _place_in_errors(place: str) -> Iterator[None]:
    try:
        yield
    except (ValueError, OSError) as error:
        raise ValueError(f"{place}: {error}") from None


def _label(element: Xml.Element) -> str:
    return f"{element.tag} {element.get('name', '')}"


# ---- the tree


def _check_tree(links: Sequence[Xml.Element], joints: Sequence[Xml.Element], kinds: Sequence[str]) -> None:
    if max(len(links), len(joints)) > MAX_LINKS:
        raise ValueError(f"{len(links)} links and {len(joints)} joints; at most {MAX_LINKS} are allowed")
    names = _unique_names(links)
    _unique_names(joints)
    if not names:
        raise ValueError("must have at least one link")
    parents: dict[str, str] = {}
    for joint in joints:
        kind = joint.get("type")
        if kind not in kinds:
            raise ValueError(f"{_label(joint)}: type {kind!s:.60}: must be {', '.join(kinds[:-1])} or {kinds[-1]}")
        ends = {end: _linked_name(joint, end, names) for end in ("parent", "child")}
        if ends["child"] in parents:
            raise ValueError(f"link {ends['child']}: is the child of two joints, one of them {joint.get('name')}")
        parents[ends["child"]] = ends["parent"]
    roots = [name for name in names if name not in parents]
    if len(roots) != 1:
        raise ValueError(f"must have one root link, has {', '.join(roots[:5]) or 'none: its joints form a circle'}")
    try:
        TopologicalSorter({child: [parent] for child, parent in parents.items()}).prepare()
    except CycleError as error:
        first = next(name for name in names if name in error.args[1])
        raise ValueError(f"link {first}: its joints form a circle") from None


def _unique_names(elements: Sequence[Xml.Element]) -> list[str]:
    names: dict[str, None] = {}
    for element in elements:
        name = element.get("name", "")
        if not name or len(name) > MAX_NAME or not name.isprintable():
            raise ValueError(f"{element.tag} name={shown(name)}: must be a name of 1 to {MAX_NAME} characters")
        if name in names:
            raise ValueError(f"{element.tag} {name}: is defined twice")
        names[name] = None
    return list(names)


def _linked_name(joint: Xml.Element, end: str, links: Sequence[str]) -> str:
    element = joint.find(end)
    if element is None:
        raise ValueError(f"{_label(joint)}: {end} is missing")
    name = element.get("link", "")
    if name not in links:
        raise ValueError(f"{_label(joint)}: {end} {shown(name)}: there is no such link")
    return name


# ---- elements


def _add(element: Xml.Element | None, attributes: _Attributes, parent: Xml.Element, tag: str) -> None:
    """Add a copy of an element that has only these attributes."""
    if element is None:
        return
    copied = Xml.SubElement(parent, tag)
    for name, numbers in attributes.items():
        text = element.get(name, numbers.default)
        try:
            copied.set(name, numbers.check(text))
        except ValueError as error:
            raise ValueError(f"{tag} {name} = {error}") from None


def _add_material(material: Xml.Element, parent: Xml.Element, colors: _Colors) -> None:
    """Add a material with only its colour, named after that colour; textures of URDFs are not drawn."""
    color = material.find("color")
    color = colors.get(material.get("name")) if color is None else color
    if color is not None:
        copied = Xml.SubElement(parent, "material")
        _add(color, {"rgba": _Numbers(4, 0, 1)}, copied, "color")
        copied.set("name", copied[0].get("rgba", ""))


def _add_link(link: Xml.Element, robot: Xml.Element, folder: Path, colors: _Colors) -> None:
    copied = Xml.SubElement(robot, "link", name=link.get("name", ""))
    inertial = link.find("inertial")
    if inertial is not None:
        copied_inertial = Xml.SubElement(copied, "inertial")
        _add(inertial.find("origin"), _ORIGIN, copied_inertial, "origin")
        mass = _check_mass(inertial.find("mass"))
        Xml.SubElement(copied_inertial, "mass", value=repr(mass))
        inertia = inertial.find("inertia")
        _add(Xml.Element("inertia") if inertia is None else inertia, _INERTIA, copied_inertial, "inertia")
    contact = link.find("contact")
    if contact is not None:
        copied_contact = Xml.SubElement(copied, "contact")
        for name, attributes in _CONTACT.items():
            _add(contact.find(name), attributes, copied_contact, name)
    for kind in ("visual", "collision"):
        for shape in link.findall(kind):
            with _place_in_errors(kind):
                _add_shape(shape, copied, folder)
                material = shape.find("material")
                if material is not None and kind == "visual":
                    _add_material(material, copied[-1], colors)


def _check_mass(element: Xml.Element | None) -> float:
    mass = 0.0 if element is None else float(_Numbers(1, -math.inf, math.inf).check(element.get("value", "")))
    if mass < 0:
        raise ValueError(f"mass {mass} kg: must not be negative")
    if mass != 0 and not 1e-6 <= mass <= 1e6:
        raise ValueError(f"mass {mass} kg: must be 0, or from 1e-06 to 1e+06")
    return mass


def _add_shape(shape: Xml.Element, link: Xml.Element, folder: Path) -> None:
    copied = Xml.SubElement(link, shape.tag)
    if shape.get("concave") == "yes":
        copied.set("concave", "yes")
    _add(shape.find("origin"), _ORIGIN, copied, "origin")
    geometry = shape.find("geometry")
    kinds = [] if geometry is None else list(geometry)
    if len(kinds) != 1 or kinds[0].tag not in _SHAPES:
        raise ValueError(f"geometry: must hold one of {', '.join(_SHAPES)}")
    (source,) = kinds
    copied_geometry = Xml.SubElement(copied, "geometry")
    _add(source, _SHAPES[source.tag], copied_geometry, source.tag)
    target = copied_geometry[0]
    if source.tag == "mesh":
        target.set("filename", _mesh_path(source.get("filename", ""), folder))
        scale = target.get("scale", "")
        if any(abs(float(word)) < 1e-6 for word in scale.split()):
            raise ValueError(f"mesh scale = {scale}: must not be smaller than 1e-06")
    if source.tag == "plane" and not any(float(word) for word in target.get("normal", "").split()):
        raise ValueError("plane normal: must not be 0 0 0")


def _mesh_path(name: str, folder: Path) -> str:
    plain = name[len("file://") :] if name.startswith("file://") else name
    path = locate(plain) if plain.startswith("package://") else folder / plain
    if not is_file(path):
        raise ValueError(f"no such mesh file: {shown(name) if name else '(no filename)'}")
    if path.suffix.lower() not in KINDS:
        raise ValueError(f"mesh {path}: must be one of {', '.join(KINDS)}")
    return str(path.resolve())


def _add_joint(joint: Xml.Element, robot: Xml.Element) -> None:
    kind = joint.get("type", "")
    copied = Xml.SubElement(robot, "joint", name=joint.get("name", ""), type=kind)
    _add(joint.find("origin"), _ORIGIN, copied, "origin")
    for end in ("parent", "child"):
        element = joint.find(end)
        if element is not None:
            Xml.SubElement(copied, end, link=element.get("link", ""))
    for name, attributes in _JOINT.items():
        _add(joint.find(name), attributes, copied, name)
    axis = copied.find("axis")
    if axis is not None and math.hypot(*map(float, axis.get("xyz", "").split())) < 1e-3:
        raise ValueError("axis xyz: must not be 0 0 0")
    limit = copied.find("limit")
    if kind in ("revolute", "prismatic") and limit is None:
        raise ValueError("no limit")
    if limit is not None and float(limit.get("lower", "0")) > float(limit.get("upper", "0")):
        raise ValueError(f"limit: lower {limit.get('lower')} is more than upper {limit.get('upper')}")
