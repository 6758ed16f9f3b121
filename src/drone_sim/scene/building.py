"""The bodies of a scene's shapes, one each, but for those that joints hold together; and where entries stand."""

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
from drone_sim.world.assemblies import Hinge, Link


class Built(NamedTuple):
    """A body in the world: its chain, its number, and its link (-1: the root) for each entry of a shape."""

    chain: Chain
    body: int
    links: dict[int, int]


def alone(entries: Mapping[int, EntryParameters], chains: Iterable[Chain]) -> list[Chain]:
    """Return a chain of its own for each shape that is in none of these."""
    held = {index for chain in chains for index in chain.shapes()}
    shapes = (index for index, one in entries.items() if isinstance(one, ObjectParameters))
    return [Chain(index, []) for index in shapes if index not in held]


def build(
    world: World, entries: Mapping[int, EntryParameters], chains: Iterable[Chain], matrices: Mapping[int, Matrix]
) -> list[Built]:
    """Put the shapes of chains into the world, or none. `matrices` has for each entry the world from its frame.

    Raises ValueError, in one line, for a file that cannot be read.
    """
    made: list[Built] = []
    try:
        for chain in chains:
            if chain.hung or chain.root is None:
                body, links = _together(world, entries, chain, matrices)
            else:
                body, links = _alone(world, entries[chain.root], matrices[chain.root]), [-1]
            places = {index: link for index, link in zip(chain.shapes(), links) if index is not None}
            made.append(Built(chain, body, places))
    except ValueError:
        for one in made:
            world.remove(one.body)
        raise
    for one in made:
        for index, link in one.links.items():
            _make_seem(world, entries[index], one.body, link)
    return made


def _make_seem(world: World, one: EntryParameters, body: int, link: int) -> None:
    if isinstance(one, ObjectParameters) and (one.friction, one.restitution) != (1.0, 0.0):
        world.set_material(body, link, one.friction, one.restitution)
    if isinstance(one, ObjectParameters) and not one.respondable:
        world.collision_filter.let_everything_pass(body, link)
    if isinstance(one, ObjectParameters) and not one.visible:
        world.pictures.hide(body, link)
    if isinstance(one, ObjectParameters) and one.static and one.mass:
        world.collision_filter.freeze(body, still=True)


def _alone(world: World, one: EntryParameters, matrix: Matrix) -> int:
    assert isinstance(one, ObjectParameters), "a body consists of shapes"
    shape = one.to_shape()
    pose = _pose(matrix)
    if isinstance(shape, Compound) or one.inertia is not None:
        return world.add_assembly([_link(one, IDENTITY)], pose, [one.texture])[0]
    return world.add_object(shape, pose, mass=one.mass, color=one.color, texture=one.texture)


def _together(
    world: World, entries: Mapping[int, EntryParameters], chain: Chain, matrices: Mapping[int, Matrix]
) -> tuple[int, list[int]]:
    root = entries[chain.root] if chain.root is not None else None
    first = _link(root, IDENTITY) if isinstance(root, ObjectParameters) else Link(())
    links, textures = [first], [getattr(root, "texture", "")]
    for hung in chain.hung:
        shape = entries[hung.shape]
        assert isinstance(shape, ObjectParameters), "a chain consists of joints and shapes"
        links.append(_link(shape, shape.local)._replace(hinge=_hinge(entries, hung)))
        textures.append(shape.texture)
    return world.add_assembly(links, _pose(_frame(entries, chain, matrices)), textures)


def _frame(entries: Mapping[int, EntryParameters], chain: Chain, matrices: Mapping[int, Matrix]) -> Matrix:
    """Return the world from the frame of a chain's root: the shape's, or that of the parent of its only first joint."""
    if chain.root is not None:
        return matrices[chain.root]
    joint = chain.hung[0].joint
    return multiply(matrices[joint], frames.invert(entries[joint].local))


def _hinge(entries: Mapping[int, EntryParameters], hung: Hung) -> Hinge:
    joint = entries[hung.joint]
    if isinstance(joint, ForceSensorParameters):
        return Hinge(hung.above, hung.local, "fixed", None, 0.0)
    assert isinstance(joint, JointParameters), "a chain consists of joints and shapes"
    return Hinge(hung.above, hung.local, joint.type, joint.limits, joint.value)


def _link(one: ObjectParameters, local: Matrix) -> Link:
    parts = parts_of(one.to_shape(), one.color)
    if not one.mass:
        return Link(parts, local)
    inertia = one.inertia.inertia if one.inertia is not None else inertia_of(parts, one.mass)
    return Link(parts, local, one.mass, inertia)


def _pose(matrix: Matrix) -> Pose:
    return Pose(frames.position(matrix), frames.to_quaternion(matrix))


# ---- where they stand


def parents_first(entries: Mapping[int, EntryParameters]) -> list[int]:
    """Return the indices of entries, no parent after its children, else as they come. There is no circle among them."""
    index_of = {one.name: index for index, one in entries.items()}
    ordered: dict[int, None] = {}
    for index in entries:
        waiting: list[int] = []
        above: int | None = index
        while above is not None and above not in ordered:
            waiting.append(above)
            above = index_of.get(entries[above].parent)
        ordered.update((one, None) for one in reversed(waiting))
    return list(ordered)


def motion(one: EntryParameters) -> Matrix:
    """Return the transform between an entry's frame and what hangs on it: that which a joint makes."""
    if not isinstance(one, JointParameters):
        return IDENTITY
    if one.type == PRISMATIC:
        return from_rpy((0.0, 0.0, one.value), (0.0, 0.0, 0.0))
    return from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, one.value))
