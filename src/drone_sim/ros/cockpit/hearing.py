"""What the simulation says in words: its state, its log, and why it does not fly."""

from __future__ import annotations

from typing import Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log
from std_msgs.msg import String

from drone_sim.ros.cockpit.panel import Panel
from drone_sim.ros.cockpit.simulator import script_failure
from drone_sim.ros.cockpit.wire import Wire

_LEVELS = {Log.WARN: "warning: ", Log.ERROR: "error: ", Log.FATAL: "error: "}


class Hearing:
    """Listens to one node, and shows what it says."""

    def __init__(self, node: str, panel: Panel, wire: Wire):
        """Listen."""
        self._node = node
        self._panel, self._wire = panel, wire
        heard = (
            ("/rosout_agg", Log, self._on_log),
            ("/diagnostics", DiagnosticArray, self._on_diagnostics),
            (f"{node}/state", String, lambda message: panel.show_state(message.data)),
        )
        self._listening = [rospy.Subscriber(*one, queue_size=20) for one in heard]

    def close(self) -> None:
        """Listen no more."""
        for one in self._listening:
            one.unregister()

    def _on_log(self, message: Any) -> None:
        if message.name != self._node:
            return
        self._panel.log(f"{_LEVELS.get(message.level, '')}{message.msg}")
        failure = script_failure(message.msg) if message.level >= Log.ERROR else None
        if failure is not None:
            self._wire.tell({"failure": failure._asdict()})

    def _on_diagnostics(self, message: Any) -> None:
        wrong = [one for one in message.status if one.level != DiagnosticStatus.OK]
        lines = [f"{one.name.rpartition(': ')[2]}: {one.message}" for one in wrong]
        self._panel.diagnose("\n".join(lines) or "nothing is wrong")
