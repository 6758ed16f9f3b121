"""`sim`: what only changes what one sees: drawing objects, particles, floating views, dialogs.

Drawing objects are shown where somebody shows them; everything else is accepted and ignored, which the log says
once for each function.
"""

from __future__ import annotations

from typing import Any

from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api.calls import Function, numbers
from drone_sim.scripting.api.drawings import MOST
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.types import Handle, Number, Numbers, ThreeNumbers
from drone_sim.scripting.script_log import LOG

_MAKERS = ("addParticleObject", "floatingViewAdd", "auxiliaryConsoleOpen", "displayDialog")
_OTHERS = (
    "addParticleObjectItem",
    "removeParticleObject",
    "floatingViewRemove",
    "adjustView",
    "cameraFitToView",
    "auxiliaryConsolePrint",
    "auxiliaryConsoleClose",
    "endDialog",
    "setObjectColor",
    "setShapeColor",
)
_IGNORED = "there is nothing to draw on; accepted and ignored"
_GREY = (0.5, 0.5, 0.5)


class Drawing:
    """The functions that draw."""

    def __init__(self, host: Host):
        """Take where to draw."""
        self._drawings = host.drawings
        self._said: set[str] = set()

    def functions(self) -> dict[str, Function]:
        """Return every function, by name."""
        makers = {name: self._ignored(name, makes=True) for name in _MAKERS}
        others = {name: self._ignored(name, makes=False) for name in _OTHERS}
        real = (self.addDrawingObject, self.addDrawingObjectItem, self.removeDrawingObject)
        return {**makers, **others, **{one.__name__: one for one in real}}

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

        `size` is in px for points and lines, else in m. Items stay where they are in the world: a parent does not
        carry them.
        """
        rgb = numbers(color, 3) if color else _GREY
        if not self._drawings.shown:
            self._say("addDrawingObject", _IGNORED)
            return self._drawings.new_handle()
        if parent != WORLD:
            self._say("addDrawingObject", "the parent is ignored: items stay where they are drawn")
        if maxItemCount > MOST:
            self._say("addDrawingObject", f"{maxItemCount} items are too many: {MOST} are kept")
        extent, tolerance = numbers((size, duplicateTolerance), 2)
        return self._drawings.make(int(objectType), extent, tolerance, int(maxItemCount), rgb)

    def addDrawingObjectItem(self, handle: Handle, item: Numbers | None = None) -> None:
        """Draw one more item, its points one after the other (m, world); without an item, remove all of them."""
        values = None if item is None else numbers(item, len(item))
        if self._drawings.shown:
            self._drawings.add(handle, values)
        else:
            self._say("addDrawingObjectItem", _IGNORED)

    def removeDrawingObject(self, handle: Handle) -> None:
        """Remove a drawing object."""
        if self._drawings.shown:
            self._drawings.remove(handle)

    def _ignored(self, name: str, makes: bool) -> Function:
        def call(*_arguments: Any) -> int | None:
            self._say(name, _IGNORED)
            return self._drawings.new_handle() if makes else None

        call.__doc__ = "Do nothing."
        return call

    def _say(self, name: str, what: str) -> None:
        if name not in self._said:
            self._said.add(name)
            LOG.info("sim.%s: %s", name, what)
