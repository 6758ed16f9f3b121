"""`sim`: drawing objects, each with items of one kind (points, lines, spheres, ...)."""

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

MOST = 2000  # items of one object, which can be sent to rviz ten times a second during a flight

_MOST_OBJECTS = 1000

_KIND = 0x1F  # the bits of an object's type for the kind of its items; the others are options of their appearance
# Numbers of an item: its points, or its centre and normal. They may be followed by the item's own size or color.
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
# In 4.3, some of them have other names and a quaternion instead of a normal: the centre, and 4 numbers.
_ROTATED = {CONSTANTS[f"drawing_{kind}pts"]: f"{kind}points" for kind in ("triangle", "quad", "disc", "cube")}
_LOCAL = CONSTANTS["drawing_local"]
_CYCLIC = CONSTANTS["drawing_cyclic"]
_OPACITIES = {CONSTANTS["drawing_50percenttransparency"]: 0.5, CONSTANTS["drawing_25percenttransparency"]: 0.75}

Item = tuple[float, ...]
_IGNORED = "this drawing is not supported; accepted and ignored"
_GREY = (0.5, 0.5, 0.5)


@dataclass(frozen=True)
class DrawingObject:
    """A drawing object. kind: a name such as "lines"; size: px for points and lines, otherwise m; rgba: 0 to 1.

    items: m, in the frame of the object that carries them, or the world frame if `frame` is None. `turned`: the script
    gives them with a quaternion; `local`: the script gives them in that frame.
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
        """Return the items in the world frame."""
        if self.frame is None:
            return list(self.items)
        matrix = self.frame()
        return [_moved(matrix, item, self.kind.endswith("points") and len(item) == 6) for item in self.items]


class Drawings:
    """The drawing objects of a run, by handle. `changes` is a counter from which viewers notice changes."""

    def __init__(self, shown: bool = True) -> None:
        """Create it without objects; if not `shown`, only handles are created, because nothing shows the objects."""
        self.shown = shown
        self.objects: dict[int, DrawingObject] = {}
        self.changes = 0
        self._last_handle = 0

    @property
    def carried(self) -> bool:
        """Whether any item is attached to an object, so that it may move without being drawn again."""
        return any(drawn.frame is not None and drawn.items for drawn in self.objects.values())

    def new_handle(self) -> int:
        """Return a handle that no other drawing object or window of this run has."""
        self._last_handle += 1
        return self._last_handle

    def make(
        self, kind: int, size: float, tolerance: float, most: int, color: Item, frame: Callable[[], Matrix] | None
    ) -> int:
        """Add an object with up to `most` items, and return its handle.

        `frame` returns the transform of the object that carries the items. Raises ValueError for an unknown kind, or
        too many objects.
        """
        if len(self.objects) >= _MOST_OBJECTS:
            raise ValueError(f"at most {_MOST_OBJECTS} drawing objects are allowed: remove some")
        turned = kind & _KIND in _ROTATED
        if kind & _KIND not in _KINDS and not turned:
            raise ValueError(f"{kind} is not a type of drawing object; known are sim.drawing_{', '.join(_NUMBERS)}")
        name = _ROTATED[kind & _KIND] if turned else _KINDS[kind & _KIND]
        rgba = (*color[:3], math.prod(part for flag, part in _OPACITIES.items() if kind & flag))
        items: deque[Item] = deque(maxlen=min(max(1, most), MOST))
        handle, cyclic, local = self.new_handle(), bool(kind & _CYCLIC), bool(kind & _LOCAL)
        self.objects[handle] = DrawingObject(name, size, rgba, items, cyclic, max(0.0, tolerance), frame, turned, local)
        self.changes += 1
        return handle

    def add(self, handle: int, item: Item | None) -> None:
        """Add an item, unless the object is full and not cyclic, or has an item within its tolerance; None removes all.

        Raises ValueError for an unknown handle or too few numbers.
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
        if not drawn.cyclic and len(drawn.items) == drawn.items.maxlen:
            return
        if not drawn.tolerance or all(math.dist(other[:3], item[:3]) >= drawn.tolerance for other in drawn.items):
            drawn.items.append(item)

    def remove(self, handle: int) -> None:
        """Remove an object. Raises ValueError for an unknown handle."""
        self._object(handle)
        del self.objects[handle]
        self.changes += 1

    def save_state(self) -> Callable[[], None]:
        kept, last = _copied(self.objects), self._last_handle

        def restore() -> None:
            self._last_handle = last
            self.objects.clear()
            self.objects.update(_copied(kept))
            self.changes += 1

        return restore

    def clear(self) -> None:
        self._last_handle = 0
        self.objects.clear()
        self.changes += 1

    def _object(self, handle: int) -> DrawingObject:
        if handle not in self.objects:
            raise ValueError(f"there is no drawing object with the handle {handle}")
        return self.objects[handle]


def _moved(matrix: Matrix, item: Item, has_normal: bool) -> Item:
    """Return an item in another frame: its points are transformed, its normal is only rotated."""
    if has_normal:
        return (*frames.transform(matrix, item[:3]), *frames.rotate(matrix, item[3:]))
    return tuple(
        value for start in range(0, len(item), 3) for value in frames.transform(matrix, item[start : start + 3])
    )


def _copied(objects: dict[int, DrawingObject]) -> dict[int, DrawingObject]:
    return {handle: replace(drawn, items=drawn.items.copy()) for handle, drawn in objects.items()}


class DrawingFunctions:
    """Drawing objects, for rviz and the cockpit; without ROS they are accepted and ignored."""

    def __init__(self, drawings: Drawings, objects: ObjectTree, ignored: Ignored):
        """`drawings` are those of the run, `objects` may carry them; `ignored` logs what is ignored."""
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
        """Create a drawing object with up to `maxItemCount` items; return its handle.

        `size` is in px for points and lines, otherwise in m. The items move with the parent, if there is one.
        """
        rgb = numbers(color, 3) if color else _GREY
        carrier = None if parent == WORLD else self._objects[parent]
        if not self._drawings.shown:
            self._ignored.log("addDrawingObject", _IGNORED, level=logging.DEBUG)
            return self._drawings.new_handle()
        if maxItemCount > MOST:
            self._ignored.log("addDrawingObject", f"maxItemCount = {maxItemCount}: at most {MOST} are kept")
        extent, tolerance = numbers((size, duplicateTolerance), 2)
        return self._drawings.make(
            int(objectType), extent, tolerance, int(maxItemCount), rgb, carrier.matrix if carrier else None
        )

    @sim("345")
    def addDrawingObjectItem(self, handle: Handle, item: Numbers | None = None) -> None:
        """Add an item: the coordinates of its points (m, world); without an item, remove all items."""
        values = None if item is None else numbers(item, len(item))
        if self._drawings.shown:
            self._drawings.add(handle, values)
        else:
            self._ignored.log("addDrawingObjectItem", _IGNORED, level=logging.DEBUG)

    @sim("345")
    def removeDrawingObject(self, handle: Handle) -> None:
        """Remove a drawing object."""
        if self._drawings.shown:
            self._drawings.remove(handle)
