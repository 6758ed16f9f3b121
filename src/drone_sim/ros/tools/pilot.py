"""From how a gamepad stands to what the drone is told. Neither a gamepad nor ROS is needed."""

from __future__ import annotations

import math

from drone_sim.ros.tools.commands import Command
from drone_sim.ros.tools.gamepad import Pad
from drone_sim.ros.tools.joy_parameters import AxisParameters, JoyParameters

_NEEDS_DEAD_MAN = ("takeoff",)


class Pilot:
    """Who holds a gamepad. The drone obeys only while the dead-man's button is held.

    After a gamepad was lost, that must be released first: one that comes back with it pressed commands nothing.
    """

    def __init__(self, parameters: JoyParameters):
        """Begin without a gamepad."""
        self._parameters = parameters
        self._buttons = {name: number for name, number in parameters.buttons if number >= 0}
        self.lose()
        self._armed = True

    def lose(self) -> None:
        """Have no gamepad any more."""
        self._pad = Pad()
        self._armed = False
        self._pressed: frozenset[str] | None = None  # None before the first look

    @property
    def command(self) -> Command | None:
        """What the drone is to do; None while the dead-man's button is not held."""
        if not (self._armed and self._pad.button(self._parameters.dead_man)):
            return None
        axes = self._parameters.axes
        return Command(*(self._speed(one) for one in (axes.vx, axes.vy, axes.vz, axes.wz)))

    def see(self, pad: Pad) -> list[str]:
        """Take how the pad stands now; return what the buttons ask for that have been pressed since: takeoff, ..."""
        self._pad = pad
        if not pad.button(self._parameters.dead_man):
            self._armed = True
        before = self._pressed
        self._pressed = frozenset(name for name, number in self._buttons.items() if pad.button(number))
        news = self._pressed - before if before is not None else frozenset()
        allowed = self.command is not None
        return sorted(name for name in news if allowed or name not in _NEEDS_DEAD_MAN)

    def _speed(self, wanted: AxisParameters) -> float:
        value, zone = self._pad.axis(wanted.axis), self._parameters.dead_zone
        beyond = max(0.0, abs(value) - zone) / (1 - zone)
        return wanted.scale * math.copysign(min(1.0, beyond), value) + 0.0
