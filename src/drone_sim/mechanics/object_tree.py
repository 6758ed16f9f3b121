"""The objects of the scene, under their V-REP names: a tree of frames that scripts reach by handle.

Several models may stand in it, each under names with a suffix of its own (object_names.py).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.saved_state import Restore
from drone_sim.mechanics.scene_object import DynamicBody, SceneObject
from drone_sim.message_text import near_names

# V-REP's handles that are no object's: the world, and the parent of the object that is spoken of.
WORLD, PARENT = -1, -11

DEEPEST = 200  # objects above one; what asks for places goes up from each to the next


def levels(one: SceneObject, top: SceneObject | None = None) -> int:
    """Return how many objects an object hangs on, directly or indirectly, up to `top`."""
    count, above = 0, one.parent
    while above is not None and one is not top:
        count += 1
        above = None if above is top else above.parent
    return count


class Handles(NamedTuple):
    """Which handles objects have, by their names, and the first that none has had."""

    by_name: Mapping[str, int] = {}
    next: int = 0

    def with_those_of(self, before: Handles) -> Handles:
        """Return these, with those of objects that are not there any more: they may come again."""
        taken = {*self.by_name.values()}
        gone = {name: handle for name, handle in before.by_name.items() if handle not in taken}
        return Handles({**gone, **self.by_name}, max(self.next, before.next))


NO_HANDLES = Handles()


class ObjectTree:
    """All objects, by handle (a small integer that no other object of the run has had) and by name."""

    def __init__(self, kept: Handles = NO_HANDLES):
        """Start empty; an object whose name is among those that are `kept` gets that handle, also after `clear`."""
        self._begun = kept
        self.cleared = 0  # times
        self.clear()

    def clear(self) -> None:
        """Be empty, and give out handles anew."""
        self.cleared += 1
        self._objects: dict[int, SceneObject] = {}
        self._handles: dict[str, int] = {}
        self._kept, self._next = self._begun  # no handle is given twice
        self._copied: set[str] = set()  # names that some object has, or had, with a suffix
        self._loose: list[SceneObject] = []  # bodies below others, which only a script's moves take along

    def add(
        self,
        name: str,
        parent: str | None = None,
        local: Matrix = IDENTITY,
        body: DynamicBody | None = None,
        *,
        alias: str = "",
        also: Sequence[str] = (),
        kind: str = "",
    ) -> int:
        """Add an object at `local` in the frame of the object named `parent`; return its handle.

        `alias` is what it is called in 4.x paths (its name by default), `also` are further names of it, `kind` is one
        of scene_object.KINDS. Raises ValueError for a name that is taken.
        """
        above = self._objects[self._handles[parent]] if parent else None
        return self.insert(SceneObject((name, *also), alias or name, above, local, body, kind=kind))

    def insert(self, added: SceneObject) -> int:
        """Add an object that has been made; return its handle. Raises ValueError for a name that is taken."""
        for one in added.names:
            if one in self._handles:
                raise ValueError(f"an object named '{one}' already exists")
        handle = self._kept.get(added.name, self._next)
        if handle == self._next or handle in self._objects:
            handle, self._next = self._next, self._next + 1
        is_late = handle < next(reversed(self._objects), handle)
        self._objects[handle] = added
        if is_late:  # it has come again: its place among its siblings is what it was
            self._objects = dict(sorted(self._objects.items()))
        self._handles.update((one, handle) for one in added.names)
        self._copied.update(plain(one) for one in added.names if plain(one) != one)
        if added.is_loose:
            self._loose.append(added)
        return handle

    def reserve(self, handles: Mapping[str, int]) -> None:
        """Let objects that come under these names have these handles again, where nothing else has them."""
        self._kept = {**self._kept, **handles}

    def remove(self, handles: Collection[int]) -> None:
        """Take objects out of the tree; others that hang on them stay where they are, in the world."""
        going = {id(self._objects[handle]) for handle in handles}
        for handle, one in self._objects.items():
            if handle not in handles and id(one.parent) in going:
                one.local, one.parent = one.matrix(), None
        for handle in handles:
            for name in self._objects.pop(handle).names:
                del self._handles[name]
        self.look_for_loose_ones()

    def rename(self, handle: int, name: str) -> None:
        """Give an object another name in the place of all that it has. Raises ValueError for a name that is taken."""
        renamed = self[handle]
        if name in self._handles and self._handles[name] != handle:
            raise ValueError(f"an object named '{name}' already exists")
        for one in renamed.names:
            del self._handles[one]
        renamed.names = (name,)
        self._handles[name] = handle
        if plain(name) != name:
            self._copied.add(plain(name))

    def exchange(self, handle: int, other: SceneObject) -> None:
        """Let another object take the place of one, whose names and parent it has."""
        before, self._objects[handle] = self._objects[handle], other
        for one in self._objects.values():
            if one.parent is before:
                one.parent = other
        self.look_for_loose_ones()

    def handles(self) -> Handles:
        """Return which handle every object has, for another tree of the same objects."""
        return Handles(dict(self._handles), self._next)

    def look_for_loose_ones(self) -> None:
        """Find anew the bodies that follow their parent only when a script moves that."""
        self._loose = [one for one in self._objects.values() if one.is_loose]

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
        """Return the 4.x path of an object from the root, such as /Quadcopter/propeller[0]/respondable."""
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

    def get(self, handle: int) -> SceneObject | None:
        """Return the object of a handle, None where there is none."""
        return self._objects.get(handle)

    def handle_of(self, sought: SceneObject | None) -> int:
        """Return the handle of an object, WORLD for None."""
        return WORLD if sought is None else self._handles[sought.name]

    def __getitem__(self, handle: int) -> SceneObject:
        """Return the object of a handle; raises ValueError, or TypeError where it is no number."""
        try:
            return self._objects[handle]
        except (KeyError, TypeError):
            if isinstance(handle, (int, float)):
                raise ValueError(f"there is no object with the handle {handle}") from None
            raise TypeError("a handle must be a whole number") from None

    def save_state(self) -> Restore:
        """Return a function that puts every object back where it is now, under its present parent.

        An object that was removed since, or whose parent was, is left as it is.
        """
        kept = [(one, one.parent, one.save_state()) for one in self._objects.values()]

        def restore() -> None:
            there = {None, *self._objects.values()}
            for one, parent, put_back in kept:
                if one in there and parent in there:
                    put_back()
            self.look_for_loose_ones()

        return restore

    def matrix(self, handle: int, relative_to: int = WORLD, base: bool = False) -> Matrix:
        """Return the transform of an object relative to another, to its PARENT, or to the WORLD.

        Relative to a joint is relative to what has moved with it; `base`: to the frame that stands still.
        """
        try:
            moved = self._objects[handle]
        except (KeyError, TypeError):
            moved = self[handle]  # which says what is wrong; this runs a dozen times a step
        if relative_to == WORLD:
            return moved.matrix()
        frame = self._frame(moved, relative_to, base)
        return moved.matrix() if frame is None else frames.relative(frame, moved.matrix())

    def _frame(self, moved: SceneObject, relative_to: int, base: bool) -> Matrix | None:
        """Return the transform world from the frame relative to which an object is meant, None for the world's."""
        reference = None if relative_to == WORLD else moved.parent if relative_to == PARENT else self[relative_to]
        if reference is None:
            return None
        return reference.matrix() if base else reference.below()

    def turn(self, handle: int, relative_to: int = WORLD, base: bool = False) -> Matrix:
        """Return what `matrix` does, of which only the rotation counts."""
        if relative_to in (WORLD, PARENT):
            return self.matrix(handle, relative_to, base)
        reference = self[relative_to]
        return frames.relative_turn(reference.matrix() if base else reference.below(), self[handle].matrix())

    def set_matrix(self, handle: int, relative_to: int, matrix: Matrix, base: bool = False) -> None:
        """Put an object at a transform relative to another, to its PARENT, or to the WORLD, with all that is below it.

        `base` is as for `matrix`. Raises ValueError for what cannot be put anywhere.
        """
        moved = self[handle]
        frame = self._frame(moved, relative_to, base)
        matrix = matrix if frame is None else frames.multiply(frame, matrix)
        if not self._loose:
            moved.put(matrix)
            return
        before = moved.matrix()
        below = [(one, frames.relative(before, one.matrix())) for one in self._loose if one.hangs_on(moved)]
        moved.put(matrix)
        for one, local in below:
            one.put(frames.multiply(matrix, local))

    def set_position(self, handle: int, relative_to: int, position: Sequence[float], base: bool = False) -> None:
        """Put an object at a place (m) relative to another, to its PARENT, or to the WORLD, turned as it is.

        Its rotation is not taken into that frame and back: relative to itself, again and again, its errors would grow
        threefold each time.
        """
        moved = self[handle]
        frame = self._frame(moved, relative_to, base)
        x, y, z = position if frame is None else frames.transform(frame, position)
        m0, m1, m2, _, m4, m5, m6, _, m8, m9, m10, _ = moved.matrix()
        self.set_matrix(handle, WORLD, (m0, m1, m2, x, m4, m5, m6, y, m8, m9, m10, z))

    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None:
        """Hang an object on another (WORLD for none): it stays where it is, or keeps its local transform.

        Raises ValueError where it cannot.
        """
        self.check_parent(handle, parent)
        moved = self[handle]
        new = None if parent == WORLD else self[parent]
        matrix = moved.matrix()
        moved.parent = new
        if moved.body is not None:
            self.look_for_loose_ones()
        elif keep_in_place:
            moved.put(matrix)

    def check_parent(self, handle: int, parent: int) -> None:
        """Raise ValueError where a parent would make a loop, or more than DEEPEST objects above one."""
        moved = self[handle]
        new = None if parent == WORLD else self[parent]
        if new is moved or (new is not None and new.hangs_on(moved)):
            raise ValueError(f"'{moved.name}' cannot be its own ancestor")
        below = max(levels(one, moved) for one in self._objects.values() if one is moved or one.hangs_on(moved))
        if new is not None and levels(new) + 1 + below > DEEPEST:
            raise ValueError(f"'{moved.name}' cannot be moved there: it would have more than {DEEPEST} ancestors")
