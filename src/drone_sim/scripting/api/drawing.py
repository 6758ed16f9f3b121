"""`sim`: drawing objects, which rviz shows; where nobody shows them they are accepted and ignored, said once."""

from __future__ import annotations

from typing import Any

from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api.calls import Function, numbers
from drone_sim.scripting.api.drawings import MOST
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.types import Handle, Number, Numbers, ThreeNumbers

_IGNORED = "there is nothing to draw on; accepted and ignored"
_GREY = (0.5, 0.5, 0.5)


class Drawing:
    """The functions that draw."""

    def __init__(self, host: Host, ignored: Ignored):
        """Take where to draw, and what says that something is ignored."""
        self._drawings = host.drawings
        self._objects = host.objects
        self._ignored = ignored

    def functions(self) -> dict[str, Function]:
        """Return every function, by name."""
        found = (self.addDrawingObject, self.addDrawingObjectItem, self.removeDrawingObject)
        return {one.__name__: one for one in found}

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
            self._ignored.say("addDrawingObject", _IGNORED)
            return self._drawings.new_handle()
        if maxItemCount > MOST:
            self._ignored.say("addDrawingObject", f"{maxItemCount} items are too many: {MOST} are kept")
        extent, tolerance = numbers((size, duplicateTolerance), 2)
        return self._drawings.make(
            int(objectType), extent, tolerance, int(maxItemCount), rgb, above.matrix if above else None
        )

    def addDrawingObjectItem(self, handle: Handle, item: Numbers | None = None) -> None:
        """Draw one more item, its points one after the other (m, world); without an item, remove all of them."""
        values = None if item is None else numbers(item, len(item))
        if self._drawings.shown:
            self._drawings.add(handle, values)
        else:
            self._ignored.say("addDrawingObjectItem", _IGNORED)

    def removeDrawingObject(self, handle: Handle) -> None:
        """Remove a drawing object."""
        if self._drawings.shown:
            self._drawings.remove(handle)
