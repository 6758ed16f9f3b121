"""What a script draws: drawing objects, each a kind of item (points, lines, spheres, ...) and the items so far."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from drone_sim.scripting.api.constants import CONSTANTS

MOST = 2000  # items of one object: as many as can be sent to rviz ten times a second beside the flight

_MOST_OBJECTS = 1000

_KIND = 0x1F  # the bits of an object's type that say what its items are; the others say how they look
# Numbers that make one item: its points, or its middle and its normal. A size or a color of its own may follow.
_NUMBERS = {
    "points": 3,
    "lines": 6,
    "triangles": 9,
    "trianglepoints": 6,
    "quadpoints": 6,
    "discpoints": 6,
    "cubepoints": 6,
    "spherepoints": 3,
    "linestrip": 3,
}
_KINDS = {CONSTANTS[f"drawing_{kind}"]: kind for kind in _NUMBERS}
_CYCLIC = CONSTANTS["drawing_cyclic"]
_SEEN_THROUGH = {CONSTANTS["drawing_50percenttransparency"]: 0.5, CONSTANTS["drawing_25percenttransparency"]: 0.75}

Item = tuple[float, ...]


@dataclass(frozen=True)
class DrawingObject:
    """kind: a name such as "lines"; size: px for points and lines, m for the rest; rgba: 0..1; items: m, world."""

    kind: str
    size: float
    rgba: tuple[float, float, float, float]
    items: deque[Item]
    cyclic: bool
    tolerance: float


class Drawings:
    """The drawing objects of a run, by handle. `changes` counts, so that whoever shows them sees that they changed."""

    def __init__(self, shown: bool = True) -> None:
        """Start with none; `shown` says whether anybody shows them, or whether there are handles alone."""
        self.shown = shown
        self.objects: dict[int, DrawingObject] = {}
        self.changes = 0
        self._last_handle = 0

    def new_handle(self) -> int:
        """Return a handle that nothing else has that is drawn in this run."""
        self._last_handle += 1
        return self._last_handle

    def make(self, kind: int, size: float, tolerance: float, most: int, color: Item) -> int:
        """Add an object that holds up to `most` items, and return its handle.

        Raises ValueError for a kind that there is not, or too many.
        """
        if len(self.objects) >= _MOST_OBJECTS:
            raise ValueError(f"{_MOST_OBJECTS} drawing objects are there already: remove some")
        if kind & _KIND not in _KINDS:
            raise ValueError(f"no drawing object has the type {kind}; known are sim.drawing_{', '.join(_NUMBERS)}")
        alpha = math.prod(part for flag, part in _SEEN_THROUGH.items() if kind & flag)
        rgba = (color[0], color[1], color[2], alpha)
        items: deque[Item] = deque(maxlen=min(max(1, most), MOST))
        handle = self.new_handle()
        self.objects[handle] = DrawingObject(
            _KINDS[kind & _KIND], size, rgba, items, bool(kind & _CYCLIC), max(0.0, tolerance)
        )
        self.changes += 1
        return handle

    def add(self, handle: int, item: Item | None) -> None:
        """Add an item, unless the object is full and not cyclic, or has one so near; None removes all items.

        Raises ValueError for a handle that there is not, and for too few numbers.
        """
        drawn = self._object(handle)
        self.changes += 1
        if item is None:
            drawn.items.clear()
            return
        count = _NUMBERS[drawn.kind]
        if len(item) < count:
            raise ValueError(f"an item of {drawn.kind} has {count} numbers, not {len(item)}")
        full = not drawn.cyclic and len(drawn.items) == drawn.items.maxlen
        if not full and not self._is_there(drawn, item):
            drawn.items.append(tuple(item[:count]))

    def remove(self, handle: int) -> None:
        """Remove an object; raises ValueError for a handle that there is not."""
        self._object(handle)
        del self.objects[handle]
        self.changes += 1

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what is drawn now."""
        kept, last = _copied(self.objects), self._last_handle

        def recall() -> None:
            self._last_handle = last
            self.objects.clear()
            self.objects.update(_copied(kept))
            self.changes += 1

        return recall

    def clear(self) -> None:
        """Remove every object, as at the beginning of a run."""
        self._last_handle = 0
        self.objects.clear()
        self.changes += 1

    def _object(self, handle: int) -> DrawingObject:
        if handle not in self.objects:
            raise ValueError(f"no drawing object has the handle {handle}")
        return self.objects[handle]

    @staticmethod
    def _is_there(drawn: DrawingObject, item: Item) -> bool:
        return drawn.tolerance > 0 and any(math.dist(one[:3], item[:3]) < drawn.tolerance for one in drawn.items)


def _copied(objects: dict[int, DrawingObject]) -> dict[int, DrawingObject]:
    return {handle: replace(drawn, items=drawn.items.copy()) for handle, drawn in objects.items()}
