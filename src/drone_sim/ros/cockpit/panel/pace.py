"""How fast the simulation is asked to go, and how fast it does."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rospy
from dynamic_reconfigure.encoding import decode_config, encode_config
from dynamic_reconfigure.msg import Config
from dynamic_reconfigure.srv import Reconfigure

from drone_sim.ros.cockpit.simulator import FAILURES

_FACTOR = "real_time_factor"
_CHOICES = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)


class Pace:
    """A choice of real-time factors, which follows those that others set, and the factor that is reached."""

    def __init__(self, gui: Any, node: str, say: Callable[[str], None]):
        """Draw them; `say` shows a line to the user."""
        self._node, self._say = node, say
        self._lock = threading.Lock()
        self._factors = {_words(one): one for one in _CHOICES}
        words, hint = tuple(self._factors), "The real-time factor"
        self._field = gui.add_dropdown("Speed", words, initial_value=_words(1.0), hint=hint)
        self._field.on_update(self._on_field)
        self._reached = gui.add_text("Reached", "", disabled=True, hint="The real-time factor of the last second")

    def hear(self, message: Config) -> None:
        """Show the factor in force."""
        factor = decode_config(message).get(_FACTOR)
        if not isinstance(factor, float):
            return
        words = _words(factor)
        with self._lock:
            if words not in self._factors:
                self._factors = {**{_words(one): one for one in _CHOICES}, words: factor}
                self._field.options = tuple(self._factors)
            self._field.value = words

    def show_reached(self, factor: str) -> None:
        """Show the factor that diagnostics speak of."""
        try:
            self._reached.value = f"{float(factor):g} times real time"
        except ValueError:
            self._reached.value = ""

    def _on_field(self, event: Any) -> None:
        if event.client is None:  # this node has shown what holds
            return
        factor = self._factors[event.target.value]
        threading.Thread(target=lambda: self._set(factor), daemon=True).start()

    def _set(self, factor: float) -> None:
        try:
            answer = rospy.ServiceProxy(f"{self._node}/set_parameters", Reconfigure)(encode_config({_FACTOR: factor}))
        except FAILURES as error:
            self._say(f"speed: {' '.join(str(error).split())}")
            return
        self.hear(answer.config)
        self._say(f"speed: {_words(factor)}")


def _words(factor: float) -> str:
    """Return what a person calls a real-time factor."""
    if not factor:
        return "as fast as it can"
    return "real time" if factor == 1.0 else f"{factor:g} times real time"
