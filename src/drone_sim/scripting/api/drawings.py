"""What a script draws: drawing objects, each a kind of item (points, lines, spheres, ...) and the items so far."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
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
# 4.3 has the last of these with a quaternion in place of a normal, under other names: the middle, and 4 numbers.
_TURNED = {CONSTANTS[f"drawing_{kind}pts"]: f"{kind}points" for kind in ("triangle", "quad", "disc", "cube")}
_LOCAL = CONSTANTS["drawing_local"]
_CYCLIC = CONSTANTS["drawing_cyclic"]
_SEEN_THROUGH = {CONSTANTS["drawing_50percenttransparency"]: 0.5, CONSTANTS["drawing_25percenttransparency"]: 0.75}

Item = tuple[float, ...]


@dataclass(frozen=True)
class DrawingObject:
    """kind: a name such as "lines"; size: px for points and lines, m for the rest; rgba: 0..1.

    items: m, in the frame of what carries them, the world's where that is None; `turned` where they are given with a
    quaternion, `local` where they are given in that frame.
    """

    kind: str
    size: float
    rgba: tuple[float, float, float, float]
    items: deque[Item]
    cyclic: bool
    tolerance: float
    frame: Callable[[], Matrix] | None = None
    turned: bool = False
    local: bool = False

    def in_world(self) -> list[Item]:
        """Return the items as they stand in the world now."""
        if self.frame is None:
            return list(self.items)
        matrix = self.frame()
        return [_moved(matrix, one, self.kind.endswith("points") and len(one) == 6) for one in self.items]


class Drawings:
    """The drawing objects of a run, by handle. `changes` counts, so that whoever shows them sees that they changed."""

    def __init__(self, shown: bool = True) -> None:
        """Start with none; `shown` says whether anybody shows them, or whether there are handles alone."""
        self.shown = shown
        self.objects: dict[int, DrawingObject] = {}
        self.changes = 0
        self._last_handle = 0

    @property
    def carried(self) -> bool:
        """Whether anything that is drawn may move though nothing was drawn."""
        return any(one.frame is not None and one.items for one in self.objects.values())

    def new_handle(self) -> int:
        """Return a handle that nothing else has that is drawn in this run."""
        self._last_handle += 1
        return self._last_handle

    def make(
        self,
        kind: int,
        size: float,
        tolerance: float,
        most: int,
        color: Item,
        frame: Callable[[], Matrix] | None = None,
    ) -> int:
        """Add an object that holds up to `most` items, and return its handle.

        `frame` returns the transform of what carries the items. Raises ValueError for a kind that there is not, or too
        many.
        """
        if len(self.objects) >= _MOST_OBJECTS:
            raise ValueError(f"{_MOST_OBJECTS} drawing objects are there already: remove some")
        turned = kind & _KIND in _TURNED
        if kind & _KIND not in _KINDS and not turned:
            raise ValueError(f"no drawing object has the type {kind}; known are sim.drawing_{', '.join(_NUMBERS)}")
        alpha = math.prod(part for flag, part in _SEEN_THROUGH.items() if kind & flag)
        rgba = (color[0], color[1], color[2], alpha)
        items: deque[Item] = deque(maxlen=min(max(1, most), MOST))
        handle = self.new_handle()
        self.objects[handle] = DrawingObject(
            _TURNED[kind & _KIND] if turned else _KINDS[kind & _KIND],
            size,
            rgba,
            items,
            bool(kind & _CYCLIC),
            max(0.0, tolerance),
            frame,
            turned,
            bool(kind & _LOCAL),
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
        count = 7 if drawn.turned else _NUMBERS[drawn.kind]
        if len(item) < count:
            raise ValueError(f"an item of {drawn.kind} has {count} numbers, not {len(item)}")
        if drawn.turned:
            item = (*item[:3], *frames.turned(item[3:7], (0.0, 0.0, 1.0)))
        item = tuple(item[: _NUMBERS[drawn.kind]])
        if drawn.frame is not None and not drawn.local:
            item = _moved(frames.invert(drawn.frame()), item, len(item) == 6 and drawn.kind != "lines")
        full = not drawn.cyclic and len(drawn.items) == drawn.items.maxlen
        if not full and not self._is_there(drawn, item):
            drawn.items.append(item)

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


def _moved(matrix: Matrix, item: Item, has_normal: bool) -> Item:
    """Return an item whose points are given in one frame in another; a normal is turned alone."""
    if has_normal:
        return (*frames.transform(matrix, item[:3]), *frames.rotate(matrix, item[3:]))
    return tuple(one for at in range(0, len(item), 3) for one in frames.transform(matrix, item[at : at + 3]))


def _copied(objects: dict[int, DrawingObject]) -> dict[int, DrawingObject]:
    return {handle: replace(drawn, items=drawn.items.copy()) for handle, drawn in objects.items()}
