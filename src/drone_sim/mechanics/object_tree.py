"""The objects of the scene, under their V-REP names: a tree of frames that scripts reach by handle.

Several models may stand in it, each under names with a suffix of its own (object_names.py).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Protocol

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.state import Pose, State
from drone_sim.wording import near_names

# V-REP's handles that are no object's: the world, and the parent of the object that is spoken of.
WORLD, PARENT = -1, -11


class Body(Protocol):
    """What the tree asks of something that the dynamics moves."""

    @property
    def state(self) -> State:
        """Pose and velocity of its frame."""

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""

    def move(self, pose: Pose) -> None:
        """Put it there, at rest."""


class SceneObject:
    """One frame: carried by its parent, or by a body."""

    def __init__(
        self,
        names: tuple[str, ...],
        alias: str,
        parent: SceneObject | None,
        local: Matrix = IDENTITY,
        body: Body | None = None,
    ):
        """Stand at `local` in the parent's frame (the world's if None), or wherever `body` is.

        Take the names that no other object has (V-REP 3.x), and the alias that siblings may share (4.x paths).
        """
        self.names = names
        self.alias = alias
        self.parent = parent
        self._added_below = parent
        self.local = local
        self.body = body
        self._above: Matrix | None = None
        self._below: Matrix | None = None
        self._product = IDENTITY

    @property
    def name(self) -> str:
        """The first of its names."""
        return self.names[0]

    def is_called(self, name: str) -> bool:
        """Tell whether that is its alias or one of its names, with or without their suffix."""
        return name == self.alias or any(name in (one, plain(one)) for one in self.names)

    def is_part_of(self, whole: SceneObject) -> bool:
        """Tell whether it is that object or was added below it, whatever it hangs on now."""
        part: SceneObject | None = self
        while part is not None and part is not whole:
            part = part._added_below
        return part is whole

    def matrix(self) -> Matrix:
        """Return the transform world from this frame."""
        if self.body is not None:
            return self.body.matrix
        if self.parent is None:
            return self.local
        # Scripts ask for the same few frames several times a step: the same two tuples, the same product.
        above, local = self.parent.matrix(), self.local
        if above is not self._above or local is not self._below:
            self._above, self._below, self._product = above, local, frames.multiply(above, local)
        return self._product

    def put(self, matrix: Matrix) -> None:
        """Put it at a transform in the world; what carries it goes there, at rest."""
        if self.body is not None:
            self.body.move(Pose(frames.position(matrix), frames.to_quaternion(matrix)))
        elif self.parent is None:
            self.local = matrix
        else:
            self.local = frames.multiply(frames.invert(self.parent.matrix()), matrix)

    def velocity(self) -> tuple[Vector, Vector]:
        """Return linear (m/s) and angular (rad/s) velocity in the world; zero where no body carries it."""
        carrier = self
        while carrier.body is None:
            if carrier.parent is None:
                return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            carrier = carrier.parent
        (x, y, z), _, linear, angular = carrier.body.state
        m, (wx, wy, wz) = self.matrix(), angular
        x, y, z = m[3] - x, m[7] - y, m[11] - z  # from the body's frame to this one
        return (linear[0] + wy * z - wz * y, linear[1] + wz * x - wx * z, linear[2] + wx * y - wy * x), angular


class ObjectTree:
    """All objects, by handle (a small integer that no other object of the run has had) and by name."""

    def __init__(self) -> None:
        """Start empty."""
        self._objects: dict[int, SceneObject] = {}
        self._handles: dict[str, int] = {}
        self._numbers = itertools.count()  # none is given twice
        self._copied: set[str] = set()  # names that some object has, or had, with a suffix

    def add(
        self,
        name: str,
        parent: str | None = None,
        local: Matrix = IDENTITY,
        body: Body | None = None,
        *,
        alias: str = "",
        also: Sequence[str] = (),
    ) -> int:
        """Add an object at `local` in the frame of the object named `parent`; return its handle.

        `alias` is what it is called in 4.x paths (its name by default), `also` are further names of it. Raises
        ValueError for a name that is taken.
        """
        names = (name, *also)
        for one in names:
            if one in self._handles:
                raise ValueError(f"an object named '{one}' is there already")
        handle = next(self._numbers)
        above = self._objects[self._handles[parent]] if parent else None
        self._objects[handle] = SceneObject(names, alias or name, above, local, body)
        self._handles.update((one, handle) for one in names)
        self._copied.update(plain(one) for one in names if plain(one) != one)
        return handle

    def remove(self, handles: Collection[int]) -> None:
        """Take objects out of the tree; others that hang on them stay where they are, in the world."""
        going = {id(self._objects[handle]) for handle in handles}
        for handle, one in self._objects.items():
            if handle not in handles and id(one.parent) in going:
                one.local, one.parent = one.matrix(), None
        for handle in handles:
            for name in self._objects.pop(handle).names:
                del self._handles[name]

    def is_copied(self, name: str) -> bool:
        """Tell whether any object has, or had, that name with a suffix."""
        return name in self._copied

    def handle(self, name: str) -> int:
        """Return the handle of a name; raises ValueError that lists the near names."""
        if name in self._handles:
            return self._handles[name]
        raise ValueError(f"no object named '{name}'; {near_names(name, self._handles)}")

    @property
    def names(self) -> Iterable[str]:
        """Every name that an object has."""
        return self._handles.keys()

    def children(self, parent: SceneObject | None) -> Iterator[tuple[int, SceneObject]]:
        """Yield handle and object of what hangs on an object (on nothing, for None), in the order of handles."""
        return ((handle, child) for handle, child in self._objects.items() if child.parent is parent)

    def path(self, handle: int) -> str:
        """Return the 4.x path of an object from the root, such as /Quadcopter/propeller[0]/joint."""
        parts = []
        here: SceneObject | None = self[handle]
        while here is not None:
            twins = [child for _, child in self.children(here.parent) if child.alias == here.alias]
            parts.append(f"{here.alias}[{twins.index(here)}]" if len(twins) > 1 else here.alias)
            here = here.parent
        return "/" + "/".join(reversed(parts))

    def __iter__(self) -> Iterator[int]:
        """Yield every handle."""
        return iter(self._objects)

    def __contains__(self, name: str) -> bool:
        """Tell whether an object has that name."""
        return name in self._handles

    def handle_of(self, sought: SceneObject | None) -> int:
        """Return the handle of an object, WORLD for None."""
        return WORLD if sought is None else self._handles[sought.name]

    def __getitem__(self, handle: int) -> SceneObject:
        """Return the object of a handle; raises ValueError, or TypeError where it is no number."""
        try:
            return self._objects[handle]
        except (KeyError, TypeError):
            if isinstance(handle, (int, float)):
                raise ValueError(f"no object has the handle {handle}") from None
            raise TypeError("a handle is a whole number") from None

    def remember(self) -> Callable[[], None]:
        """Return a function that puts every object back where it is now, under its present parent.

        An object that was removed since, or whose parent was, is left as it is.
        """
        kept = [(one, one.parent, one.local) for one in self._objects.values()]

        def recall() -> None:
            there = {None, *self._objects.values()}
            for one, parent, local in kept:
                if one in there and parent in there:
                    one.parent, one.local = parent, local

        return recall

    def matrix(self, handle: int, relative_to: int = WORLD) -> Matrix:
        """Return the transform of an object relative to another, to its PARENT, or to the WORLD."""
        try:
            moved = self._objects[handle]
        except (KeyError, TypeError):
            moved = self[handle]  # which says what is wrong; this runs a dozen times a step
        if relative_to == WORLD:
            return moved.matrix()
        reference = moved.parent if relative_to == PARENT else self[relative_to]
        return moved.matrix() if reference is None else frames.relative(reference.matrix(), moved.matrix())

    def turn(self, handle: int, relative_to: int = WORLD) -> Matrix:
        """Return what `matrix` does, of which only the rotation counts."""
        if relative_to in (WORLD, PARENT):
            return self.matrix(handle, relative_to)
        return frames.relative_turn(self[relative_to].matrix(), self[handle].matrix())

    def set_matrix(self, handle: int, relative_to: int, matrix: Matrix) -> None:
        """Put an object at a transform relative to another, to its PARENT, or to the WORLD."""
        moved = self[handle]
        if relative_to != WORLD:
            reference = moved.parent if relative_to == PARENT else self[relative_to]
            matrix = matrix if reference is None else frames.multiply(reference.matrix(), matrix)
        moved.put(matrix)

    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None:
        """Hang an object on another (WORLD for none): it stays where it is, or keeps its local transform.

        Raises ValueError where that would make a loop.
        """
        moved = self[handle]
        new = None if parent == WORLD else self[parent]
        ancestor = new
        while ancestor is not None:
            if ancestor is moved:
                raise ValueError(f"'{moved.name}' cannot be its own ancestor")
            ancestor = ancestor.parent
        matrix = moved.matrix()
        moved.parent = new
        if keep_in_place and moved.body is None:
            moved.put(matrix)
