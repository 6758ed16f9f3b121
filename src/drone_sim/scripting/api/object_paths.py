"""Paths of CoppeliaSim 4.x: which object of the tree a path means.

    /Quadcopter/base  /base                    from the root of the scene
    .  ./base  ..  ../propeller[0]             from the object that the script is on, or from its parent
    :  :/base  ::                              from the model that it is part of, or from the model above that
    /Quadcopter/propeller[1]  /Quad*/prop*     the second of siblings; any letters (*), one letter (?)

An element names any descendant, the nearest first. The next element is looked for below each of these, until an object
is found.
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
    """Tell whether a name is a path."""
    return "/" in name or name in (".", "..", ":", "::")


def find(
    objects: ObjectTree, path: str, own: SceneObject | None, above: SceneObject | None, index: int = 0
) -> SceneObject | None:
    """Return the object that a path means, the index-th of several; None where there is none.

    `own` is the object where relative paths begin (None: there is none), `above` the object that `..` means.
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
    """Return the objects that a path means, the first ones, or all of them; the rest is as for `find`."""
    first, *rest = path.split("/")
    model = None if own is None else own.model()
    model_above = None if model is None or model.parent is None else model.parent.model()
    begins = {".": own, "..": above, ":": model, "::": model_above}
    elements = [one for one in (rest if first in begins else [first, *rest]) if one not in ("", ".")]
    if len(elements) > _MOST:
        return []
    for fits in (_has_alias, SceneObject.is_called):  # names of 3.x, too, where nothing has the alias
        found = [*itertools.islice(_Search(objects, fits).below(begins.get(first), elements), most)]
        if found:
            return found
    return []


def _has_alias(one: SceneObject, name: str) -> bool:
    return fnmatchcase(one.alias, name)


class _Search:
    """Looks for what the elements of one path name."""

    def __init__(self, objects: ObjectTree, fits: _Fits):
        """`fits` tells whether an object is called so."""
        self._children: dict[SceneObject | None, list[SceneObject]] = defaultdict(list)
        for one in map(objects.__getitem__, objects):
            self._children[one.parent].append(one)
        self._fits = fits
        self._seen: set[tuple[SceneObject | None, int]] = set()

    def below(self, here: SceneObject | None, elements: Sequence[str]) -> Iterator[SceneObject]:
        """Yield the objects that elements name, beginning at an object (None: the root of the scene), each once."""
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
        for one in named:
            yield from self.below(one, elements[1:])

    def _named(self, above: SceneObject | None, element: str) -> Iterator[SceneObject]:
        match = _ELEMENT.fullmatch(element)
        if match is None:
            return
        level = self._children[above]
        found = [one for one in level if self._fits(one, match.group(1))]
        index = match.group(2)
        yield from found if index is None else found[int(index) :][:1]
        for one in level:
            if index is None or one not in found:
                yield from self._named(one, element)
