"""The bodies of a scene's shapes: one each, but for those that joints hold together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, multiply
from drone_sim.mechanics.state import Pose
from drone_sim.scene.chains import Chain, Hung
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.force_sensor import ForceSensorParameters
from drone_sim.scene.kinds.joint import JointParameters
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.shapes.compound import Compound, parts_of
from drone_sim.shapes.mass import inertia_of
from drone_sim.world import World
from drone_sim.world.assemblies import Hinge, Link


class Built(NamedTuple):
    """The bodies in the world: by entry of a shape the body and its link (-1: the root), by chain the body."""

    places: dict[int, tuple[int, int]]
    chains: list[int]


def build(
    world: World, entries: Sequence[EntryParameters], chains: Sequence[Chain], matrices: Mapping[int, Matrix]
) -> Built:
    """Put the shapes among the entries into the world. `matrices` has for each entry the world from its frame.

    Raises ValueError, in one line, for a file that cannot be read.
    """
    held = {index for chain in chains for index in (chain.root, *(one.shape for one in chain.hung))}
    places = {
        index: (_alone(world, one, matrices[index]), -1)
        for index, one in enumerate(entries)
        if isinstance(one, ObjectParameters) and index not in held
    }
    numbers = []
    for chain in chains:
        body, links = _together(world, entries, chain, matrices)
        numbers.append(body)
        members = [chain.root, *(one.shape for one in chain.hung)]
        places.update((index, (body, link)) for index, link in zip(members, links) if index is not None)
    for index, (body, link) in places.items():
        _make_seem(world, entries[index], body, link)
    return Built(places, numbers)


def _make_seem(world: World, one: EntryParameters, body: int, link: int) -> None:
    if isinstance(one, ObjectParameters) and not one.respondable:
        world.let_everything_pass(body, link)
    if isinstance(one, ObjectParameters) and not one.visible:
        world.hide(body, link)


def _alone(world: World, one: ObjectParameters, matrix: Matrix) -> int:
    shape = one.to_shape()
    pose = one.pose if not one.parent else _pose(matrix)
    if isinstance(shape, Compound) or one.inertia is not None:
        return world.add_assembly([_link(one, IDENTITY)], pose, [one.texture])[0]
    return world.add_object(shape, pose, mass=one.mass, color=one.color, texture=one.texture)


def _together(
    world: World, entries: Sequence[EntryParameters], chain: Chain, matrices: Mapping[int, Matrix]
) -> tuple[int, list[int]]:
    root = entries[chain.root] if chain.root is not None else None
    first = _link(root, IDENTITY) if isinstance(root, ObjectParameters) else Link(())
    links, textures = [first], [getattr(root, "texture", "")]
    for hung in chain.hung:
        shape = entries[hung.shape]
        assert isinstance(shape, ObjectParameters), "a chain holds shapes"
        links.append(_link(shape, shape.local)._replace(hinge=_hinge(entries, hung)))
        textures.append(shape.texture)
    return world.add_assembly(links, _pose(_frame(entries, chain, matrices)), textures)


def _frame(entries: Sequence[EntryParameters], chain: Chain, matrices: Mapping[int, Matrix]) -> Matrix:
    """Return the world from the frame of a chain's root: the shape's, or that of the parent of its only first joint."""
    if chain.root is not None:
        return matrices[chain.root]
    joint = chain.hung[0].joint
    return multiply(matrices[joint], frames.invert(entries[joint].local))


def _hinge(entries: Sequence[EntryParameters], hung: Hung) -> Hinge:
    joint = entries[hung.joint]
    if isinstance(joint, ForceSensorParameters):
        return Hinge(hung.above, hung.local, "fixed", None, 0.0)
    assert isinstance(joint, JointParameters), "a chain hangs on joints"
    return Hinge(hung.above, hung.local, joint.type, joint.limits, joint.value)


def _link(one: ObjectParameters, local: Matrix) -> Link:
    parts = parts_of(one.to_shape(), one.color)
    if not one.mass:
        return Link(parts, local)
    inertia = one.inertia.inertia if one.inertia is not None else inertia_of(parts, one.mass)
    return Link(parts, local, one.mass, inertia)


def _pose(matrix: Matrix) -> Pose:
    return Pose(frames.position(matrix), frames.to_quaternion(matrix))
