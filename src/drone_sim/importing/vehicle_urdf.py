"""URDF of an imported quadricopter: its masses, inertias, poses, collision shapes and visuals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree import ElementTree as Xml

from drone_sim.importing.folder import Report, number
from drone_sim.importing.placing import Placed
from drone_sim.importing.quadricopters import Propeller, VrepQuadricopter, swings_on
from drone_sim.importing.shapes import MeshWriter, Surface, TooLarge, color, has_triangles, simple_size
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.vrep_files.model import Rgba, VrepMesh

PLACES = ("front_left", "back_left", "back_right", "front_right")  # of V-REP's propellers 1 to 4
_MAX_COLLISIONS = 16  # of a body; more are merged into one hull
_MAX_COLORS = 64  # of a link
_MIN_MASS = 1e-6  # kg
_RADIUS_OF_GYRATION = 0.05  # m, of a body without an inertia in the file


class VehicleUrdf:
    """Builds the URDF of a quadricopter; its poses are relative to the root's."""

    def __init__(self, quadricopter: VrepQuadricopter, writer: MeshWriter, report: Report):
        """Write meshes with `writer`; add differences to `report`."""
        self._quadricopter = quadricopter
        self._writer = writer
        self._report = report
        self._robot = Xml.Element("robot", name="quadricopter")

    def build(self, parts: Sequence[Placed], looks: Sequence[Placed]) -> str:
        """Return the URDF; `parts` are further bodies fixed to it, `looks` its other shapes, which are only drawn."""
        quadricopter = self._quadricopter
        root = quadricopter.root
        base = self._link("base_link", root, root.matrix)
        joints = (propeller.joint for propeller in quadricopter.propellers)
        blade_sets = [[] if joint is None else list(joint.subtree()) for joint in joints]
        bodies = [root, *(propeller.body for propeller in quadricopter.propellers), *parts]
        fixed = [
            node for node in (*bodies, *looks) if node.is_visible and not any(node in blades for blades in blade_sets)
        ]
        self._add_visuals(base, root.name, fixed, root.matrix)
        for place, propeller, blades in zip(PLACES, quadricopter.propellers, blade_sets):
            self._add_propeller(place, propeller, [node for node in blades if node.is_visible and node in looks])
        for index, part in enumerate(parts, start=1):
            name, swings = f"part_{index}", swings_on(part, root)
            frame = part.matrix if swings is None else swings.matrix
            if swings is None:
                self._link(name, part, frame)
            else:  # a point mass at its joint, because a spherical joint transfers no torque
                mass = part.object.shape.mass if part.object.shape is not None else 0.0
                mass = max(mass, _MIN_MASS) if mass else 0.0
                _add_inertial(Xml.SubElement(self._robot, "link", name=name), mass, IDENTITY, (0.0, 0.0, 0.0))
            self._joint(name, "base_link", frames.relative(root.matrix, frame))
        # The frame of drone_sim's front camera, at the front of the body.
        _add_inertial(Xml.SubElement(self._robot, "link", name="front_optical"), 0.0, IDENTITY, (0.0, 0.0, 0.0))
        forward = frames.from_rpy((0.16, 0.0, 0.0), (-1.5707963267948966, 0.0, -1.5707963267948966))
        self._joint("front_optical", "base_link", forward)
        Xml.indent(self._robot)
        return f'<?xml version="1.0"?>\n{Xml.tostring(self._robot, encoding="unicode")}\n'

    # ---- links

    def _add_propeller(self, place: str, propeller: Propeller, blades: Sequence[Placed]) -> None:
        frame, name = force_frame(propeller), f"propeller_{place}"
        self._link(name, propeller.body, frame)
        self._joint(name, "base_link", frames.relative(self._quadricopter.root.matrix, frame))
        if propeller.joint is not None and blades:
            link = Xml.SubElement(self._robot, "link", name=f"blades_{place}")
            _add_inertial(link, 0.0, IDENTITY, (0.0, 0.0, 0.0))
            self._add_visuals(link, f"{propeller.body.name}_blades", blades, propeller.joint.matrix)
            self._joint(f"blades_{place}", name, frames.relative(frame, propeller.joint.matrix), "continuous")

    def _link(self, name: str, body: Placed, frame: Matrix) -> Xml.Element:
        """Add a link with the mass and collision shapes of a body; `frame` is its frame in the world."""
        place = frames.relative(frame, body.matrix)
        link = Xml.SubElement(self._robot, "link", name=name)
        shape = body.object.shape
        if shape is None:
            return link
        mass = max(shape.mass, _MIN_MASS)
        if shape.inertia is None or max(shape.inertia.moments) == 0:
            self._report.add(body.name, "has no inertia in the file: that of a ball of 0.1 m is used")
            moment = mass * _RADIUS_OF_GYRATION**2
            _add_inertial(link, mass, place, (moment, moment, moment))
        else:
            a, b, c = (mass * moment for moment in shape.inertia.moments)
            _add_inertial(link, mass, frames.multiply(place, shape.inertia.pose.matrix), (a, b, c))
        if body.is_respondable:
            self._add_collisions(link, body, shape.meshes, place)
        return link

    def _add_collisions(self, link: Xml.Element, body: Placed, meshes: Sequence[VrepMesh], place: Matrix) -> None:
        if len(meshes) > _MAX_COLLISIONS:
            self._add_mesh(link, "collision", body.name, [(mesh, IDENTITY) for mesh in meshes], place)
            return
        for mesh in meshes:
            simple = None if mesh.primitive is None else simple_size(mesh.primitive)
            if simple is None or mesh.primitive is None:
                self._add_mesh(link, "collision", body.name, [(mesh, IDENTITY)], place)
                continue
            element = Xml.SubElement(link, "collision")
            _add_origin(element, frames.multiply(place, mesh.primitive.pose.matrix))
            _add_geometry(element, *simple)

    def _joint(self, link: str, parent: str, place: Matrix, kind: str = "fixed") -> None:
        joint = Xml.SubElement(self._robot, "joint", name=f"{link}_joint", type=kind)
        Xml.SubElement(joint, "parent", link=parent)
        Xml.SubElement(joint, "child", link=link)
        _add_origin(joint, place)
        if kind != "fixed":
            Xml.SubElement(joint, "axis", xyz="0 0 1")

    # ---- looks

    def _add_visuals(self, link: Xml.Element, name: str, shapes: Iterable[Placed], frame: Matrix) -> None:
        """Add a visual mesh for each colour of some shapes."""
        by_color: dict[Rgba, list[Surface]] = {}
        for node in shapes:
            place = frames.relative(frame, node.matrix)
            for mesh in node.object.shape.meshes if node.object.shape is not None else ():
                if has_triangles(mesh):
                    key = mesh.color if len(by_color) < _MAX_COLORS or mesh.color in by_color else next(iter(by_color))
                    by_color.setdefault(key, []).append((mesh, place))
        for surfaces in by_color.values():
            self._add_mesh(link, "visual", name, surfaces, IDENTITY)

    def _add_mesh(self, link: Xml.Element, kind: str, name: str, surfaces: Sequence[Surface], place: Matrix) -> None:
        nonempty = [surface for surface in surfaces if has_triangles(surface[0])]
        if not nonempty:
            return
        try:
            file = self._writer.write(name, nonempty)
        except TooLarge as error:
            self._report.add(name, f"{'is not drawn' if kind == 'visual' else 'collides with nothing'}: {error}")
            return
        element = Xml.SubElement(link, kind)
        _add_origin(element, place)
        Xml.SubElement(Xml.SubElement(element, "geometry"), "mesh", filename=file)
        rgba = color(nonempty)
        if kind == "visual" and rgba is not None:
            material = Xml.SubElement(element, "material", name=" ".join(f"{value:.4g}" for value in rgba))
            Xml.SubElement(material, "color", rgba=_text(rgba))


