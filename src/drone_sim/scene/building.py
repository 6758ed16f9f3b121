"""Builds the bodies of a scene's shapes (one per shape or articulation), and orders and transforms of entries."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, from_rpy, multiply
from drone_sim.mechanics.joint import PRISMATIC
from drone_sim.mechanics.state import Pose
from drone_sim.scene.chains import Chain, Hung
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.force_sensor import ForceSensorParameters
from drone_sim.scene.kinds.joint import JointParameters
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.shapes.compound import Compound, parts_of
from drone_sim.shapes.mass import inertia_of
from drone_sim.world import World
from drone_sim.world.assemblies import Link, LinkJoint


class Built(NamedTuple):
    """A body in the world: its chain, its number, and the link (-1: the root) of each shape, by entry."""

    chain: Chain
    body: int
    links: dict[int, int]


def alone(entries: Mapping[int, EntryParameters], chains: Iterable[Chain]) -> list[Chain]:
    """Return a chain of a single shape for each shape that is in none of `chains`."""
    held = {index for chain in chains for index in chain.shapes()}
    shapes = (index for index, entry in entries.items() if isinstance(entry, ObjectParameters))
    return [Chain(index, []) for index in shapes if index not in held]


def build(
    world: World, entries: Mapping[int, EntryParameters], chains: Iterable[Chain], matrices: Mapping[int, Matrix]
) -> list[Built]:
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
            _set_properties(world, entries[index], item.body, link)
    return built


def _set_properties(world: World, entry: EntryParameters, body: int, link: int) -> None:
    if isinstance(entry, ObjectParameters) and (entry.friction, entry.restitution) != (1.0, 0.0):
        world.set_material(body, link, entry.friction, entry.restitution)
    if isinstance(entry, ObjectParameters) and not entry.respondable:
        world.collision_filter.let_everything_pass(body, link)
    if isinstance(entry, ObjectParameters) and not entry.visible:
        world.pictures.hide(body, link)
    if isinstance(entry, ObjectParameters) and entry.static and entry.mass:
        world.collision_filter.freeze(body, still=True)


def _single(world: World, entry: EntryParameters, matrix: Matrix) -> int:
    assert isinstance(entry, ObjectParameters), "a body consists of shapes"
    shape = entry.to_shape()
    pose = _pose(matrix)
    if isinstance(shape, Compound) or entry.inertia is not None:
        return world.add_assembly([_link(entry, IDENTITY)], pose, [entry.texture])[0]
    return world.add_object(shape, pose, mass=entry.mass, color=entry.color, texture=entry.texture)


def _articulated(
    world: World, entries: Mapping[int, EntryParameters], chain: Chain, matrices: Mapping[int, Matrix]
) -> tuple[int, list[int]]:
    root = entries[chain.root] if chain.root is not None else None
    first = _link(root, IDENTITY) if isinstance(root, ObjectParameters) else Link(())
    links, textures = [first], [getattr(root, "texture", "")]
    for hung in chain.hung:
        shape = entries[hung.shape]
        assert isinstance(shape, ObjectParameters), "a chain consists of joints and shapes"
        links.append(_link(shape, shape.local)._replace(joint=_link_joint(entries, hung)))
        textures.append(shape.texture)
    return world.add_assembly(links, _pose(_frame(entries, chain, matrices)), textures)


def _frame(entries: Mapping[int, EntryParameters], chain: Chain, matrices: Mapping[int, Matrix]) -> Matrix:
    """Return world from a chain's root: the shape, or else the parent of the chain's first joint."""
    if chain.root is not None:
        return matrices[chain.root]
    joint = chain.hung[0].joint
    return multiply(matrices[joint], frames.invert(entries[joint].local))


def _link_joint(entries: Mapping[int, EntryParameters], hung: Hung) -> LinkJoint:
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


def _pose(matrix: Matrix) -> Pose:
    return Pose(frames.position(matrix), frames.to_quaternion(matrix))


# ---- order and transforms


def parents_first(entries: Mapping[int, EntryParameters]) -> list[int]:
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
