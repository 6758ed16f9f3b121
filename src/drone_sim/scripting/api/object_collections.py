"""`sim`: collections of objects, which can be used instead of a single object for distances, collisions and sensors."""

from __future__ import annotations

from drone_sim.mechanics.object_collections import ITEMS, Collections, Item
from drone_sim.mechanics.object_names import suffixed
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.names import NameFunctions
from drone_sim.scripting.api.types import Handle, Name, WrongValue

_ALL = CONSTANTS["handle_all"]
_ITEMS = {CONSTANTS[f"handle_{word}"]: word for word in ITEMS}
_REMOVES, _WITHOUT_OBJECT = 1, 2  # option bits of an item


class CollectionFunctions:
    """Collections of objects, which can be used instead of a single object for distances, collisions and sensors."""

    def __init__(self, names: NameFunctions, objects: ObjectTree, collections: Collections):
        """`names` has the suffix for names; `collections` consist of `objects`."""
        self._names = names
        self._objects = objects
        self._collections = collections

    @sim("345", createCollectionEx="45")
    def createCollection(self, name: Name | int = "", _options: int = 0) -> int:
        """Create an empty collection: (options), or up to 4.1 (name, options); return its handle.

        Option 1, which overrides properties of the objects, has no effect: here, all objects always count.
        """
        return self._collections.add(name if isinstance(name, str) else "")

    @sim("45")
    def addItemToCollection(self, collection: Handle, what: int, object: Handle = -1, options: int = 0) -> None:
        """Add an object (sim.handle_single), with its descendants (_tree), with its ancestors (_chain), or all (_all).

        `options`: 1 removes them instead, 2 excludes the object itself. Trees and chains are evaluated when the
        collection is used.
        """
        word = _ITEMS.get(what)
        if word is None:
            raise WrongValue("expected sim.handle_single, _tree, _chain or _all")
        if word != "all":
            self._objects[object]
        removes, without = bool(int(options) & _REMOVES), bool(int(options) & _WITHOUT_OBJECT)
        item = Item("all", -1) if word == "all" else Item(word, int(object), removes, without)
        self._collections.extend(collection, item)

    @sim("34")
    def addObjectToCollection(self, collection: Handle, object: Handle, what: int, options: int = 0) -> int:
        """Like addItemToCollection; return 1 (3.x)."""
        self.addItemToCollection(collection, what, object, options)
        return 1

    @sim("345")
    def getCollectionHandle(self, name: Name) -> int:
        """Return the handle of a collection by its name (3.x); with name@silentError, -1 if there is none."""
        if not isinstance(name, str):
            raise WrongValue("expected the name of a collection")
        name, _, flag = name.partition("@")
        own = suffixed(name, self._names.suffix)
        try:
            return self._collections.handle(own if own in self._collections.names else name.removesuffix("#"))
        except ValueError:
            if flag == "silentError":
                return -1
            raise

    @sim("345")
    def getCollectionName(self, collection: Handle) -> str:
        """Return the name of a collection, '' for none (3.x)."""
        return self._collections.name(collection)

    @sim("345")
    def getCollectionObjects(self, collection: Handle) -> list[int]:
        """Return the handles of the objects that are in a collection now."""
        return self._collections.objects(collection, self._objects)

    @sim("345")
    def emptyCollection(self, collection: Handle) -> None:
        """Remove all objects from a collection; with sim.handle_all, from all collections."""
        for handle in self._selected(collection):
            self._collections.empty(handle)

    @sim("5", removeCollection="345")
    def destroyCollection(self, collection: Handle) -> None:
        """Remove a collection, or all with sim.handle_all; the objects stay."""
        for handle in self._selected(collection):
            self._collections.remove(handle)

    def _selected(self, collection: int) -> list[int]:
        return [*self._collections] if collection == _ALL else [collection]
