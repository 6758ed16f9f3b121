"""Gamepads, the parameters of config/joy.yaml, and the commands for a gamepad's states. Needs no ROS.

Gamepads are read by Linux' joystick interface (joystick-api in the kernel's documentation), with the numbers and signs
of sensor_msgs/Joy: events of 8 bytes, of which the first ones give the initial state.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import glob
import math
import os
import re
import struct
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked, FileName, Finite, ParameterError, Within, merged, read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path, resolve
from drone_sim.message_text import shown
from drone_sim.ros.tools.commands import Command

_EVENT = struct.Struct("=IhBB")  # time (ms), value, kind, number
_BUTTON, _AXIS, _IS_INITIAL = 0x01, 0x02, 0x80
_AXIS_MAX = 32767.0  # at the end of an axis; down and right are positive
_READ_SIZE = 64 * _EVENT.size  # bytes
_NAME_SIZE = 128  # bytes
_GET_NAME = 0x80006A13 + (_NAME_SIZE << 16)  # JSIOCGNAME
_NEEDS_DEAD_MAN = ("takeoff",)
_Number = Annotated[int, Within(-1, 255)]


class JoyState(NamedTuple):
    """Positions of axes (-1 to 1; left and up are +1), and whether buttons are pressed."""

    axes: tuple[float, ...] = ()
    buttons: tuple[bool, ...] = ()

    def axis(self, number: int) -> float:
        """Return the position of an axis; 0 if there is no such axis."""
        return self.axes[number] if 0 <= number < len(self.axes) else 0.0

    def button(self, number: int) -> bool:
        """Return whether a button is pressed; False if there is no such button."""
        return self.buttons[number] if 0 <= number < len(self.buttons) else False


def list_devices() -> list[str]:
    """Return the device files of all gamepads, in the order of their numbers."""
    devices = [path for path in glob.glob("/dev/input/js*") if re.search(r"js[0-9]+$", path)]
    return sorted(devices, key=lambda path: int(path.partition("js")[2]))


class Gamepad:
    def __init__(self, device: str):
        """Open `device`, such as /dev/input/js0. Raises OSError."""
        self.device = device
        self._file = os.open(device, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        self._axes: list[float] = []
        self._buttons: list[bool] = []
        self._rest = b""
        buffer = bytearray(_NAME_SIZE)
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._file, _GET_NAME, buffer)
        name = buffer.split(b"\0")[0].decode(errors="replace")
        self.name = name if name.isprintable() and name else "gamepad"

    def fileno(self) -> int:
        """Return the file descriptor, for select()."""
        return self._file

    def close(self) -> None:
        os.close(self._file)

    def read(self) -> Iterator[JoyState]:
        """Yield the state after each new event. Raises OSError if the gamepad was unplugged."""
        try:
            received = os.read(self._file, _READ_SIZE)
        except BlockingIOError:
            return
        if not received:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV), self.device)
        data = self._rest + received
        whole = len(data) - len(data) % _EVENT.size
        self._rest = data[whole:]
        for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
            if kind & ~_IS_INITIAL == _AXIS:
                self._axes += [0.0] * (number + 1 - len(self._axes))
                self._axes[number] = min(1.0, -value / _AXIS_MAX)  # value may be -32768
            elif kind & ~_IS_INITIAL == _BUTTON:
                self._buttons += [False] * (number + 1 - len(self._buttons))
                self._buttons[number] = bool(value)
            yield JoyState(tuple(self._axes), tuple(self._buttons))


# ---- commands


class AxisParameters(Checked):
    """Number of an axis, and the velocity (m/s or rad/s) at its end."""

    axis: _Number
    scale: Annotated[Finite, Within(-20, 20)]


class AxesParameters(Checked):
    """Axes for the components of the velocity command."""

    vx: AxisParameters
    vy: AxisParameters
    vz: AxisParameters
    wz: AxisParameters


class ButtonParameters(Checked):
    """Numbers of the buttons for requests; -1 for no button."""

    takeoff: _Number
    land: _Number
    reset: _Number


class JoyParameters(Checked):
    device: FileName
    dead_man: Annotated[int, Within(0, 255)]
    axes: AxesParameters
    dead_zone: Annotated[Finite, Within(0, 0.9)]
    buttons: ButtonParameters
    rate: Annotated[Finite, Within(1, 100)]
    timeout: Annotated[Finite, Within(0.1, 1000, or_zero=True)]


def load_joy(given: Mapping[str, Any]) -> JoyParameters:
    """Return config/joy.yaml, overridden by the file under the key `config` of `given`, then by its other keys.

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
    """Commands of a gamepad. There is a command only while the dead man's button is pressed.

    After a gamepad was disconnected, this button must be released first: a gamepad that is connected again with the
    button pressed gives no command.
    """

    def __init__(self, parameters: JoyParameters):
        self._parameters = parameters
        self._buttons = {name: number for name, number in parameters.buttons if number >= 0}
        self.disconnect()
        self._is_armed = True

    def disconnect(self) -> None:
        """Release all buttons and axes, because the gamepad is gone."""
        self._state = JoyState()
        self._is_armed = False
        self._pressed: frozenset[str] | None = None  # None before the first state

    @property
    def command(self) -> Command | None:
        """The velocity command; None while the dead man's button is not pressed."""
        if not (self._is_armed and self._state.button(self._parameters.dead_man)):
            return None
        axes = self._parameters.axes
        return Command(*(self._velocity(axis) for axis in (axes.vx, axes.vy, axes.vz, axes.wz)))

    def update(self, state: JoyState) -> list[str]:
        """Store the gamepad's state; return the requests of newly pressed buttons, such as "takeoff"."""
        self._state = state
        if not state.button(self._parameters.dead_man):
            self._is_armed = True
        before = self._pressed
        self._pressed = frozenset(name for name, number in self._buttons.items() if state.button(number))
        new = self._pressed - before if before is not None else frozenset()
        is_flying = self.command is not None
        return sorted(name for name in new if is_flying or name not in _NEEDS_DEAD_MAN)

    def _velocity(self, parameters: AxisParameters) -> float:
        value, zone = self._state.axis(parameters.axis), self._parameters.dead_zone
        deflection = max(0.0, abs(value) - zone) / (1 - zone)
        return parameters.scale * math.copysign(min(1.0, deflection), value) + 0.0
