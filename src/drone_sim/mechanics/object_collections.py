"""Collections of objects: V-REP's way to mean several at once, by what belongs to them at the moment."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.message_text import near_names

FIRST = 700_000  # the first handle: no object, and no script, has one that large
ITEMS = ("single", "tree", "chain", "all")
_MOST, _MOST_ITEMS = 1000, 100_000


class Item(NamedTuple):
    """What a collection is made of: an object (`single`), what hangs on it, what it hangs on, or all there are."""

    what: str  # one of ITEMS
    handle: int  # of the object; that of all is -1
    removes: bool = False  # from what was collected before it
    without: bool = False  # of a tree or chain: whether it leaves out the object itself


class Collections:
    """The collections of a run, by handle (a number that nothing else has) and name."""

    def __init__(self) -> None:
        """Start with none."""
        self.clear()

    def clear(self) -> None:
        """Forget all; handles are given out anew."""
        self._items: dict[int, tuple[Item, ...]] = {}
        self._names: dict[str, int] = {}
        self._next = FIRST

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings the present collections back."""
        kept = dict(self._items), dict(self._names), self._next

        def restore() -> None:
            items, names, self._next = kept
            self._items, self._names = dict(items), dict(names)

        return restore

    def add(self, name: str = "") -> int:
        """Make an empty one; return its handle. Raises ValueError for a name that is taken, and for too many."""
        if name in self._names:
            raise ValueError(f"a collection named '{name}' already exists")
        if len(self._items) >= _MOST:
            raise ValueError(f"at most {_MOST} collections are allowed: remove some")
        handle, self._next = self._next, self._next + 1
        self._items[handle] = ()
        if name:
            self._names[name] = handle
        return handle

    def __contains__(self, handle: object) -> bool:
        """Tell whether a collection has that handle."""
        return handle in self._items

    def __iter__(self) -> Iterator[int]:
        """Yield every handle."""
        return iter(self._items)

    @property
    def names(self) -> Iterable[str]:
        """The names that some of them have."""
        return self._names.keys()

    def handle(self, name: str) -> int:
        """Return the handle of a name; raises ValueError that lists the near names."""
        if name not in self._names:
            raise ValueError(f"no collection named '{name}'; {near_names(name, self._names)}")
        return self._names[name]

    def name(self, handle: int) -> str:
        """Return the name of a collection, '' for none. Raises ValueError for a handle of none."""
        self._known(handle)
        return next((name for name, one in self._names.items() if one == handle), "")

    def extend(self, handle: int, item: Item) -> None:
        """Add an item to a collection. Raises ValueError for a handle of none, and for too many items."""
        if len(self._known(handle)) >= _MOST_ITEMS:
            raise ValueError(f"a collection has at most {_MOST_ITEMS} items")
        self._items[handle] += (item,)

    def empty(self, handle: int) -> None:
        """Take all items out of a collection. Raises ValueError for a handle of none."""
        self._known(handle)
        self._items[handle] = ()

    def remove(self, handle: int) -> None:
        """Forget a collection. Raises ValueError for a handle of none."""
        name = self.name(handle)
        del self._items[handle]
        self._names.pop(name, None)

    def objects(self, handle: int, tree: ObjectTree) -> list[int]:
        """Return the handles of the objects that are in a collection now. Raises ValueError for a handle of none."""
        there = {*tree}
        found: dict[int, None] = {}
        for item in self._known(handle):
            if item.what != "all" and item.handle not in there:
                continue
            named = _named(item, tree)
            found = {one: None for one in found if one not in named} if item.removes else {**found, **named}
        return [one for one in found if one in there]

    def _known(self, handle: int) -> tuple[Item, ...]:
        if handle not in self._items:
            raise ValueError(f"there is no collection with the handle {handle}")
        return self._items[handle]


def _named(item: Item, tree: ObjectTree) -> dict[int, None]:
    """Return the handles of the objects that an item names."""
    if item.what == "all":
        return dict.fromkeys(tree)
    one = tree[item.handle]
    found = {} if item.without else {item.handle: None}
    if item.what == "tree":
        found |= {handle: None for handle in tree if tree[handle].hangs_on(one)}
    elif item.what == "chain":
        found |= {handle: None for handle in tree if one.hangs_on(tree[handle])}
    return found if item.what != "single" else {item.handle: None}


def members(entity: int, objects: ObjectTree, collections: Collections) -> list[int]:
    """Return the objects of an entity, which is an object or a collection. Raises ValueError, TypeError."""
    if entity in collections:
        return collections.objects(entity, objects)
    objects[entity]
    return [int(entity)]
