"""Fly with a gamepad: a device of this machine or, without one, the topic `joy` (sensor_msgs/Joy).

While the dead man's button is pressed, the sticks give velocity commands at a constant rate. When it is released, the
gamepad is disconnected, or the node ends, the node sends a stop. Other buttons request take-off, landing and reset
(std_msgs/Empty). config/joy.yaml has the numbers of axes and buttons.
"""

from __future__ import annotations

import contextlib
import math
import queue
import select
import time
from collections.abc import Callable, Iterable
from typing import Any

import rospy
from sensor_msgs.msg import Joy

from drone_sim.ros.core.shell_files import from_shell
from drone_sim.ros.core.shutdown import run_tool
from drone_sim.ros.tools import gamepad
from drone_sim.ros.tools.commands import Command
from drone_sim.ros.tools.gamepad import Gamepad, JoyCommands, JoyParameters, JoyState, load_joy
from drone_sim.ros.tools.teleop import Teleop

_NAME = "joy_teleop"
_SEARCH_PERIOD = 1.0  # s, between two searches for a gamepad
_TELEOP_PARAMETERS = ("drone", "simulator")  # private parameters that Teleop reads


class JoyTeleop:
    """Sends the commands of a gamepad to the drone."""

    def __init__(self, parameters: JoyParameters, teleop: Teleop):
        """Subscribe to the topic `joy`; `teleop` sends the commands."""
        self._parameters, self._teleop = parameters, teleop
        self._joy_commands = JoyCommands(parameters)
        self._gamepad: Gamepad | None = None
        self._searched_at = -math.inf
        self._reported = ""  # the last warning about a missing gamepad
        self._received_at = -math.inf  # time of the last message on the topic
        self._messages: queue.SimpleQueue[Joy] = queue.SimpleQueue()
        self._is_flying = False
        self._due = 0.0
        self._topic = rospy.Subscriber("joy", Joy, self._on_joy, queue_size=10)

    def run(self, over: Callable[[], bool]) -> None:
        """Send commands until `over` returns True."""
        rospy.loginfo(f"{_NAME}: hold button {self._parameters.dead_man} to fly; commands on {self._teleop.topic}")
        while not over():
            self._find_gamepad()
            for state in self._states(max(0.0, self._due - time.monotonic())):
                for name in self._joy_commands.update(state):
                    is_sent = self._teleop.request(name)
                    rospy.loginfo(f"{_NAME}: {name}{'' if is_sent else f': {self._teleop.status}'}")
                self._command()
            self._check_topic()
            self._command()

    def _command(self) -> None:
        """Send the command if it is due, and a stop as soon as there is no command any more."""
        command, now = self._joy_commands.command, time.monotonic()
        if command is None and self._is_flying:
            self._send(Command())
        elif command is not None and (now >= self._due or not self._is_flying):
            self._send(command)
        if now >= self._due:
            self._due = now + 1 / self._parameters.rate
        self._is_flying = command is not None

    def _send(self, command: Command) -> None:
        if not self._teleop.send(command):
            rospy.logwarn_throttle(5, f"{_NAME}: {self._teleop.status}")

    # ---- sources

    def _on_joy(self, message: Joy) -> None:
        if self._gamepad is None:
            self._messages.put(message)

    def _states(self, seconds: float) -> Iterable[JoyState]:
        """Wait for at most `seconds`; return the gamepad's state after each event."""
        if self._gamepad is None:
            with contextlib.suppress(queue.Empty):
                message = self._messages.get(timeout=seconds)
                self._received_at = time.monotonic()
                axes = (value if math.isfinite(value) else 0.0 for value in message.axes[:256])
                limited = tuple(max(-1.0, min(1.0, value)) for value in axes)
                return [JoyState(limited, tuple(map(bool, message.buttons[:256])))]
            return []
        select.select([self._gamepad], [], [], seconds)
        try:
            return list(self._gamepad.read())
        except OSError as error:
            self._disconnect(f"{self._gamepad.device}: {error.strerror or error}")
            self._gamepad.close()
            self._gamepad = None
            return []

    def _disconnect(self, reason: str) -> None:
        effect = ": the drone is stopped" if self._joy_commands.command is not None else ""
        rospy.logwarn(f"{_NAME}: {reason}{effect}")
        self._joy_commands.disconnect()

    def _check_topic(self) -> None:
        """If the drone flies by the topic, and it has no publisher or no messages, treat that as a lost gamepad."""
        timeout = self._parameters.timeout
        if self._gamepad is not None or self._joy_commands.command is None:
            return
        if not self._topic.get_num_connections():
            self._disconnect(f"{self._topic.resolved_name} has no publisher any more")
        elif timeout and time.monotonic() - self._received_at > timeout:
            self._disconnect(
                f"no message on {self._topic.resolved_name} for {timeout:g} s (autorepeat_rate of the joy node?)"
            )

    def _find_gamepad(self) -> None:
        device = self._parameters.device
        if self._gamepad is not None or device == "none" or time.monotonic() - self._searched_at < _SEARCH_PERIOD:
            return
        self._searched_at = time.monotonic()
        devices = gamepad.list_devices() if device == "auto" else [device]
        try:
            self._gamepad = Gamepad(devices[0])
        except (OSError, IndexError) as error:
            reason = f"{devices[0]}: {error}" if devices else "there is no /dev/input/js*"
            warning = f"no gamepad found ({reason}); listening on {self._topic.resolved_name}"
            if warning != self._reported:
                rospy.logwarn(f"{_NAME}: {warning}")
            self._reported = warning
            return
        self._reported = ""
        self._joy_commands.disconnect()
        rospy.loginfo(f"{_NAME}: {self._gamepad.name} on {self._gamepad.device}")


def _fly(over: Callable[[], bool]) -> None:
    private: dict[str, Any] = rospy.get_param("~", {})
    given = {key: value for key, value in private.items() if key not in _TELEOP_PARAMETERS}
    if isinstance(given.get("config"), str):
        given["config"] = from_shell(given["config"])
    parameters, teleop = load_joy(given), Teleop()
    try:
        JoyTeleop(parameters, teleop).run(over)
    finally:
        teleop.stop()
        rospy.loginfo(f"{_NAME}: {teleop.farewell}")


def main() -> int:
    """Run the node until a signal; return its exit status."""
    return run_tool(_NAME, _fly)
