"""config/joy.yaml, and how a gamepad's state becomes a command to the drone. Neither a gamepad nor ROS is needed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked, FileName, Finite, ParameterError, Within, merged, read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path, resolve
from drone_sim.message_text import shown
from drone_sim.ros.tools.commands import Command
from drone_sim.ros.tools.gamepad import JoyState

_NEEDS_DEAD_MAN = ("takeoff",)
_Number = Annotated[int, Within(-1, 255)]


class AxisParameters(Checked):
    """Which axis, and the speed (m/s or rad/s) at its end."""

    axis: _Number
    scale: Annotated[Finite, Within(-20, 20)]


class AxesParameters(Checked):
    """What the axes command."""

    vx: AxisParameters
    vy: AxisParameters
    vz: AxisParameters
    wz: AxisParameters


class ButtonParameters(Checked):
    """Which buttons ask for what."""

    takeoff: _Number
    land: _Number
    reset: _Number


class JoyParameters(Checked):
    """Everything in config/joy.yaml."""

    device: FileName
    dead_man: Annotated[int, Within(0, 255)]
    axes: AxesParameters
    dead_zone: Annotated[Finite, Within(0, 0.9)]
    buttons: ButtonParameters
    rate: Annotated[Finite, Within(1, 100)]
    timeout: Annotated[Finite, Within(0.1, 1000, or_zero=True)]


def load_joy(given: Mapping[str, Any]) -> JoyParameters:
    """Return config/joy.yaml with the file under the key `config`, and the other keys, laid over it.

    Raises ParameterError.
    """
    file = given.get("config", "")
    if not isinstance(file, str):
        raise ParameterError("must be the name of a file", ("config",), shown(file))
    values = read_yaml(package_path() / "config" / "joy.yaml")
    lines: yaml_files.YamlLines | None = None
    if file:
        try:
            path = resolve(file)
        except FileNotFoundError as error:
            raise ParameterError(str(error), ("config",), shown(file)) from None
        values, lines = merged(values, read_yaml(path)), yaml_files.lines(path)
    values = merged(values, {key: value for key, value in given.items() if key != "config"})
    return checked(JoyParameters, values, lines, file)


class JoyCommands:
    """The commands of a gamepad. The drone obeys only while the dead-man's button is held.

    After a gamepad was lost, this button must be released first: a gamepad that comes back with it pressed commands
    nothing.
    """

    def __init__(self, parameters: JoyParameters):
        """Take the parameters of joy.yaml; begin without a gamepad."""
        self._parameters = parameters
        self._buttons = {name: number for name, number in parameters.buttons if number >= 0}
        self.lose()
        self._armed = True

    def lose(self) -> None:
        """Have no gamepad any more."""
        self._pad = JoyState()
        self._armed = False
        self._pressed: frozenset[str] | None = None  # None before the first look

    @property
    def command(self) -> Command | None:
        """What the drone is to do; None while the dead-man's button is not held."""
        if not (self._armed and self._pad.button(self._parameters.dead_man)):
            return None
        axes = self._parameters.axes
        return Command(*(self._speed(one) for one in (axes.vx, axes.vy, axes.vz, axes.wz)))

    def see(self, pad: JoyState) -> list[str]:
        """Take the gamepad's present state; return what newly pressed buttons ask for: takeoff, ..."""
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
