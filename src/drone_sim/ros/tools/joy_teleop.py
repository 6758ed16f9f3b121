"""Fly from a gamepad: a device of this machine or, without one, the topic `joy` (sensor_msgs/Joy).

While the dead-man's button is held its sticks are commanded, at a steady rate; releasing it, a gamepad that vanishes,
and the end of the node send a stop. Buttons ask for take-off, landing and reset (std_msgs/Empty). config/joy.yaml says
which.
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

from drone_sim.ros.core.launch_parameters import from_shell
from drone_sim.ros.core.shutdown import run_tool
from drone_sim.ros.tools import gamepad
from drone_sim.ros.tools.commands import Command
from drone_sim.ros.tools.gamepad import Gamepad, JoyState
from drone_sim.ros.tools.joy_commands import JoyCommands, JoyParameters, load_joy
from drone_sim.ros.tools.teleop import Teleop

_NAME = "joy_teleop"
_LOOKING = 1.0  # s, between two looks for a gamepad
_OTHERS = ("drone", "simulator")  # private parameters that Teleop reads


class JoyTeleop:
    """Reads a gamepad and commands, until somebody ends it."""

    def __init__(self, parameters: JoyParameters, teleop: Teleop):
        """Listen to the topic; take the parameters of joy.yaml, and the teleop that sends the commands."""
        self._parameters, self._teleop = parameters, teleop
        self._pilot = JoyCommands(parameters)
        self._gamepad: Gamepad | None = None
        self._looked = -math.inf
        self._missed = ""  # a device that has been told of
        self._heard = -math.inf  # when something came on the topic
        self._messages: queue.SimpleQueue[Joy] = queue.SimpleQueue()
        self._flew = False
        self._due = 0.0
        self._topic = rospy.Subscriber("joy", Joy, self._on_joy, queue_size=10)

    def run(self, over: Callable[[], bool]) -> None:
        """Fly until it is over."""
        rospy.loginfo(f"{_NAME}: hold button {self._parameters.dead_man} to fly; commands on {self._teleop.topic}")
        while not over():
            self._look_for_gamepad()
            for pad in self._states(max(0.0, self._due - time.monotonic())):
                for name in self._pilot.see(pad):
                    heard = self._teleop.ask_for(name)
                    rospy.loginfo(f"{_NAME}: {name}{'' if heard else f': {self._teleop.said}'}")
                self._command()
            self._watch_topic()
            self._command()

    def _command(self) -> None:
        """Send the command when it is due, and a stop as soon as nothing is commanded any more."""
        command, now = self._pilot.command, time.monotonic()
        if command is None and self._flew:
            self._send(Command())
        elif command is not None and (now >= self._due or not self._flew):
            self._send(command)
        if now >= self._due:
            self._due = now + 1 / self._parameters.rate
        self._flew = command is not None

    def _send(self, command: Command) -> None:
        if not self._teleop.send(command):
            rospy.logwarn_throttle(5, f"{_NAME}: {self._teleop.said}")

    # ---- where it comes from

    def _on_joy(self, message: Joy) -> None:
        if self._gamepad is None:
            self._messages.put(message)

    def _states(self, seconds: float) -> Iterable[JoyState]:
        """Wait so long at most; return how the gamepad stood after each thing that happened."""
        if self._gamepad is None:
            with contextlib.suppress(queue.Empty):
                message = self._messages.get(timeout=seconds)
                self._heard = time.monotonic()
                return [_pad(message)]
            return []
        select.select([self._gamepad], [], [], seconds)
        try:
            return list(self._gamepad.read())
        except OSError as error:
            self._lose(f"{self._gamepad.device}: {error.strerror or error}")
            self._gamepad.close()
            self._gamepad = None
            return []

    def _lose(self, why: str) -> None:
        said = ": the drone is stopped" if self._pilot.command is not None else ""
        rospy.logwarn(f"{_NAME}: {why}{said}")
        self._pilot.lose()

    def _watch_topic(self) -> None:
        """Treat the topic as a lost gamepad if it commands the drone and has fallen silent."""
        timeout = self._parameters.timeout
        if self._gamepad is not None or self._pilot.command is None:
            return
        silent = time.monotonic() - self._heard
        if not self._topic.get_num_connections():
            self._lose(f"{self._topic.resolved_name} has no publisher any more")
        elif timeout and silent > timeout:
            self._lose(
                f"no message on {self._topic.resolved_name} for {timeout:g} s (autorepeat_rate of the joy node?)"
            )

    def _look_for_gamepad(self) -> None:
        wanted = self._parameters.device
        if self._gamepad is not None or wanted == "none" or time.monotonic() - self._looked < _LOOKING:
            return
        self._looked = time.monotonic()
        devices = gamepad.found() if wanted == "auto" else [wanted]
        try:
            self._gamepad = Gamepad(devices[0])
        except (OSError, IndexError) as error:
            why = f"{devices[0]}: {error}" if devices else "there is no /dev/input/js*"
            missed = f"no gamepad found ({why}); listening on {self._topic.resolved_name}"
            if missed != self._missed:
                rospy.logwarn(f"{_NAME}: {missed}")
            self._missed = missed
            return
        self._missed = ""
        self._pilot.lose()
        rospy.loginfo(f"{_NAME}: {self._gamepad.name} on {self._gamepad.device}")


def _pad(message: Joy) -> JoyState:
    axes = (value if math.isfinite(value) else 0.0 for value in message.axes[:256])
    return JoyState(tuple(max(-1.0, min(1.0, value)) for value in axes), tuple(map(bool, message.buttons[:256])))


def _parameters() -> JoyParameters:
    given: dict[str, Any] = {key: value for key, value in rospy.get_param("~", {}).items() if key not in _OTHERS}
    if isinstance(given.get("config"), str):
        given["config"] = from_shell(given["config"])
    return load_joy(given)


def _fly(over: Callable[[], bool]) -> None:
    parameters, teleop = _parameters(), Teleop()
    try:
        JoyTeleop(parameters, teleop).run(over)
    finally:
        teleop.stop()
        rospy.loginfo(f"{_NAME}: {teleop.farewell}")


def main() -> int:
    """Run the node until a signal comes; return its exit status."""
    return run_tool(_NAME, _fly)
