"""Collections: their names, and what belongs to them."""

from __future__ import annotations

from drone_sim.vrep_files.chunks import level
from drone_sim.vrep_files.model import VrepCollection, VrepCollectionItem, VrepFileError

_MOST_ITEMS = 10_000
_WHAT = {  # what is meant, and whether without the object itself
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
    own = level(data)
    items = [one.data for one in own.chunks if one.tag == "Asg"]
    if len(items) > _MOST_ITEMS:
        raise VrepFileError(f"Asg: {len(items)} items; at most {_MOST_ITEMS} are read")
    return VrepCollection(own.text("Grn"), tuple(_item(one) for one in items))


def _item(data: bytes) -> VrepCollectionItem:
    own = level(data)
    number = own.bits("Gty")
    if number not in _WHAT:
        raise VrepFileError(f"Gty: an item of type {number}; at most {max(_WHAT)} is known")
    what, without = _WHAT[number]
    return VrepCollectionItem(what, own.integer("Obj", default=-1), not own.bits("Var", default=_ADDS) & _ADDS, without)
