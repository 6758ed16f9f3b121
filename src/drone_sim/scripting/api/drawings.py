"""`sim`: what a script draws: drawing objects, each with a kind of item (points, lines, spheres, ...)."""

from __future__ import annotations

import logging
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.types import Handle, Number, Numbers, ThreeNumbers, numbers

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
_IGNORED = "this drawing is not supported; accepted and ignored"
_GREY = (0.5, 0.5, 0.5)


@dataclass(frozen=True)
class DrawingObject:
    """kind: a name such as "lines"; size: px for points and lines, m for the rest; rgba: 0..1.

    items: m, in the frame of what carries them, the world's where that is None; `turned` where they are given with a
    quaternion, `local` where they are given in that frame.
    """

    kind: str
    size: float
    rgba: Item
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
    """The drawing objects of a run, by handle. `changes` is a counter: viewers see by it that something has changed."""

    def __init__(self, shown: bool = True) -> None:
        """Start with none; `shown` says whether anybody shows them, or whether there are handles alone."""
        self.shown = shown
        self.objects: dict[int, DrawingObject] = {}
        self.changes = 0
        self._last_handle = 0

    @property
    def carried(self) -> bool:
        """Whether any item is attached to an object, so that it may move without being drawn again."""
        return any(one.frame is not None and one.items for one in self.objects.values())

    def new_handle(self) -> int:
        """Return a handle that nothing else has that is drawn in this run."""
        self._last_handle += 1
        return self._last_handle

    def make(
        self, kind: int, size: float, tolerance: float, most: int, color: Item, frame: Callable[[], Matrix] | None
    ) -> int:
        """Add an object that holds up to `most` items, and return its handle.

        `frame` returns the transform of what carries the items. Raises ValueError for a kind that there is not, or too
        many.
        """
        if len(self.objects) >= _MOST_OBJECTS:
            raise ValueError(f"at most {_MOST_OBJECTS} drawing objects are allowed: remove some")
        turned = kind & _KIND in _TURNED
        if kind & _KIND not in _KINDS and not turned:
            raise ValueError(f"{kind} is not a type of drawing object; known are sim.drawing_{', '.join(_NUMBERS)}")
        name = _TURNED[kind & _KIND] if turned else _KINDS[kind & _KIND]
        rgba = (*color[:3], math.prod(part for flag, part in _SEEN_THROUGH.items() if kind & flag))
        items: deque[Item] = deque(maxlen=min(max(1, most), MOST))
        handle, cyclic, local = self.new_handle(), bool(kind & _CYCLIC), bool(kind & _LOCAL)
        self.objects[handle] = DrawingObject(name, size, rgba, items, cyclic, max(0.0, tolerance), frame, turned, local)
        self.changes += 1
        return handle

    def add(self, handle: int, item: Item | None) -> None:
        """Add an item, unless the object is full and not cyclic, or has an item nearby (tolerance); None removes all.

        Raises ValueError for an unknown handle, and for too few numbers.
        """
        drawn = self._object(handle)
        self.changes += 1
        if item is None:
            drawn.items.clear()
            return
        count = 7 if drawn.turned else _NUMBERS[drawn.kind]
        if len(item) < count:
            raise ValueError(f"an item of {drawn.kind} must have {count} numbers, not {len(item)}")
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

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings back what is drawn now."""
        kept, last = _copied(self.objects), self._last_handle

        def restore() -> None:
            self._last_handle = last
            self.objects.clear()
            self.objects.update(_copied(kept))
            self.changes += 1

        return restore

    def clear(self) -> None:
        """Remove every object, as at the beginning of a run."""
        self._last_handle = 0
        self.objects.clear()
        self.changes += 1

    def _object(self, handle: int) -> DrawingObject:
        if handle not in self.objects:
            raise ValueError(f"there is no drawing object with the handle {handle}")
        return self.objects[handle]

    @staticmethod
    def _is_there(drawn: DrawingObject, item: Item) -> bool:
        return drawn.tolerance > 0 and any(math.dist(one[:3], item[:3]) < drawn.tolerance for one in drawn.items)


def _moved(matrix: Matrix, item: Item, has_normal: bool) -> Item:
    """Return an item with its points transformed into another frame; a normal is only rotated."""
    if has_normal:
        return (*frames.transform(matrix, item[:3]), *frames.rotate(matrix, item[3:]))
    return tuple(one for at in range(0, len(item), 3) for one in frames.transform(matrix, item[at : at + 3]))


def _copied(objects: dict[int, DrawingObject]) -> dict[int, DrawingObject]:
    return {handle: replace(drawn, items=drawn.items.copy()) for handle, drawn in objects.items()}


class DrawingFunctions:
    """Drawing objects, for rviz and the cockpit; without ROS they are accepted and ignored."""

    def __init__(self, drawings: Drawings, objects: ObjectTree, ignored: Ignored):
        """`drawings` is where to draw, `objects` may carry it; `ignored` says that something is ignored."""
        self._drawings = drawings
        self._objects = objects
        self._ignored = ignored

    @sim("345")
    def addDrawingObject(
        self,
        objectType: int,
        size: Number,
        duplicateTolerance: Number = 0.0,
        parent: Handle = WORLD,
        maxItemCount: int = 1,
        color: ThreeNumbers | None = None,
        *_shine: Any,
    ) -> int:
        """Make a drawing object that holds up to `maxItemCount` items; return its handle.

        `size` is in px for points and lines, else in m. A parent carries the items: where they are drawn in the world
        they go with it.
        """
        rgb = numbers(color, 3) if color else _GREY
        above = None if parent == WORLD else self._objects[parent]
        if not self._drawings.shown:
            self._ignored.say("addDrawingObject", _IGNORED, level=logging.DEBUG)
            return self._drawings.new_handle()
        if maxItemCount > MOST:
            self._ignored.say("addDrawingObject", f"maxItemCount = {maxItemCount}: at most {MOST} are kept")
        extent, tolerance = numbers((size, duplicateTolerance), 2)
        return self._drawings.make(
            int(objectType), extent, tolerance, int(maxItemCount), rgb, above.matrix if above else None
        )

    @sim("345")
    def addDrawingObjectItem(self, handle: Handle, item: Numbers | None = None) -> None:
        """Draw one more item, its points one after the other (m, world); without an item, remove all of them."""
        values = None if item is None else numbers(item, len(item))
        if self._drawings.shown:
            self._drawings.add(handle, values)
        else:
            self._ignored.say("addDrawingObjectItem", _IGNORED, level=logging.DEBUG)

    @sim("345")
    def removeDrawingObject(self, handle: Handle) -> None:
        """Remove a drawing object."""
        if self._drawings.shown:
            self._drawings.remove(handle)
