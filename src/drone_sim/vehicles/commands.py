"""What a vehicle is told and asked, in the fields of the messages that do so, and what its script says of its state."""

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
    """The command of one vehicle, which its scripts hear."""

    def __init__(self, bus: MessageBus, timeout: float, clock: Clock):
        """Take the bus of its script, cmd_vel_timeout (s; 0 for ever) and the simulation's clock."""
        self._bus = bus
        self.timeout = timeout
        self._clock = clock
        self.listening: list[MessageBus] = []  # of scripts on its parts
        self.link: RadioLink[Twist] | None = None  # over which commands come; None for at once
        self.begin()

    def begin(self) -> None:
        """Have no command, as at the start of a run."""
        self.now = Twist()
        self.age = 0.0  # s

    @property
    def buses(self) -> tuple[MessageBus, ...]:
        """Those of its script, and of scripts on its parts."""
        return self._bus, *self.listening

    def receive(self, twist: Twist) -> None:
        """Take a command for the next step, or for when it comes over the link."""
        if self.link is None:
            self._obey(twist)
        else:
            self.link.send(self._clock.time, twist)

    def take(self) -> None:
        """Obey what has come over the link."""
        came = self.link and self.link.receive(self._clock.time)
        if came:
            self._obey(came[1])

    def advance(self) -> None:
        """Make the command a step older; one that is too old is replaced by a zero command."""
        if self._is_over:
            self._obey(Twist())
        self.age += self._clock.time_step

    @property
    def _is_over(self) -> bool:
        too_old = self.timeout and self.age > self.timeout - self._clock.time_step / 2
        return bool(too_old and self.now != Twist())

    @property
    def is_quiet(self) -> bool:
        """Whether no script will get the command at the beginning of the next step, unless a new one is received."""
        return self.link is None and not self._is_over

    def _obey(self, twist: Twist) -> None:
        self.now, self.age = twist, 0.0
        for bus in self.buses:
            bus.post("cmd_vel", twist)

    def save_state(self) -> Restore:
        """Return a function that brings back the command; what is under way is brought back by the faults."""
        return saved(self, "now", "age", "timeout")


EMPTY, POSE = "std_msgs/Empty", "geometry_msgs/PoseStamped"
RESET = "reset"
REQUESTS = {RESET: EMPTY, "takeoff": EMPTY, "land": EMPTY, "home": EMPTY, "goto": POSE}  # topics, and their types


class Empty(NamedTuple):
    """std_msgs/Empty."""


class Quaternion(NamedTuple):
    """geometry_msgs/Quaternion."""

    x: float
    y: float
    z: float
    w: float


class PoseFields(NamedTuple):
    """geometry_msgs/Pose: m, and a unit quaternion."""

    position: Vector3
    orientation: Quaternion


class PoseStamped(NamedTuple):
    """geometry_msgs/PoseStamped, in the frame world, without its header."""

    pose: PoseFields


def request(pose: Pose | None = None) -> Any:
    """Return the message that a script gets: of a pose (world), or an empty one."""
    if pose is None:
        return Empty()
    return PoseStamped(PoseFields(Vector3(*pose.position), Quaternion(*pose.orientation)))


_LOG = logging.getLogger(__name__)

UNKNOWN = "unknown"
LANDED, CRASHED = "landed", "crashed"  # in which no command moves it
_TOPIC = "state"


class FlightState:
    """Hands requests to the scripts of a vehicle that offer to answer them."""

    def __init__(self, commands: Commands):
        """Take what knows the buses of its scripts."""
        self._commands = commands
        self.begin()

    def begin(self) -> None:
        """Forget which requests no script answered: another script may be there."""
        self.is_flown = False  # by a child script, which is loaded
        # For each script of the vehicle that may have failed: returns its error, or None while it is called.
        self.script_errors: list[Callable[[], ScriptError | None]] = []
        self._missing = ""
        self._told: set[str] = set()  # topics that had no effect

    @property
    def script_error(self) -> ScriptError | None:
        """The error of a script of the vehicle that has failed and is not called any more; None if there is none."""
        return next((error for one in self.script_errors if (error := one()) is not None), None)

    def __str__(self) -> str:
        """Return the state, as a script says it; `unknown` where none does."""
        for bus in self._commands.buses:
            said = bus.said and bus.said.get(bus.resolve(_TOPIC))
            if said:
                return str(said.get("data", said) if isinstance(said, dict) else said)
        return self._missing or UNKNOWN

    def ask(self, topic: str, message: Any, before: Callable[[], None] = lambda: None) -> None:
        """Call `before`, and leave the message for the next step; where no script listens, say so instead.

        So it is while the simulation is stopped, and has no script. It is said once for each topic and script.
        """
        if not self.is_flown:
            self._tell(topic, "the simulation is stopped; `start` it first")
            return
        hearing = [bus for bus in self._commands.buses if bus.hears(topic)]
        if hearing:
            before()
        else:
            self._missing = self._missing or f"{UNKNOWN}: the script does not subscribe to {topic}"
            self._tell(topic, "the child script does not subscribe to this topic; `pilot` does")
        for bus in hearing:
            bus.post(topic, message)

    def _tell(self, topic: str, why: str) -> None:
        if topic not in self._told:
            self._told.add(topic)
            _LOG.warning("%s: no effect: %s", topic, why)
