"""Velocity commands and requests to a vehicle, their message types, and the flight state its script reports."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, NamedTuple

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.errors import ScriptError
from drone_sim.vehicles.radio_link import RadioLink


class Commands:
    """The current velocity command of one vehicle, posted to its scripts as `cmd_vel`."""

    def __init__(self, bus: MessageBus, timeout: float, clock: Clock):
        """Create it for the child script's bus; `timeout` is cmd_vel_timeout (s; 0: none)."""
        self.timeout = timeout
        self._clock = clock
        self.buses = [bus]  # of the child script, then of scripts on the vehicle's parts
        self.link: RadioLink[Twist] | None = None  # that delays commands; None: no delay
        self.begin()

    def begin(self) -> None:
        self.now = Twist()
        self.age = 0.0  # s

    def receive(self, twist: Twist) -> None:
        """Post a command to the scripts for the next step, or send it over the radio link if there is one."""
        if self.link is None:
            self._post(twist)
        else:
            self.link.send(self._clock.time, twist)

    def take(self) -> None:
        """Post the newest command that has arrived over the radio link, if there is one."""
        arrived = self.link and self.link.receive(self._clock.time)
        if arrived:
            self._post(arrived[1])

    def advance(self) -> None:
        """Age the command by one step; replace it by a zero command after the timeout."""
        too_old = self.timeout and self.age > self.timeout - self._clock.time_step / 2
        if too_old and self.now != Twist():
            self._post(Twist())
        self.age += self._clock.time_step

    def _post(self, twist: Twist) -> None:
        self.now, self.age = twist, 0.0
        for bus in self.buses:
            bus.post("cmd_vel", twist)

    def save_state(self) -> Restore:
        """Return a function that restores the command; Faults restores the commands on the radio link."""
        return saved(self, "now", "age", "timeout")


EMPTY, POSE = "std_msgs/Empty", "geometry_msgs/PoseStamped"
RESET = "reset"
REQUESTS = {  # topic -> message type
    **dict.fromkeys((RESET, "takeoff", "land", "emergency", "home"), EMPTY),
    "goto": POSE,
}


class Empty(NamedTuple):
    """std_msgs/Empty."""


class Quaternion(NamedTuple):
    """geometry_msgs/Quaternion."""

    x: float
    y: float
    z: float
    w: float


class PoseFields(NamedTuple):
    """geometry_msgs/Pose: position in m, orientation as a unit quaternion."""

    position: Vector3
    orientation: Quaternion


class PoseStamped(NamedTuple):
    """geometry_msgs/PoseStamped, in the frame world, without its header."""

    pose: PoseFields


def request(pose: Pose | None = None) -> Any:
    """Return the request message for a script: a PoseStamped of `pose` (world), or Empty."""
    if pose is None:
        return Empty()
    return PoseStamped(PoseFields(Vector3(*pose.position), Quaternion(*pose.orientation)))


_LOG = logging.getLogger(__name__)

UNKNOWN = "unknown"
LANDED, CRASHED = "landed", "crashed"  # states in which commands have no effect
_TOPIC = "state"


class FlightState:
    """Forwards requests to the scripts of a vehicle that subscribe to them, and reads the state they publish."""

    def __init__(self, commands: Commands):
        """Create it; `commands` lists the buses of the vehicle's scripts."""
        self._commands = commands
        self.begin()

    def begin(self) -> None:
        """Forget the scripts of the last run, and which requests had no effect."""
        self.is_flown = False  # whether a child script is loaded
        # one function for each script that may fail: returns its error, or None while it runs
        self.script_errors: list[Callable[[], ScriptError | None]] = []
        self._missing = ""
        self._warned: set[str] = set()  # topics that had no effect

    @property
    def script_error(self) -> ScriptError | None:
        """The error of the first script of the vehicle that failed and is no longer called; None if there is none."""
        return next((error for get_error in self.script_errors if (error := get_error()) is not None), None)

    def __str__(self) -> str:
        """Return the state that a script publishes, or `unknown`."""
        for bus in self._commands.buses:
            message = bus.own_messages and bus.own_messages.get(bus.resolve(_TOPIC))
            if message:
                return str(message.get("data", message) if isinstance(message, dict) else message)
        return self._missing or UNKNOWN

    def ask(self, topic: str, message: Any, prepare: Callable[[], None] = lambda: None) -> None:
        """Call `prepare` and post the message for the next step.

        If no script subscribes to the topic or the simulation is stopped, only log a warning, once per topic and run.
        """
        if not self.is_flown:
            self._warn_once(topic, "the simulation is stopped; `start` it first")
            return
        subscribed = [bus for bus in self._commands.buses if bus.hears(topic)]
        if subscribed:
            prepare()
        else:
            self._missing = self._missing or f"{UNKNOWN}: the script does not subscribe to {topic}"
            self._warn_once(topic, "the child script does not subscribe to this topic; `pilot` does")
        for bus in subscribed:
            bus.post(topic, message)

    def _warn_once(self, topic: str, why: str) -> None:
        if topic not in self._warned:
            self._warned.add(topic)
            _LOG.warning("%s: no effect: %s", topic, why)
