"""What a vehicle is told on cmd_vel: obeyed at once, or when it comes over a slow link; held, for so long."""

from __future__ import annotations

from collections.abc import Callable

from drone_sim.mechanics.state import Twist
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.vehicles.link import Link


class Commands:
    """The command of one vehicle, which its scripts hear."""

    def __init__(self, bus: MessageBus, timeout: float, time_step: float, time: Callable[[], float]):
        """Take the bus of its script, cmd_vel_timeout (s; 0 for ever) and the step (s); `time` returns s."""
        self._bus = bus
        self.timeout, self._time_step = timeout, time_step
        self._time = time
        self.listening: list[MessageBus] = []  # of scripts on its parts
        self.link: Link[Twist] | None = None  # over which commands come; None for at once
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
            self.link.send(self._time(), twist)

    def take(self) -> None:
        """Obey what has come over the link."""
        came = self.link and self.link.receive(self._time())
        if came:
            self._obey(came[1])

    def advance(self) -> None:
        """Grow a step older; one that is too old gives way to standing still."""
        if self.timeout and self.age > self.timeout - self._time_step / 2 and self.now != Twist():
            self._obey(Twist())
        self.age += self._time_step

    def _obey(self, twist: Twist) -> None:
        self.now, self.age = twist, 0.0
        for bus in self.buses:
            bus.post("cmd_vel", twist)

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back the command; what is under way is brought back by the faults."""
        now, age, timeout = self.now, self.age, self.timeout

        def recall() -> None:
            self.now, self.age, self.timeout = now, age, timeout

        return recall
