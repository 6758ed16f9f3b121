"""What scripts publish, kept without ROS: the last message on every topic that is asked for."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from drone_sim.scripting.api.backend import Ask


class Topics:
    """A backend (scripting.api.backend) with nobody at its other end."""

    def __init__(self, wanted: Mapping[str, str]):
        """Take the topics that are to be kept: the full name of each as a plan calls it."""
        self.wanted = wanted
        self.last: dict[str, Any] = {}  # the last message, by the topic's full name
        self.clock: Callable[[], float] = lambda: 0.0  # simulated time in s
        self._parameters: dict[str, Any] = {}

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Do nothing: no message comes."""
        return lambda: None

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> Kept:
        """Keep what will be published, if it is asked for."""
        return Kept(self.last if topic in self.wanted.values() else {}, topic)

    def advertise_image(self, topic: str, queue: int) -> Kept:
        """Keep nothing: a picture is no figure."""
        return Kept({}, topic)

    def time(self) -> float:
        """Return what messages are stamped with, in s."""
        return self.clock()

    def send_transforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Do nothing."""

    def parameter(self, name: str) -> Any:
        """Return a parameter that a script has set."""
        return self._parameters.get(name)

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter."""
        self._parameters[name] = value

    def delete_parameter(self, name: str) -> None:
        """Forget a parameter."""
        self._parameters.pop(name, None)

    def serve(self, name: str, kind: str, ask: Ask) -> Callable[[], None]:
        """Do nothing: nobody calls."""
        return lambda: None

    def call_service(self, name: str, kind: str, request: Any) -> Any:
        """Raise ValueError: there is no service."""
        raise ValueError(f"no service {name}: this flight is flown without ROS")


class Kept:
    """An advertised topic."""

    def __init__(self, last: dict[str, Any], topic: str):
        """Take where the last message is left, and its topic."""
        self._last, self._topic = last, topic

    def publish(self, message: Any) -> None:
        """Keep a message as it is now."""
        self._last[self._topic] = copy.deepcopy(message)

    def subscribers(self) -> int:
        """Return how many listen: whoever grades."""
        return 1

    def shutdown(self) -> None:
        """Keep what was said."""
