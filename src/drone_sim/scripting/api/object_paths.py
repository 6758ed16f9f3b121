"""Objects by V-REP 3.x name or by CoppeliaSim 4.x path.

    Quadricopter_base  Quadricopter_base#  Quadricopter_base#0     3.x; the suffix tells copies of a model apart
    /Quadcopter/base   /Quadcopter[1]/base   /target               4.x, from the root of the scene
    .  ./base  :/base  ..  ../propeller[0]/respondable             4.x, from the model that the script belongs to

In newer 4.x models the script is an object of its own below the model (`..` is the model), in older
ones it belongs to the model itself (`.` is): both mean the drone here. An element of a path names any
descendant, the nearest first; [i] takes the i-th of several.

A name without a suffix means the object of the script's own model, as in V-REP: in the script of Drone#0,
Quadricopter_base is Quadricopter_base#0. Where there is none, it is an object of the scene, such as Floor, but not one
of the model that Drone#0 is a copy of. `name#` is always the one without a suffix.
"""

from __future__ import annotations

import re

from drone_sim.mechanics.object_names import plain, split, suffixed
from drone_sim.mechanics.object_tree import ObjectTree, SceneObject
from drone_sim.wording import near_names

_SUFFIXED = re.compile(r"(.+)#(\d*)", re.DOTALL)
_ELEMENT = re.compile(r"^([^\[\]]+)(?:\[(\d+)\])?$")
_OWN = (".", "..", ":")


def find(objects: ObjectTree, path: str, own: str, suffix: int) -> int:
    """Return the handle that a name or path means in a script of the object `own`, whose names have that suffix.

    Raises ValueError with the near names.
    """
    if not isinstance(path, str):
        raise TypeError("a name is a string")
    first, slash, rest = path.partition("/")
    if not slash and first not in _OWN:
        return objects.handle(_full_name(objects, path, own, suffix))
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


def _full_name(objects: ObjectTree, name: str, own: str, suffix: int) -> str:
    """Return what a name in a script stands for, whether there is such an object or not."""
    match = _SUFFIXED.fullmatch(name)
    if match is None:
        full = suffixed(name, suffix)
        if full in objects:
            return full
        is_its_own = suffix == split(own)[1]  # and not one that setNameSuffix has set
        by_its_names = (suffixed(name, split(one)[1]) for one in _names(objects, own) if is_its_own)
        found = next((one for one in by_its_names if one in objects and one != name), None)
        return found or (full if not _is_of_the_scene(objects, name, own) else name)
    # A script that is copied out of a scene with several models names its own with a suffix.
    is_meant = name in objects or (match.group(2) and objects.is_copied(match.group(1)))
    return name if is_meant else match.group(1)


def _names(objects: ObjectTree, own: str) -> tuple[str, ...]:
    """Return the names of a script's object: in an imported scene its copy may have another suffix than the vehicle."""
    return objects[objects.handle(own)].names if own in objects else ()


def _is_of_the_scene(objects: ObjectTree, name: str, own: str) -> bool:
    """Tell whether a name is not one of the model that `own` has copies of, or is a copy of."""
    original = plain(own)
    if name not in objects or original not in objects or not objects.is_copied(original):
        return True
    return not objects[objects.handle(name)].is_part_of(objects[objects.handle(original)])


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
