"""A network between two hosts, made of two TUN interfaces; what goes in at one comes out at the other, or does not.

All of it goes with the process: no interface is left behind. See Documentation/networking/tuntap.rst of Linux.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import random
import select
import struct
import subprocess
import threading
import time
from collections import deque

_TUNSETIFF = 0x400454CA
_IFF_TUN, _IFF_NO_PI = 0x0001, 0x1000
_PACKET = 2048  # bytes; more than an interface's MTU, 1500


class Wire:
    """A wire that may be cut, slow or bad. It drops packets without a word, as a lost WiFi does."""

    def __init__(self, here: str, there: str, process: int):
        """Lead from the address `here` to `there`, in the network namespace of a process. Raises OSError."""
        self.cut = False
        self.delay = 0.0  # s, each way
        self.loss = 0.0  # share of the packets, 0..1
        self.carried = 0  # bytes, both ways
        self._dice = random.Random(0)
        ends = _end("wire0"), _end("wire1")
        _run("ip", "link", "set", "wire1", "netns", str(process))
        _address("wire0", here)
        _address("wire1", there, "nsenter", "--net", "--target", str(process))
        for source, target in (ends, ends[::-1]):
            threading.Thread(target=self._carry, args=(source, target), daemon=True).start()

    def _carry(self, source: int, target: int) -> None:
        """Carry one way, until one of the ends has gone."""
        with contextlib.suppress(OSError):
            self._carry_on(source, target)

    def _carry_on(self, source: int, target: int) -> None:
        under_way: deque[tuple[float, bytes]] = deque()  # with when they arrive
        while True:
            left = max(under_way[0][0] - time.monotonic(), 0.0) if under_way else None
            if select.select([source], [], [], left)[0]:
                packet = os.read(source, _PACKET)
                if not self.cut and self._dice.random() >= self.loss:
                    under_way.append((time.monotonic() + self.delay, packet))
            while under_way and under_way[0][0] <= time.monotonic():
                self._deliver(target, under_way.popleft()[1])

    def _deliver(self, target: int, packet: bytes) -> None:
        if not self.cut:
            self.carried += os.write(target, packet)


def _end(name: str) -> int:
    """Make an interface, and return the file of what comes in and goes out there."""
    file = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(file, _TUNSETIFF, struct.pack("16sH22x", name.encode(), _IFF_TUN | _IFF_NO_PI))
    return file


def _address(interface: str, address: str, *where: str) -> None:
    _run(*where, "ip", "link", "set", "lo", "up")
    _run(*where, "ip", "address", "add", f"{address}/24", "dev", interface)
    _run(*where, "ip", "link", "set", interface, "up")


def _run(*command: str) -> None:
    subprocess.run(command, check=True)
