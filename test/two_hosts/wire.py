"""A network between two hosts, made of two TUN interfaces, with adjustable delay and loss of packets.

The interfaces are removed when the process ends. See Documentation/networking/tuntap.rst of Linux.
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
    """A network link that may be cut, slow or lossy. It drops packets silently, like a lost WiFi connection."""

    def __init__(self, here: str, there: str, process: int):
        """Connect the address `here` with `there`, in the network namespace of a process. Raises OSError."""
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
            threading.Thread(target=self._forward_until_closed, args=(source, target), daemon=True).start()

    def _forward_until_closed(self, source: int, target: int) -> None:
        """Forward packets in one direction until one of the interfaces is closed."""
        with contextlib.suppress(OSError):
            self._forward(source, target)

    def _forward(self, source: int, target: int) -> None:
        in_transit: deque[tuple[float, bytes]] = deque()  # with their arrival times
        while True:
            timeout = max(in_transit[0][0] - time.monotonic(), 0.0) if in_transit else None
            if select.select([source], [], [], timeout)[0]:
                packet = os.read(source, _PACKET)
                if not self.cut and self._dice.random() >= self.loss:
                    in_transit.append((time.monotonic() + self.delay, packet))
            while in_transit and in_transit[0][0] <= time.monotonic():
                self._deliver(target, in_transit.popleft()[1])

    def _deliver(self, target: int, packet: bytes) -> None:
        if not self.cut:
            self.carried += os.write(target, packet)


def _end(name: str) -> int:
    """Create an interface; return the file descriptor that reads and writes its packets."""
    file = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(file, _TUNSETIFF, struct.pack("16sH22x", name.encode(), _IFF_TUN | _IFF_NO_PI))
    return file


def _address(interface: str, address: str, *where: str) -> None:
    _run(*where, "ip", "link", "set", "lo", "up")
    _run(*where, "ip", "address", "add", f"{address}/24", "dev", interface)
    _run(*where, "ip", "link", "set", interface, "up")


def _run(*command: str) -> None:
    subprocess.run(command, check=True)
