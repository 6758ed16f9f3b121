"""Which joints of a scene the dynamics moves, and what hangs together by them and by force sensors.

A joint that is not kinematic, is revolute or prismatic, and has just one shape with a mass right below it, holds that
shape to what is above: to the next such shape or joint upwards, else to its parent, which stands still or carries it. A
force sensor with such a shape holds it rigidly. Shapes with a mass that neither of these connects move independently:
parent and child in the tree are not rigidly joined.
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

MOST_HELD = 127  # of one body: PyBullet counts 128 links, and knows no state of a larger one
_Holding = JointParameters | ForceSensorParameters


class Hung(NamedTuple):
    """A shape on a joint, or on a force sensor, both as indices among the entries.

    above: index in the chain of what it is held to; local: that one's frame from the joint's, where the frame of a
    root is the shape's (or the joint's parent's) and that of what is held is its joint's, as it has moved.
    """

    joint: int
    shape: int
    above: int
    local: Matrix


class Chain(NamedTuple):
    """A root and what hangs on it, first what is nearest. `root` is the entry of a shape with a mass, or None."""

    root: int | None
    hung: list[Hung]

    def shapes(self) -> Iterator[int | None]:
        """Yield the entries of its shapes, first the root."""
        yield self.root
        yield from (one.shape for one in self.hung)

    def members(self) -> Iterator[int]:
        """Yield the entries of all that it is made of."""
        yield from (one for one in self.shapes() if one is not None)
        yield from (one.joint for one in self.hung)


class Chains(NamedTuple):
    """All chains; and why other joints are moved by scripts alone, by their entry."""

    chains: list[Chain]
    reasons: dict[int, str]


def found(entries: Mapping[int, EntryParameters]) -> Chains:
    """Return the chains among the entries of a scene, whose parents come in any order, but not in a circle.

    Raises ParameterError for one of more than MOST_HELD joints.
    """
    return _Search(entries).run()


def _holds(one: _Holding) -> bool:
    """Tell whether something may hold a shape in the dynamics."""
    return isinstance(one, ForceSensorParameters) or one.mode != "kinematic"


class _Search:
    def __init__(self, entries: Mapping[int, EntryParameters]):
        self._entries = entries
        self._index = {one.name: index for index, one in entries.items()}
        self._held: dict[int, int] = {}  # shape by joint
        self._place: dict[int, tuple[Chain, int]] = {}  # of a shape or a joint: the chain, and the index in it

    def run(self) -> Chains:
        reasons = {}
        joints = {index: one for index, one in self._entries.items() if isinstance(one, _Holding)}
        below = self._shapes_below(joints)
        for index, one in joints.items():
            reason = self._reason(one, below[index])
            if reason:
                reasons[index] = reason
            elif _holds(one) and below[index]:
                self._held[index] = below[index][0]
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

    def _shapes_below(self, joints: Mapping[int, _Holding]) -> dict[int, list[int]]:
        """Return the shapes with a mass right below each joint."""
        below: dict[int, list[int]] = {index: [] for index in joints}
        for index, one in self._entries.items():
            if one.parent and isinstance(one, ObjectParameters) and one.moves:
                above = self._index.get(one.parent, -1)
                if above in below:
                    below[above].append(index)
        return below

    def _reason(self, joint: _Holding, below: Sequence[int]) -> str:
        """Return why the dynamics does not move a joint that should be; '' where it does, or should not."""
        if not _holds(joint) or (isinstance(joint, ForceSensorParameters) and not below):
            return ""
        if isinstance(joint, JointParameters) and joint.type == "spherical":
            return "spherical joints are not part of the dynamics"
        if not below:
            return "they have no child shape with a mass"
        if len(below) > 1:
            return f"they have {len(below)} child shapes with a mass, not one"
        if any(self._is_urdf(index) for index in (below[0], self._holder(joint)[0])):
            return "joints cannot hold a urdf"
        return ""

    def _is_urdf(self, index: int | None) -> bool:
        one = self._entries[index] if index is not None else None
        return isinstance(one, ObjectParameters) and one.shape == "urdf"

    def _holder(self, joint: EntryParameters) -> tuple[int | None, Matrix]:
        """Return the shape or joint that holds a joint, and its frame from the joint's.

        None is the joint's parent, or the world.
        """
        local, above = joint.local, self._index.get(joint.parent)
        while above is not None:
            one = self._entries[above]
            if above in self._held or (isinstance(one, ObjectParameters) and one.moves):
                return above, local
            if isinstance(one, JointParameters):
                break  # scripts move it: what hangs on it is carried
            local, above = multiply(one.local, local), self._index.get(one.parent)
        return None, joint.local

    def _put(self, joint: int, chains: list[Chain]) -> tuple[Chain, int]:
        """Put a joint and its shape into a chain, unless they are in one; return the chain and their index there."""
        if joint in self._place:
            return self._place[joint]
        shape = self._held[joint]
        holder, local = self._holder(self._entries[joint])
        chain, above, start = self._link_of(holder, chains)
        chain.hung.append(Hung(joint, shape, above, multiply(start, local)))
        self._place[joint] = self._place[shape] = chain, len(chain.hung)
        return self._place[joint]

    def _link_of(self, holder: int | None, chains: list[Chain]) -> tuple[Chain, int, Matrix]:
        """Return chain and index of the link that holds something, and that link's frame from the holder's."""
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
