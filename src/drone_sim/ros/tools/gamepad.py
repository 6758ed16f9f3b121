"""A gamepad, as Linux' joystick interface has it; numbered and signed as in sensor_msgs/Joy. ROS is not needed.

The interface (joystick-api in the kernel's documentation): events of 8 bytes, the first of which tell how things stand.
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
_FULL = 32767.0  # an axis at its end; down and to the right are positive
_READ = 64 * _EVENT.size  # bytes at once
_NAME = 128  # bytes
_GET_NAME = 0x80006A13 + (_NAME << 16)  # JSIOCGNAME


class JoyState(NamedTuple):
    """How axes (-1 to 1, +1 to the left and up) and buttons stand."""

    axes: tuple[float, ...] = ()
    buttons: tuple[bool, ...] = ()

    def axis(self, number: int) -> float:
        """Return how an axis stands; 0 for one that the pad does not have."""
        return self.axes[number] if 0 <= number < len(self.axes) else 0.0

    def button(self, number: int) -> bool:
        """Return whether a button is pressed; one that the pad does not have is not."""
        return self.buttons[number] if 0 <= number < len(self.buttons) else False


def found() -> list[str]:
    """Return the devices of the gamepads that are plugged in, in the order of their numbers."""
    devices = glob.glob("/dev/input/js*")
    numbers = {int(one.partition("js")[2]): one for one in devices if re.search(r"js[0-9]+$", one)}
    return [numbers[number] for number in sorted(numbers)]


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
        told = bytearray(_NAME)
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._file, _GET_NAME, told)
        name = told.split(b"\0")[0].decode(errors="replace")
        return name if name.isprintable() and name else "gamepad"

    def fileno(self) -> int:
        """Return what select() waits for."""
        return self._file

    def close(self) -> None:
        """Close it."""
        os.close(self._file)

    def read(self) -> Iterator[JoyState]:
        """Yield how it stood after each event that has come. Raises OSError when it has been unplugged."""
        try:
            read = os.read(self._file, _READ)
        except BlockingIOError:
            return
        if not read:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV), self.device)
        data = self._rest + read
        whole = len(data) - len(data) % _EVENT.size
        self._rest = data[whole:]
        for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
            self._take(value, kind & ~_IS_INITIAL, number)
            yield JoyState(tuple(self._axes), tuple(self._buttons))

    def _take(self, value: int, kind: int, number: int) -> None:
        if kind == _AXIS:
            self._axes += [0.0] * (number + 1 - len(self._axes))
            self._axes[number] = min(1.0, -value / _FULL)  # -32768 is possible
        elif kind == _BUTTON:
            self._buttons += [False] * (number + 1 - len(self._buttons))
            self._buttons[number] = bool(value)