def force_frame(propeller: Propeller) -> Matrix:
    """Return the frame, in the world, of a propeller's thrust along z: body's centre of mass, force sensor's axes."""
    body, inertia = propeller.body, propeller.body.object.shape.inertia if propeller.body.object.shape else None
    centre = frames.transform(body.matrix, (0.0, 0.0, 0.0) if inertia is None else inertia.pose.position)
    m = propeller.link.matrix
    return (*m[:3], centre[0], *m[4:7], centre[1], *m[8:11], centre[2])


def _add_inertial(link: Xml.Element, mass: float, place: Matrix, moments: tuple[float, float, float]) -> None:
    inertial = Xml.SubElement(link, "inertial")
    _add_origin(inertial, place)
    Xml.SubElement(inertial, "mass", value=repr(number(mass, 9)))
    ixx, iyy, izz = (repr(number(max(moment, 1e-12) if mass else 0.0, 15)) for moment in moments)
    Xml.SubElement(inertial, "inertia", ixx=ixx, iyy=iyy, izz=izz, ixy="0", ixz="0", iyz="0")


def _add_origin(element: Xml.Element, place: Matrix) -> None:
    if place != IDENTITY:
        Xml.SubElement(element, "origin", xyz=_text(frames.position(place)), rpy=_text(frames.to_rpy(place)))


def _add_geometry(element: Xml.Element, word: str, size: tuple[float, ...]) -> None:
    geometry = Xml.SubElement(element, "geometry")
    if word == "box":
        Xml.SubElement(geometry, word, size=_text(size))
    elif word == "sphere":
        Xml.SubElement(geometry, word, radius=_text(size))
    else:
        Xml.SubElement(geometry, word, radius=_text(size[:1]), length=_text(size[1:]))


def _text(values: Iterable[float]) -> str:
    return " ".join(repr(number(value, 9)) for value in values)
