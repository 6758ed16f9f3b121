"""The tree of the scene's objects, which scripts reach by handle and by V-REP name.

The scene may hold several copies of a model; each has names with another suffix (object_names.py).
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

# V-REP's special handles: the world, and the parent of the object that a function is called for.
WORLD, PARENT = -1, -11

DEEPEST = 200  # ancestors of an object; reading its pose visits all of them


def levels(child: SceneObject, top: SceneObject | None = None) -> int:
    """Return how many ancestors an object has, up to and including `top`."""
    count, ancestor = 0, child.parent
    while ancestor is not None and child is not top:
        count += 1
        ancestor = None if ancestor is top else ancestor.parent
    return count


class Handles(NamedTuple):
    """Handles of objects by name, and the next handle that no object has had."""

    by_name: Mapping[str, int] = {}
    next: int = 0

    def with_those_of(self, before: Handles) -> Handles:
        """Return these handles and those of objects that have been removed: they may be added again."""
        taken = {*self.by_name.values()}
        removed = {name: handle for name, handle in before.by_name.items() if handle not in taken}
        return Handles({**removed, **self.by_name}, max(self.next, before.next))


NO_HANDLES = Handles()


class _ByHandle(dict[int, SceneObject]):
    """Objects by handle."""

    def __missing__(self, handle: object) -> SceneObject:
        if isinstance(handle, (int, float)):
            raise ValueError(f"there is no object with the handle {handle}")
        raise TypeError("a handle must be a whole number")


class ObjectTree:
    """All objects, by name and by handle (a small integer that no other object of the run has had)."""

    def __init__(self, kept: Handles = NO_HANDLES):
        """Start empty. An object whose name is in `kept` gets the handle from there, also after `clear`."""
        self._initial_handles = kept
        self.cleared = 0  # how often
        self.clear()

    def clear(self) -> None:
        """Remove all objects; handles start again as in __init__."""
        self.cleared += 1
        self.by_handle = _ByHandle()
        self._handles: dict[str, int] = {}
        self._reserved, self._next = self._initial_handles  # no handle is given twice
        self._suffixed_names: set[str] = set()  # that some object has, or had, with a suffix
        self._free_children: list[SceneObject] = []  # bodies with a parent, which only scripts move along with it

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

        `alias` is its name in 4.x paths (by default `name`), `also` are further names, `kind` is one of
        scene_object.KINDS. Raises ValueError for a name that is taken.
        """
        parent_object = self.by_handle[self._handles[parent]] if parent else None
        return self.insert(SceneObject((name, *also), alias or name, parent_object, local, body, kind=kind))

    def insert(self, added: SceneObject) -> int:
        """Add a SceneObject; return its handle. Raises ValueError for a name that is taken."""
        for name in added.names:
            if name in self._handles:
                raise ValueError(f"an object named '{name}' already exists")
        handle = self._reserved.get(added.name, self._next)
        if handle == self._next or handle in self.by_handle:
            handle, self._next = self._next, self._next + 1
        is_out_of_order = handle < next(reversed(self.by_handle), handle)
        self.by_handle[handle] = added
        if is_out_of_order:  # it was removed and comes back: restore its position among its siblings
            self.by_handle = _ByHandle(sorted(self.by_handle.items()))
        self._handles.update((name, handle) for name in added.names)
        self._suffixed_names.update(plain(name) for name in added.names if plain(name) != name)
        if added.is_free_child:
            self._free_children.append(added)
        return handle

    def reserve(self, handles: Mapping[str, int]) -> None:
        """Reserve handles, by name, for objects that are added again, unless other objects have them."""
        self._reserved = {**self._reserved, **handles}

    def remove(self, handles: Collection[int]) -> None:
        """Remove objects. Children that remain lose their parent and keep their pose in the world."""
        removed = {id(self.by_handle[handle]) for handle in handles}
        for handle, child in self.by_handle.items():
            if handle not in handles and id(child.parent) in removed:
                child.local, child.parent = child.matrix(), None
        for handle in handles:
            for name in self.by_handle.pop(handle).names:
                del self._handles[name]
        self.refresh_free_children()

    def rename(self, handle: int, name: str) -> None:
        """Replace all names of an object by one. Raises ValueError for a name that is taken."""
        renamed = self[handle]
        if name in self._handles and self._handles[name] != handle:
            raise ValueError(f"an object named '{name}' already exists")
        for old_name in renamed.names:
            del self._handles[old_name]
        renamed.names = (name,)
        self._handles[name] = handle
        if plain(name) != name:
            self._suffixed_names.add(plain(name))

    def replace(self, handle: int, other: SceneObject) -> None:
        """Replace an object by `other`, which has its names and parent; its children get `other` as parent."""
        before, self.by_handle[handle] = self.by_handle[handle], other
        for child in self.by_handle.values():
            if child.parent is before:
                child.parent = other
        self.refresh_free_children()

    def handles(self) -> Handles:
        """Return the handles of all objects, for another tree of the same objects."""
        return Handles(dict(self._handles), self._next)

    def refresh_free_children(self) -> None:
        """Update the list of bodies that follow their parent only when a script moves that."""
        self._free_children = [body for body in self.by_handle.values() if body.is_free_child]

    def is_copied(self, name: str) -> bool:
        """Return whether any object has, or had, that name with a suffix."""
        return name in self._suffixed_names

    def handle(self, name: str) -> int:
        """Return the handle of the object `name`. Raises ValueError, which lists similar names."""
        if name in self._handles:
            return self._handles[name]
        raise ValueError(f"no object named '{name}'; {near_names(name, self._handles)}")

    def named(self, name: str) -> SceneObject:
        """Return the object `name`. Raises ValueError, which lists similar names."""
        try:
            return self.by_handle[self._handles[name]]
        except KeyError:
            return self[self.handle(name)]

    def resolve(self, reference: int | str) -> int:
        """Return the handle of an object, given its handle or its name. Raises ValueError."""
        if isinstance(reference, str):
            return self.handle(reference)
        self[reference]  # raises ValueError for an unknown handle
        return int(reference)

    def tops(self, handles: Sequence[int]) -> list[int]:
        """Return the handles of the objects that are not descendants of any other."""
        return [handle for handle in handles if not any(self[handle].is_descendant_of(self[it]) for it in handles)]

    @property
    def names(self) -> Iterable[str]:
        return self._handles.keys()

    def children(self, parent: SceneObject | None) -> Iterator[tuple[int, SceneObject]]:
        """Return handle and object of each child of `parent` (None: objects without a parent), by handle."""
        return ((handle, child) for handle, child in self.by_handle.items() if child.parent is parent)

    def path(self, handle: int) -> str:
        """Return the object's 4.x path from the root, such as /Quadcopter/propeller[0]/respondable."""
        parts = []
        node: SceneObject | None = self[handle]
        while node is not None:
            namesakes = [child for _, child in self.children(node.parent) if child.alias == node.alias]
            parts.append(f"{node.alias}[{namesakes.index(node)}]" if len(namesakes) > 1 else node.alias)
            node = node.parent
        return "/" + "/".join(reversed(parts))

    def __iter__(self) -> Iterator[int]:
        """Iterate over the handles."""
        return iter(self.by_handle)

    def __contains__(self, name: object) -> bool:
        return name in self._handles

    def handle_of(self, item: SceneObject | None) -> int:
        """Return the handle of an object, WORLD for None."""
        return WORLD if item is None else self._handles[item.name]

    def __getitem__(self, handle: int) -> SceneObject:
        """Return the object with a handle. Raises ValueError, or TypeError if it is not a number."""
        return self.by_handle[handle]

    def save_state(self) -> Restore:
        """Return a function that puts every object back where it is now, below its present parent.

        An object that was removed since, or whose parent was, is left unchanged.
        """
        states = [(item, item.parent, item.save_state()) for item in self.by_handle.values()]

        def restore() -> None:
            existing = {None, *self.by_handle.values()}
            for item, parent, restore_item in states:
                if item in existing and parent in existing:
                    restore_item()
            self.refresh_free_children()

        return restore

    def matrix(self, handle: int, relative_to: int = WORLD, base: bool = False) -> Matrix:
        """Return the transform of an object relative to another, to its PARENT, or to the WORLD.

        Relative to a joint means to its moving side, the frame of its children; with `base` to its fixed side.
        """
        moved = self.by_handle[handle]
        frame = None if relative_to == WORLD else self._frame(moved, relative_to, base)
        return moved.matrix() if frame is None else frames.relative(frame, moved.matrix())

    def _frame(self, moved: SceneObject, relative_to: int, base: bool) -> Matrix | None:
        """Return the transform world from the frame of reference, None for a parent that is the world."""
        reference = moved.parent if relative_to == PARENT else self.by_handle[relative_to]
        if reference is None:
            return None
        return reference.matrix() if base else reference.below()

    def turn(self, handle: int, relative_to: int = WORLD, base: bool = False) -> Matrix:
        """Return `matrix` with a correct rotation only; the translation may be 0, which saves time."""
        moved = self.by_handle[handle]
        frame = None if relative_to == WORLD else self._frame(moved, relative_to, base)
        return moved.matrix() if frame is None else frames.relative_turn(frame, moved.matrix())

    def set_matrix(self, handle: int, relative_to: int, matrix: Matrix, base: bool = False) -> None:
        """Place an object, with its descendants, relative to another, to its PARENT, or to the WORLD.

        `base` is as for `matrix`. Raises ValueError for an object that cannot be placed.
        """
        moved = self.by_handle[handle]
        frame = None if relative_to == WORLD else self._frame(moved, relative_to, base)
        self._place(moved, matrix if frame is None else frames.multiply(frame, matrix))

    def _place(self, moved: SceneObject, matrix: Matrix) -> None:
        """Place an object, with its descendants, in the world."""
        if not self._free_children:
            moved.put(matrix)
            return
        before = moved.matrix()
        below = [
            (body, frames.relative(before, body.matrix()))
            for body in self._free_children
            if body.is_descendant_of(moved)
        ]
        moved.put(matrix)
        for body, local in below:
            body.put(frames.multiply(matrix, local))

    def set_position(self, handle: int, relative_to: int, position: Sequence[float], base: bool = False) -> None:
        """Place an object at a position (m) relative to another, to its PARENT, or to the WORLD, without rotating it.

        Its rotation is not converted to that frame and back: each time that an object is moved relative to itself, its
        rounding errors would grow threefold.
        """
        moved = self.by_handle[handle]
        frame = None if relative_to == WORLD else self._frame(moved, relative_to, base)
        x, y, z = position if frame is None else frames.transform(frame, position)
        m0, m1, m2, _, m4, m5, m6, _, m8, m9, m10, _ = moved.matrix()
        self._place(moved, (m0, m1, m2, x, m4, m5, m6, y, m8, m9, m10, z))

    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None:
        """Give an object a new parent (WORLD: none); it keeps its pose in the world, or its local transform.

        A body always stays in place. Raises what `check_parent` raises.
        """
        self.check_parent(handle, parent)
        moved = self[handle]
        new = None if parent == WORLD else self[parent]
        matrix = moved.matrix()
        moved.parent = new
        if moved.body is not None:
            self.refresh_free_children()
        elif keep_in_place:
            moved.put(matrix)

    def check_parent(self, handle: int, parent: int) -> None:
        """Raise ValueError if a new parent would make a loop, or give an object more than DEEPEST ancestors."""
        moved = self[handle]
        new = None if parent == WORLD else self[parent]
        if new is moved or (new is not None and new.is_descendant_of(moved)):
            raise ValueError(f"'{moved.name}' cannot be its own ancestor")
        depth = max(
            levels(item, moved) for item in self.by_handle.values() if item is moved or item.is_descendant_of(moved)
        )
        if new is not None and levels(new) + 1 + depth > DEEPEST:
            raise ValueError(f"'{moved.name}' cannot be attached there: more than {DEEPEST} ancestors of an object")
