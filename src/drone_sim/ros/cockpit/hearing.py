"""What the simulation says in words: its state, its log, and why it does not fly."""

from __future__ import annotations

from typing import Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure.msg import Config
from rosgraph_msgs.msg import Log
from std_msgs.msg import String

from drone_sim.ros.cockpit.panel.panel import Panel
from drone_sim.ros.cockpit.server.wire import Wire
from drone_sim.ros.cockpit.simulator import script_failure

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
            (f"{node}/parameter_updates", Config, panel.pace.hear),
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
        own = f"{self._node.strip('/')}: "
        found = {one.name.removeprefix(own): one for one in message.status if one.name.startswith(own)}
        if not found:  # another node's
            return
        wrong = [f"{name}: {one.message}" for name, one in found.items() if one.level != DiagnosticStatus.OK]
        fine = [f"{name}: {one.message}" for name, one in found.items() if one.level == DiagnosticStatus.OK]
        self._panel.diagnose([*(wrong or ["nothing is wrong"]), "", *fine])
        values = {one.key: one.value for one in found["simulation"].values} if "simulation" in found else {}
        self._panel.pace.show_reached(values.get("real-time factor", ""))
