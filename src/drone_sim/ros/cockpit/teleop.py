"""Commands of the browsers' keys, sticks and gamepads to one vehicle."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Empty

from drone_sim.ros.core.message_conversion import twist
from drone_sim.ros.tools.commands import Command

_SILENCE = 1.5  # s without a message from a browser, after which its keys are released
_FASTEST = 20.0  # m/s, rad/s; the page requests less
REQUESTS = ("takeoff", "land", "home", "reset")


class HeldCommands:
    """Commands of held keys: of all browsers' commands, the one that changed last counts. Thread-safe."""

    def __init__(self, send: Callable[[Command], None], clock: Callable[[], float] = time.monotonic):
        """`send` sends a command to the vehicle; `clock` must be monotonic (s)."""
        self._send = send
        self._clock = clock
        self._lock = threading.Lock()
        self._held: dict[int, tuple[Command, float]] = {}  # command and time of the last message, by browser
        self._sent = Command()

    def hold(self, browser: int, command: Command) -> None:
        """Set a browser's command; the browser repeats it while its keys are held."""
        with self._lock:
            before = self._held.pop(browser, (Command(), 0.0))[0]
            if command != Command():
                self._held[browser] = command, self._clock()
            if command != before:
                self._send_latest()

    def release(self, browser: int) -> None:
        """Release the keys of a browser that has closed its connection."""
        self.hold(browser, Command())

    def repeat(self) -> None:
        """Send the present command again, and release the keys of browsers that have been silent for _SILENCE.

        Must be called every 0.1 s while a browser is connected.
        """
        with self._lock:
            now = self._clock()
            silent = [browser for browser, (_, at) in self._held.items() if now - at > _SILENCE]
            for browser in silent:
                del self._held[browser]
            if self._held or silent:
                self._send_latest()

    def _send_latest(self) -> None:
        command = next(reversed(self._held.values()))[0] if self._held else Command()
        if command != Command() or self._sent != Command():
            self._sent = command
            self._send(command)


def read_command(given: Any) -> Command:
    """Return the command in a browser's message: vx, vy, vz (m/s), wz (rad/s). Raises ValueError."""
    if not isinstance(given, Mapping) or not set(given) <= set(Command._fields):
        raise ValueError(f"hold: must be a mapping of {', '.join(Command._fields)}")
    for name, value in given.items():
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not abs(value) <= _FASTEST:
            raise ValueError(f"hold/{name}: must be a number from -{_FASTEST:g} to {_FASTEST:g}")
    return Command(**{name: float(value) for name, value in given.items()})


class CommandPublisher:
    """Publishes to the chosen vehicle. `choose` advertises early, because subscribers need a moment to connect."""

    def __init__(self, patience: float = 1.0) -> None:
        """Begin without a vehicle.

        `request` waits for a subscriber for at most `patience` (s). It must be below _SILENCE: a browser's keys wait
        behind its requests, and would be released.
        """
        self.vehicle = ""
        self._patience = patience
        self._lock = threading.Lock()  # otherwise a thread may publish with an unregistered publisher
        self._command: rospy.Publisher | None = None
        self._requests: dict[str, rospy.Publisher] = {}

    def choose(self, vehicle: str) -> None:
        """Send commands to another vehicle from now on, '' for none; the last one is stopped."""
        if vehicle == self.vehicle:
            return
        self.send(Command())
        with self._lock:
            old = (self._command, *self._requests.values())
            self.vehicle, self._command, self._requests = vehicle, None, {}
        for publisher in filter(None, old):
            publisher.unregister()
        if vehicle:
            self._command = rospy.Publisher(f"/{vehicle}/cmd_vel", Twist, queue_size=1)
            self._requests = {topic: rospy.Publisher(f"/{vehicle}/{topic}", Empty, queue_size=1) for topic in REQUESTS}

    def send(self, command: Command) -> None:
        """Send a command, m/s and rad/s in the frame Track_base."""
        with self._lock:
            if self._command is not None:
                self._command.publish(twist(command[:3], (0.0, 0.0, command.wz)))

    def request(self, topic: str) -> str:
        """Publish one of `REQUESTS`; return one line for the user. Raises ValueError without a subscriber."""
        until = time.monotonic() + self._patience
        while (publisher := self._requests.get(topic)) is None or not publisher.get_num_connections():
            if time.monotonic() >= until:
                raise ValueError(f"no subscriber on {topic}")
            time.sleep(0.05)
        publisher.publish(Empty())
        return f"{topic} sent to {self.vehicle}"
