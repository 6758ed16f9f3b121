"""Pass by which the tabs of an earlier cockpit come back after a new start on the same port.

A tab has the key in its memory only, and never sends it: it signs a challenge. So a program of somebody else that
listens on the port in the meantime learns nothing that would let it in later; a cookie that stays valid would be sent
to that program.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import os
import secrets
import stat
from collections import deque
from pathlib import Path

import rospkg

from drone_sim.ros.cockpit.server.address import write_for_user_only

_BYTES = 32  # of a key
_MOST = 100  # challenges that are waiting for their answer; more visitors than that do not return at once


class ReturnPass:
    """Challenges for tabs that come back, and the check of their answers. Any thread may call it."""

    def __init__(self, key: bytes):
        """`key` is known to the tabs that were let in, and to the user's next cockpit on this port."""
        self._key = key
        self._challenges: deque[str] = deque(maxlen=_MOST)

    @property
    def key(self) -> str:
        """The key in hexadecimal digits, for a page that has been let in."""
        return self._key.hex()

    def challenge(self) -> str:
        """Return a new challenge."""
        self._challenges.append(secrets.token_hex(16))
        return self._challenges[-1]

    def is_signed(self, challenge: str, signature: str) -> bool:
        """Return whether a tab has signed one of our challenges with the key. Each challenge is good for one try."""
        try:
            self._challenges.remove(challenge)
        except ValueError:
            return False
        expected = hmac.new(self._key, challenge.encode(), hashlib.sha256).hexdigest()
        return hmac.compare_digest(expected.encode(), signature.encode(errors="backslashreplace"))


def key_of_port(port: int) -> bytes:
    """Return the key in `$ROS_HOME/drone_sim/cockpit_PORT.key`, which only the user can read; a new one is written.

    If the file cannot be written, or any port is taken (0), no tab returns after the next start.
    """
    if not port:
        return secrets.token_bytes(_BYTES)
    file = Path(rospkg.get_ros_home()) / "drone_sim" / f"cockpit_{port}.key"
    with contextlib.suppress(OSError, ValueError):
        return _read(file)
    key = secrets.token_bytes(_BYTES)
    with contextlib.suppress(OSError):
        write_for_user_only(file, key.hex())
    return key


def _read(file: Path) -> bytes:
    """Return the key in a file of the user's. Raises OSError, ValueError if others can read it or it is damaged."""
    descriptor = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, encoding="ascii") as opened:
        state = os.fstat(descriptor)
        if not stat.S_ISREG(state.st_mode) or state.st_uid != os.getuid() or state.st_mode & 0o077:
            raise ValueError(f"{file}: must be a file that only its owner can read")
        key = bytes.fromhex(opened.read(4 * _BYTES))
    if len(key) != _BYTES:
        raise ValueError(f"{file}: must have {_BYTES} bytes")
    return key
