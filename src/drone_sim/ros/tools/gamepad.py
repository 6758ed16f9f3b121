"""Gamepads by Linux' joystick interface, with the numbers and signs of sensor_msgs/Joy. ROS is not needed.

The interface (joystick-api in the kernel's documentation) has events of 8 bytes; the first ones give the initial state.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import glob
import os
import re
import struct
from collections.abc import Iterator
from typing import NamedTuple

_EVENT = struct.Struct("=IhBB")  # time (ms), value, kind, number
_BUTTON, _AXIS, _IS_INITIAL = 0x01, 0x02, 0x80
_AXIS_MAX = 32767.0  # at the end of an axis; down and right are positive
_READ_SIZE = 64 * _EVENT.size  # bytes
_NAME_SIZE = 128  # bytes
_GET_NAME = 0x80006A13 + (_NAME_SIZE << 16)  # JSIOCGNAME


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
    """An open gamepad."""

    def __init__(self, device: str):
        """Open `device`, such as /dev/input/js0. Raises OSError."""
        self.device = device
        self._file = os.open(device, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        self._axes: list[float] = []
        self._buttons: list[bool] = []
        self._rest = b""
        self.name = self._read_name()

    def _read_name(self) -> str:
        buffer = bytearray(_NAME_SIZE)
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._file, _GET_NAME, buffer)
        name = buffer.split(b"\0")[0].decode(errors="replace")
        return name if name.isprintable() and name else "gamepad"

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
            self._update(value, kind & ~_IS_INITIAL, number)
            yield JoyState(tuple(self._axes), tuple(self._buttons))

    def _update(self, value: int, kind: int, number: int) -> None:
        if kind == _AXIS:
            self._axes += [0.0] * (number + 1 - len(self._axes))
            self._axes[number] = min(1.0, -value / _AXIS_MAX)  # value may be -32768
        elif kind == _BUTTON:
            self._buttons += [False] * (number + 1 - len(self._buttons))
            self._buttons[number] = bool(value)
