"""Objects by V-REP 3.x name or by CoppeliaSim 4.x path.

    Quadricopter_base  Quadricopter_base#  Quadricopter_base#0     3.x; the suffix numbers copies of a model
    /Quadcopter/base   /target                                     4.x, from the root of the scene
    .  ./base  :/base  ..  ../propeller[0]/respondable             4.x, from the model that the script belongs to

In newer 4.x models the script is an object of its own below the model (`..` is the model), in older
ones it belongs to the model itself (`.` is): both mean the drone here. An element of a path names any
descendant, the nearest first; [i] takes the i-th of several.
"""

from __future__ import annotations

import re

from drone_sim.mechanics.object_tree import ObjectTree, SceneObject
from drone_sim.wording import near_names

_SUFFIX = re.compile(r"#\d*$")
_ELEMENT = re.compile(r"^([^\[\]]+)(?:\[(\d+)\])?$")
_OWN = (".", "..", ":")


def find(objects: ObjectTree, path: str, own: str) -> int:
    """Return the handle that a name or path means in a script of the object `own`.

    Raises ValueError with the near names.
    """
    if not isinstance(path, str):
        raise TypeError("a name is a string")
    first, slash, rest = path.partition("/")
    if not slash and first not in _OWN:
        return objects.handle(_SUFFIX.sub("", path))
    here: SceneObject | None = None
    if first in _OWN:
        here = objects[objects.handle(own)]
    elif first:
        rest = path
    for element in filter(None, rest.split("/")):
        here = _step(objects, here, element)
        if here is None:
            known = [*objects.names, *(objects.path(handle) for handle in objects)]
            raise ValueError(f"no object '{path}'; {near_names(path, known)}")
    if here is None:
        raise ValueError(f"no object '{path}': it names none")
    return objects.handle_of(here)


def _step(objects: ObjectTree, here: SceneObject | None, element: str) -> SceneObject | None:
    if element == ".":
        return here
    if element == "..":
        return here.parent if here is not None else None
    match = _ELEMENT.match(element)
    if match is None:
        return None
    name, index = match.group(1), int(match.group(2) or 0)
    found = [candidate for candidate in _descendants(objects, here) if candidate.is_called(name)]
    return found[index] if index < len(found) else None


def _descendants(objects: ObjectTree, root: SceneObject | None) -> list[SceneObject]:
    """Return everything below an object, the nearest first."""
    level: list[SceneObject | None] = [root]
    everything: list[SceneObject] = []
    while level:
        below = [child for parent in level for _, child in objects.children(parent)]
        everything += below
        level = [*below]
    return everything
