"""Reads collections: their names and items."""

from __future__ import annotations

from drone_sim.vrep_files.chunks import level
from drone_sim.vrep_files.model import VrepCollection, VrepCollectionItem, VrepFileError

_MAX_ITEMS = 10_000
_KINDS = {  # kind of item, and whether the object itself is left out
    0: ("single", False),
    1: ("tree", False),
    2: ("tree", True),
    3: ("chain", False),
    4: ("chain", True),
    5: ("all", False),
}
_ADDS = 1


def read_collection(data: bytes) -> VrepCollection:
    """Return a collection. Raises VrepFileError."""
    collection = level(data)
    items = [chunk.data for chunk in collection.chunks if chunk.tag == "Asg"]
    if len(items) > _MAX_ITEMS:
        raise VrepFileError(f"Asg: {len(items)} items; at most {_MAX_ITEMS} are allowed")
    return VrepCollection(collection.text("Grn"), tuple(_item(chunk) for chunk in items))


def _item(data: bytes) -> VrepCollectionItem:
    item = level(data)
    number = item.bits("Gty")
    if number not in _KINDS:
        raise VrepFileError(f"Gty: an item of type {number}; only 0 to {max(_KINDS)} are known")
    what, without = _KINDS[number]
    return VrepCollectionItem(
        what, item.integer("Obj", default=-1), not item.bits("Var", default=_ADDS) & _ADDS, without
    )
