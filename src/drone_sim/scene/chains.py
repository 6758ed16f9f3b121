"""Finds the joints that the dynamics moves, and the articulations ("chains") of joints, force sensors and shapes.

A revolute or prismatic joint that is not kinematic and has exactly one child shape with mass connects that shape to its
nearest ancestor that is such a shape or joint, or else to the joint's parent, which is static or kinematic. A force
sensor with such a child shape holds it rigidly. Shapes with mass that no joint or force sensor connects move
independently: parent and child in the tree are not rigidly joined.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.frames import IDENTITY, Matrix, multiply
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.force_sensor import ForceSensorParameters
from drone_sim.scene.kinds.joint import JointParameters
from drone_sim.scene.object_parameters import ObjectParameters

MOST_HELD = 127  # per body; PyBullet has at most 128 links and returns no state for larger bodies
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
    """An articulation: a root and the shapes attached to it, nearest first. `root` is a shape with mass, or None."""

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


class Chains(NamedTuple):
    """All chains, and for each other joint that should be dynamic why it is not, by entry."""

    chains: list[Chain]
    reasons: dict[int, str]


def found(entries: Mapping[int, EntryParameters]) -> Chains:
    """Return the chains of a scene's entries, which may be in any order, but without a cycle of parents.

    Raises ParameterError for a chain of more than MOST_HELD joints.
    """
    return _Search(entries).run()


def _is_dynamic(entry: _Holder) -> bool:
    return isinstance(entry, ForceSensorParameters) or entry.mode != "kinematic"


class _Search:
    def __init__(self, entries: Mapping[int, EntryParameters]):
        self._entries = entries
        self._index = {entry.name: index for index, entry in entries.items()}
        self._held: dict[int, int] = {}  # joint -> shape
        self._place: dict[int, tuple[Chain, int]] = {}  # shape or joint -> chain, and index in it

    def run(self) -> Chains:
        reasons = {}
        joints = {index: entry for index, entry in self._entries.items() if isinstance(entry, _Holder)}
        shapes_below = self._moving_children(joints)
        for index, entry in joints.items():
            reason = self._reason(entry, shapes_below[index])
            if reason:
                reasons[index] = reason
            elif _is_dynamic(entry) and shapes_below[index]:
                self._held[index] = shapes_below[index][0]
        chains: list[Chain] = []
        for joint in self._held:
            self._put(joint, chains)
        for chain in chains:
            self._check(chain)
        return Chains(chains, reasons)

    def _check(self, chain: Chain) -> None:
        if len(chain.hung) > MOST_HELD:
            name = self._entries[chain.hung[0].joint if chain.root is None else chain.root].name
            raise ParameterError(
                f"{len(chain.hung)} joints and force sensors in a chain from '{name}': at most {MOST_HELD} are allowed"
            )

    def _moving_children(self, joints: Mapping[int, _Holder]) -> dict[int, list[int]]:
        below: dict[int, list[int]] = {index: [] for index in joints}
        for index, entry in self._entries.items():
            if entry.parent and isinstance(entry, ObjectParameters) and entry.moves:
                parent = self._index.get(entry.parent, -1)
                if parent in below:
                    below[parent].append(index)
        return below

    def _reason(self, joint: _Holder, shapes: Sequence[int]) -> str:
        """Return why the dynamics cannot move a joint that is not kinematic; '' otherwise."""
        if not _is_dynamic(joint) or (isinstance(joint, ForceSensorParameters) and not shapes):
            return ""
        if isinstance(joint, JointParameters) and joint.type == "spherical":
            return "spherical joints are not part of the dynamics"
        if not shapes:
            return "they have no child shape with a mass"
        if len(shapes) > 1:
            return f"they have {len(shapes)} child shapes with a mass, not one"
        if any(self._is_urdf(index) for index in (shapes[0], self._holder(joint)[0])):
            return "joints cannot hold a urdf"
        return ""

    def _is_urdf(self, index: int | None) -> bool:
        entry = self._entries[index] if index is not None else None
        return isinstance(entry, ObjectParameters) and entry.shape == "urdf"

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

    def _put(self, joint: int, chains: list[Chain]) -> tuple[Chain, int]:
        """Add a joint and its shape to a chain, unless they are in one; return the chain and their index."""
        if joint in self._place:
            return self._place[joint]
        shape = self._held[joint]
        holder, local = self._holder(self._entries[joint])
        chain, above, start = self._link_of(holder, chains)
        chain.hung.append(Hung(joint, shape, above, multiply(start, local)))
        self._place[joint] = self._place[shape] = chain, len(chain.hung)
        return self._place[joint]

    def _link_of(self, holder: int | None, chains: list[Chain]) -> tuple[Chain, int, Matrix]:
        """Return chain and index of the link of `holder`, and that link's frame from the holder's."""
        if holder is None:
            chains.append(Chain(None, []))
            return chains[-1], 0, IDENTITY
        if holder in self._held:
            return *self._put(holder, chains), IDENTITY
        parent = self._index.get(self._entries[holder].parent, -1)
        if self._held.get(parent) == holder:
            return *self._put(parent, chains), self._entries[holder].local
        if holder not in self._place:
            chains.append(Chain(holder, []))
            self._place[holder] = chains[-1], 0
        return *self._place[holder], IDENTITY
