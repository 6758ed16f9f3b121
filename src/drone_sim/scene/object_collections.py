"""What a scene file may say of collections of objects, which scripts find by their names."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_sim.config.types import Checked, Label, ParameterError, Switch
from drone_sim.context import SimulationContext
from drone_sim.mechanics.object_collections import Item

_LOG = logging.getLogger(__name__)
_MOST, _MOST_ITEMS = 256, 10_000


class ItemParameters(Checked):
    """What belongs to a collection: an object, what hangs on it (tree), what it hangs on (chain), or all there are.

    `removes`: from what the items before it say; `without`: a tree or chain leaves out the object itself.
    """

    what: Literal["single", "tree", "chain", "all"]
    object: Label = ""
    removes: Switch = False
    without: Switch = False

    def model_post_init(self, _context: Any) -> None:
        """Refuse an item without an object that needs one."""
        if not self.object and self.what != "all":
            raise ParameterError(f"a {self.what} needs the name of an object", ("object",), "''")


class CollectionParameters(Checked):
    """A collection."""

    name: Annotated[Label, Field(min_length=1)]
    items: Annotated[list[ItemParameters], Field(max_length=_MOST_ITEMS)]


CollectionList = Annotated[list[CollectionParameters], Field(max_length=_MOST)]


def check(collections: Sequence[CollectionParameters]) -> None:
    """Raise ParameterError where two have one name."""
    names: set[str] = set()
    for index, one in enumerate(collections):
        if one.name in names:
            raise ParameterError("is used twice", ("collections", index, "name"), f"'{one.name}'")
        names.add(one.name)


def begin(collections: Sequence[CollectionParameters], context: SimulationContext) -> None:
    """Let scripts find collections of the objects that are there by now; others are left out, which the log says."""
    for one in collections:
        handle = context.collections.add(one.name)
        for item in one.items:
            try:
                of = -1 if item.what == "all" else context.objects.handle(item.object)
            except ValueError as error:
                _LOG.warning("collection %s: %s", one.name, error)
                continue
            context.collections.extend(handle, Item(item.what, of, item.removes, item.without))
