"""`sim`: what only changes what one sees: drawing objects, particles, floating views, dialogs.

Drawn where the drone has a DrawingSink, accepted and ignored elsewhere, which the log says once for
each function.
"""

from __future__ import annotations

from typing import Any, Dict, Optional

from drone_sim.scripting.api_scripts import LOG
from drone_sim.scripting.calls import Function
from drone_sim.scripting.host import Host

_MAKERS = ("addDrawingObject", "addParticleObject", "floatingViewAdd", "auxiliaryConsoleOpen", "displayDialog")
_OTHERS = (
    "addDrawingObjectItem",
    "removeDrawingObject",
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
    "setThreadSwitchTiming",
    "setThreadAutomaticSwitch",
)


class Drawing:
    """Hands calls to the sink, and handles to the script."""

    def __init__(self, host: Host):
        """Take the drone that may have a sink."""
        self._host = host
        self._made = 0
        self._said: Dict[str, bool] = {}

    def functions(self) -> Dict[str, Function]:
        """Return every function, by name."""
        makers = {name: self._function(name, makes=True) for name in _MAKERS}
        return {**makers, **{name: self._function(name, makes=False) for name in _OTHERS}}

    def _function(self, name: str, makes: bool) -> Function:
        def call(*arguments: Any) -> Optional[int]:
            if makes:
                self._made += 1
            handle = self._made if makes else arguments[0] if arguments else 0
            sink = self._host.drawing
            if sink is not None:
                sink(name, arguments, handle)
            elif name not in self._said:
                self._said[name] = True
                LOG.info("sim.%s: there is nothing to draw on; accepted and ignored", name)
            return self._made if makes else None

        call.__doc__ = "Draw, where there is something to draw on."
        return call
