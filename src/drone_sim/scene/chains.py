"""The bodies of a scene's shapes: one for each free shape, and one for each articulation ("chain").

A revolute or prismatic joint that is not kinematic and has exactly one child shape with mass connects that shape to its
nearest ancestor that is such a shape or joint, or else to the joint's parent, which is static or kinematic. A force
sensor with such a child shape holds it rigidly. Shapes with mass that no joint or force sensor connects move
independently: parent and child in the tree are not rigidly joined.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from drone_sim.config.types import ParameterError
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, from_rpy, multiply
from drone_sim.mechanics.joint import PRISMATIC
from drone_sim.mechanics.state import Pose
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.joints import ForceSensorParameters, JointParameters
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.shapes.compound import Compound, parts_of
from drone_sim.shapes.mass import inertia_of
from drone_sim.world import World
from drone_sim.world.assemblies import Link, LinkJoint

MOST_HELD = 127  # per body; PyBullet has at most 128 links and returns no state for larger bodies
_Entries = Mapping[int, EntryParameters]
_Holder = JointParameters | ForceSensorParameters


class Hung(NamedTuple):
    """A shape attached by a joint or force sensor, both as indices of entries.

    above: index in the chain of the link that it is attached to; local: that link's frame from the joint's. The frame
    of a root is that of the shape (or of the joint's parent); the frame of a held link is the moved frame of its joint.
    """

    joint: int
    shape: int
    above: int
    local: Matrix


class Chain(NamedTuple):
    """An articulation: a root and the shapes attached to it, nearest first. `root` is a shape with mass, or None.

    A free shape is a root to which nothing is attached.
    """

    root: int | None
    hung: list[Hung]

    def shapes(self) -> Iterator[int | None]:
        """Yield the entries of the shapes, the root first."""
        yield self.root
        yield from (hung.shape for hung in self.hung)

    def members(self) -> Iterator[int]:
        """Yield the entries of all shapes, joints and force sensors."""
        yield from (shape for shape in self.shapes() if shape is not None)
        yield from (hung.joint for hung in self.hung)


class Built(NamedTuple):
    """A body in the world: its chain, its number, and the link (-1: the root) of each shape, by entry."""

    chain: Chain
    body: int
    links: dict[int, int]


def found(entries: _Entries) -> tuple[list[Chain], dict[int, str]]:
    """Return the chains of a scene's shapes, and why the dynamics cannot move other joints that should be dynamic.

    Entries may be in any order, but without a cycle of parents. The reasons are by the joint's entry. Raises
    ParameterError for a chain of more than MOST_HELD joints.
    """
    return _Search(entries).run()


class _Search:
    def __init__(self, entries: _Entries):
        self._entries = entries
        self._index = {entry.name: index for index, entry in entries.items()}
        self._held: dict[int, int] = {}  # joint -> shape
        self._chains: list[Chain] = []
        self._place: dict[int, tuple[Chain, int]] = {}  # shape or joint -> chain, and index in it

    def run(self) -> tuple[list[Chain], dict[int, str]]:
        holders = {index: entry for index, entry in self._entries.items() if isinstance(entry, _Holder)}
        shapes_below: dict[int, list[int]] = {index: [] for index in holders}
        for index, entry in self._entries.items():
            parent = self._index.get(entry.parent, -1)
            if parent in holders and isinstance(entry, ObjectParameters) and entry.moves:
                shapes_below[parent].append(index)
        reasons = {}
        for index, entry in holders.items():
            shapes = shapes_below[index]
            if not shapes if isinstance(entry, ForceSensorParameters) else entry.mode == "kinematic":
                continue
            reason = self._reason(entry, shapes)
            if reason:
                reasons[index] = reason
            else:
                self._held[index] = shapes[0]
        for joint in self._held:
            self._put(joint)
        for chain in self._chains:
            if len(chain.hung) > MOST_HELD:
                name = self._entries[chain.hung[0].joint if chain.root is None else chain.root].name
                what = f"{len(chain.hung)} joints and force sensors in a chain from '{name}'"
                raise ParameterError(f"{what}: at most {MOST_HELD} are allowed")
        connected = {index for chain in self._chains for index in chain.shapes()}
        shapes = [index for index, entry in self._entries.items() if isinstance(entry, ObjectParameters)]
        return [*(Chain(index, []) for index in shapes if index not in connected), *self._chains], reasons

    def _reason(self, holder: _Holder, shapes: Sequence[int]) -> str:
        """Return why the dynamics cannot move a joint that is not kinematic; '' if it can."""
        if isinstance(holder, JointParameters) and holder.type == "spherical":
            return "spherical joints are not part of the dynamics"
        if not shapes:
            return "they have no child shape with a mass"
        if len(shapes) > 1:
            return f"they have {len(shapes)} child shapes with a mass, not one"
        above = self._holder(holder)[0]
        ends = (self._entries[index] for index in (shapes[0], above) if index is not None)
        if any(isinstance(entry, ObjectParameters) and entry.shape == "urdf" for entry in ends):
            return "joints cannot hold a urdf"
        return ""

    def _holder(self, joint: EntryParameters) -> tuple[int | None, Matrix]:
        """Return the entry of the shape or joint that holds a joint, and its frame from the joint's.

        None stands for the joint's parent or the world.
        """
        local, ancestor = joint.local, self._index.get(joint.parent)
        while ancestor is not None:
            entry = self._entries[ancestor]
            if ancestor in self._held or (isinstance(entry, ObjectParameters) and entry.moves):
                return ancestor, local
            if isinstance(entry, JointParameters):
                break  # scripts move this joint: its children are kinematic
            local, ancestor = multiply(entry.local, local), self._index.get(entry.parent)
        return None, joint.local

    def _put(self, joint: int) -> tuple[Chain, int]:
        """Add a joint and its shape to a chain, unless they are in one; return the chain and their index."""
        if joint not in self._place:
            shape = self._held[joint]
            holder, local = self._holder(self._entries[joint])
            chain, above, start = self._link_of(holder)
            chain.hung.append(Hung(joint, shape, above, multiply(start, local)))
            self._place[joint] = self._place[shape] = chain, len(chain.hung)
        return self._place[joint]

    def _link_of(self, holder: int | None) -> tuple[Chain, int, Matrix]:
        """Return chain and index of the link of `holder`, and that link's frame from the holder's."""
        if holder is None:
            self._chains.append(Chain(None, []))
            return self._chains[-1], 0, IDENTITY
        if holder in self._held:
            return *self._put(holder), IDENTITY
        parent = self._index.get(self._entries[holder].parent, -1)
        if self._held.get(parent) == holder:
            return *self._put(parent), self._entries[holder].local
        if holder not in self._place:
            self._chains.append(Chain(holder, []))
            self._place[holder] = self._chains[-1], 0
        return *self._place[holder], IDENTITY


# ---- building


def build(world: World, entries: _Entries, chains: Iterable[Chain], matrices: Mapping[int, Matrix]) -> list[Built]:
    """Add the shapes of chains to the world; on an error, none of them. `matrices` are world from entry.

    Raises ValueError with a message of one line for a file that cannot be read.
    """
    built: list[Built] = []
    try:
        for chain in chains:
            if chain.hung or chain.root is None:
                body, links = _articulated(world, entries, chain, matrices)
            else:
                body, links = _single(world, entries[chain.root], matrices[chain.root]), [-1]
            places = {index: link for index, link in zip(chain.shapes(), links) if index is not None}
            built.append(Built(chain, body, places))
    except ValueError:
        for item in built:
            world.remove(item.body)
        raise
    for item in built:
        for index, link in item.links.items():
            entry = entries[index]
            assert isinstance(entry, ObjectParameters), "a body consists of shapes"
            if (entry.friction, entry.restitution) != (1.0, 0.0):
                world.set_material(item.body, link, entry.friction, entry.restitution)
            if not entry.respondable:
                world.collision_filter.let_everything_pass(item.body, link)
            if not entry.visible:
                world.pictures.hide(item.body, link)
            if entry.static and entry.mass:
                world.collision_filter.freeze(item.body, still=True)
    return built


def _single(world: World, entry: EntryParameters, matrix: Matrix) -> int:
    assert isinstance(entry, ObjectParameters), "a body consists of shapes"
    shape = entry.to_shape()
    pose = Pose.of(matrix)
    if isinstance(shape, Compound) or entry.inertia is not None:
        return world.add_assembly([_link(entry, IDENTITY)], pose, [entry.texture])[0]
    return world.add_object(shape, pose, mass=entry.mass, color=entry.color, texture=entry.texture)


def _articulated(
    world: World, entries: _Entries, chain: Chain, matrices: Mapping[int, Matrix]
) -> tuple[int, list[int]]:
    if chain.root is None:  # the frame is that of the first joint's parent
        joint = chain.hung[0].joint
        links, textures = [Link(())], [""]
        frame = multiply(matrices[joint], frames.invert(entries[joint].local))
    else:
        root = entries[chain.root]
        assert isinstance(root, ObjectParameters), "a chain consists of joints and shapes"
        links, textures = [_link(root, IDENTITY)], [root.texture]
        frame = matrices[chain.root]
    for hung in chain.hung:
        shape = entries[hung.shape]
        assert isinstance(shape, ObjectParameters), "a chain consists of joints and shapes"
        links.append(_link(shape, shape.local)._replace(joint=_link_joint(entries, hung)))
        textures.append(shape.texture)
    return world.add_assembly(links, Pose.of(frame), textures)


def _link_joint(entries: _Entries, hung: Hung) -> LinkJoint:
    joint = entries[hung.joint]
    if isinstance(joint, ForceSensorParameters):
        return LinkJoint(hung.above, hung.local, "fixed", None, 0.0)
    assert isinstance(joint, JointParameters), "a chain consists of joints and shapes"
    return LinkJoint(hung.above, hung.local, joint.type, joint.limits, joint.value)


def _link(entry: ObjectParameters, local: Matrix) -> Link:
    parts = parts_of(entry.to_shape(), entry.color)
    if not entry.mass:
        return Link(parts, local)
    inertia = entry.inertia.inertia if entry.inertia is not None else inertia_of(parts, entry.mass)
    return Link(parts, local, entry.mass, inertia)


# ---- order and transforms of entries


def parents_first(entries: _Entries) -> list[int]:
    """Return the indices of entries in their order, but each parent before its children; there must be no cycle."""
    index_of = {entry.name: index for index, entry in entries.items()}
    ordered: dict[int, None] = {}
    for index in entries:
        waiting: list[int] = []
        parent: int | None = index
        while parent is not None and parent not in ordered:
            waiting.append(parent)
            parent = index_of.get(entries[parent].parent)
        ordered.update((ancestor, None) for ancestor in reversed(waiting))
    return list(ordered)


def motion(entry: EntryParameters) -> Matrix:
    """Return entry from child frame: the joint's present motion, or the identity if the entry is not a joint."""
    if not isinstance(entry, JointParameters):
        return IDENTITY
    if entry.type == PRISMATIC:
        return from_rpy((0.0, 0.0, entry.value), (0.0, 0.0, 0.0))
    return from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, entry.value))
