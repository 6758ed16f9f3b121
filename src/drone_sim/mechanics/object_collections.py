"""V-REP's collections: sets of objects given by rules, whose members are determined at each use."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.message_text import near_names

FIRST = 700_000  # the first handle; handles of objects and scripts are smaller
ITEMS = ("single", "tree", "chain", "all")
_MAX_COLLECTIONS, _MAX_ITEMS = 1000, 100_000


class Item(NamedTuple):
    """A rule of a collection: an object (`single`), its descendants (`tree`) or ancestors (`chain`), or `all`."""

    what: str  # one of ITEMS
    handle: int  # of the object; -1 for `all`
    removes: bool = False  # whether the item takes objects away from those of the items before it
    without: bool = False  # whether a `tree` or `chain` leaves out the object itself


class Collections:
    """The collections of a run, by name and by handle. Objects and scripts have other handles."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Remove all collections; the next handle is the first one again."""
        self._items: dict[int, tuple[Item, ...]] = {}
        self._names: dict[str, int] = {}
        self._next = FIRST

    def save_state(self) -> Restore:
        return saved(self, "_items", "_names", "_next")

    def add(self, name: str = "") -> int:
        """Add an empty collection; return its handle. Raises ValueError if the name is taken, or there are too many."""
        if name in self._names:
            raise ValueError(f"a collection named '{name}' already exists")
        if len(self._items) >= _MAX_COLLECTIONS:
            raise ValueError(f"{_MAX_COLLECTIONS} collections exist already, the maximum: remove some")
        handle, self._next = self._next, self._next + 1
        self._items[handle] = ()
        if name:
            self._names[name] = handle
        return handle

    def __contains__(self, handle: object) -> bool:
        return handle in self._items

    def __iter__(self) -> Iterator[int]:
        """Iterate over the handles."""
        return iter(self._items)

    @property
    def names(self) -> Iterable[str]:
        """The names; a collection may have none."""
        return self._names.keys()

    def handle(self, name: str) -> int:
        """Return the handle of the collection `name`. Raises ValueError, which lists similar names."""
        if name not in self._names:
            raise ValueError(f"no collection named '{name}'; {near_names(name, self._names)}")
        return self._names[name]

    def name(self, handle: int) -> str:
        """Return the name of a collection, '' if it has none. Raises ValueError for an unknown handle."""
        self._items_of(handle)
        return next((name for name, number in self._names.items() if number == handle), "")

    def extend(self, handle: int, item: Item) -> None:
        """Add an item to a collection. Raises ValueError for an unknown handle, and for too many items."""
        if len(self._items_of(handle)) >= _MAX_ITEMS:
            raise ValueError(f"a collection has at most {_MAX_ITEMS} items")
        self._items[handle] += (item,)

    def empty(self, handle: int) -> None:
        """Remove all items from a collection. Raises ValueError for an unknown handle."""
        self._items_of(handle)
        self._items[handle] = ()

    def remove(self, handle: int) -> None:
        """Remove a collection. Raises ValueError for an unknown handle."""
        name = self.name(handle)
        del self._items[handle]
        self._names.pop(name, None)

    def objects(self, handle: int, tree: ObjectTree) -> list[int]:
        """Return the handles of the objects in a collection at present. Raises ValueError for an unknown handle."""
        existing = {*tree}
        result: dict[int, None] = {}
        for item in self._items_of(handle):
            if item.what != "all" and item.handle not in existing:
                continue
            selected = _selected_objects(item, tree)
            result = {old: None for old in result if old not in selected} if item.removes else {**result, **selected}
        return [member for member in result if member in existing]

    def _items_of(self, handle: int) -> tuple[Item, ...]:
        if handle not in self._items:
            raise ValueError(f"there is no collection with the handle {handle}")
        return self._items[handle]


def _selected_objects(item: Item, tree: ObjectTree) -> dict[int, None]:
    """Return the handles of the objects that an item selects, as an ordered set."""
    if item.what == "all":
        return dict.fromkeys(tree)
    origin = tree[item.handle]
    selected = {} if item.without else {item.handle: None}
    if item.what == "tree":
        selected |= {handle: None for handle in tree if tree[handle].is_descendant_of(origin)}
    elif item.what == "chain":
        selected |= {handle: None for handle in tree if origin.is_descendant_of(tree[handle])}
    return selected if item.what != "single" else {item.handle: None}


def members(entity: int, objects: ObjectTree, collections: Collections) -> list[int]:
    """Return the handles of an object, or of a collection's objects. Raises ValueError, TypeError for neither."""
    if entity in collections:
        return collections.objects(entity, objects)
    objects[entity]
    return [int(entity)]
