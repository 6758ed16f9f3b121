"""Parameters of the object collections of a scene file, which scripts access by name."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_sim.config.types import Checked, Label, ParameterError, Switch
from drone_sim.context import SimulationContext
from drone_sim.mechanics.object_collections import Item

_LOG = logging.getLogger(__name__)
_MAX_COLLECTIONS, _MAX_ITEMS = 256, 10_000


class ItemParameters(Checked):
    """Members of a collection: an object, its descendants (tree), its ancestors (chain), or all objects.

    `removes`: remove them from the members of the preceding items; `without`: tree or chain without the object itself.
    """

    what: Literal["single", "tree", "chain", "all"]
    object: Label = ""
    removes: Switch = False
    without: Switch = False

    def model_post_init(self, _context: Any) -> None:
        """Raise ParameterError for an item without the object that it needs."""
        if not self.object and self.what != "all":
            raise ParameterError(f"a {self.what} needs the name of an object", ("object",), "''")


class CollectionParameters(Checked):
    """A collection."""

    name: Annotated[Label, Field(min_length=1)]
    items: Annotated[list[ItemParameters], Field(max_length=_MAX_ITEMS)]


CollectionList = Annotated[list[CollectionParameters], Field(max_length=_MAX_COLLECTIONS)]


def check(collections: Sequence[CollectionParameters]) -> None:
    """Raise ParameterError if two collections have the same name."""
    names: set[str] = set()
    for index, collection in enumerate(collections):
        if collection.name in names:
            raise ParameterError("is used twice", ("collections", index, "name"), f"'{collection.name}'")
        names.add(collection.name)


def begin(collections: Sequence[CollectionParameters], context: SimulationContext) -> None:
    """Create the collections of the objects that exist; log a warning for each missing object."""
    for collection in collections:
        handle = context.collections.add(collection.name)
        for item in collection.items:
            try:
                of = -1 if item.what == "all" else context.objects.handle(item.object)
            except ValueError as error:
                _LOG.warning("collection %s: %s", collection.name, error)
                continue
            context.collections.extend(handle, Item(item.what, of, item.removes, item.without))
