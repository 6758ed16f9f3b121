"""Paths of CoppeliaSim 4.x, which identify objects in the tree.

    /Quadcopter/base  /base                    from the root of the scene
    .  ./base  ..  ../propeller[0]             from the object that the script is on, or from its parent
    :  :/base  ::                              from the model that contains it, or from the parent model
    /Quadcopter/propeller[1]  /Quad*/prop*     the second sibling with this name; any letters (*), one letter (?)

An element means any descendant with this name, nearest first. The next element is searched below each of these, until
an object is found.
"""

from __future__ import annotations

import itertools
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from fnmatch import fnmatchcase

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.scene_object import SceneObject

_ELEMENT = re.compile(r"([^\[\]]+)(?:\[(\d{1,9})\])?")
_MOST = 100  # elements of a path

_Fits = Callable[[SceneObject, str], bool]


def is_path(name: str) -> bool:
    return "/" in name or name in (".", "..", ":", "::")


def find(
    objects: ObjectTree, path: str, own: SceneObject | None, above: SceneObject | None, index: int = 0
) -> SceneObject | None:
    """Return the object that a path means, the index-th of several; None if there is none.

    `own` is the object where relative paths begin (None: none), `above` the object that `..` means.
    """
    found = every(objects, path, own, above, index + 1) if index >= 0 else []
    return found[index] if len(found) > index else None


def every(
    objects: ObjectTree,
    path: str,
    own: SceneObject | None = None,
    above: SceneObject | None = None,
    most: int | None = None,
) -> list[SceneObject]:
    """Return the objects that a path means, at most `most`; other arguments are those of `find`."""
    first, *rest = path.split("/")
    model = None if own is None else own.model()
    model_above = None if model is None or model.parent is None else model.parent.model()
    begins = {".": own, "..": above, ":": model, "::": model_above}
    elements = [element for element in (rest if first in begins else [first, *rest]) if element not in ("", ".")]
    if len(elements) > _MOST:
        return []
    for fits in (_has_alias, SceneObject.is_called):  # 3.x names only if no object has the alias
        found = [*itertools.islice(_Search(objects, fits).below(begins.get(first), elements), most)]
        if found:
            return found
    return []


def _has_alias(item: SceneObject, name: str) -> bool:
    return fnmatchcase(item.alias, name)


class _Search:
    def __init__(self, objects: ObjectTree, fits: _Fits):
        self._children: dict[SceneObject | None, list[SceneObject]] = defaultdict(list)
        for item in map(objects.__getitem__, objects):
            self._children[item.parent].append(item)
        self._fits = fits
        self._seen: set[tuple[SceneObject | None, int]] = set()

    def below(self, here: SceneObject | None, elements: Sequence[str]) -> Iterator[SceneObject]:
        """Yield each object that the elements mean, starting from an object (None: the root of the scene), once."""
        if (here, len(elements)) in self._seen:
            return
        self._seen.add((here, len(elements)))
        if not elements:
            yield from () if here is None else (here,)
            return
        if elements[0] == "..":
            named = iter(()) if here is None else iter((here.parent,))
        else:
            named = self._named(here, elements[0])
        for item in named:
            yield from self.below(item, elements[1:])

    def _named(self, above: SceneObject | None, element: str) -> Iterator[SceneObject]:
        match = _ELEMENT.fullmatch(element)
        if match is None:
            return
        level = self._children[above]
        found = [item for item in level if self._fits(item, match.group(1))]
        index = match.group(2)
        yield from found if index is None else found[int(index) :][:1]
        for item in level:
            if index is None or item not in found:
                yield from self._named(item, element)
