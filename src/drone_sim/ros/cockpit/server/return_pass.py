"""Pass by which the tabs of an earlier cockpit come back after a new start on the same port.

A tab has the key in its memory only, and never sends it: it signs a challenge. So another user's program that listens
on the port in the meantime learns nothing that it could use later; a program that answers at that very moment could
pass the challenge on. Each key is good for the next start only, so that a second start revokes it.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import ipaddress
import os
import secrets
import stat
import time
from pathlib import Path

import rospkg
from websockets.asyncio.server import ServerConnection

from drone_sim.ros.cockpit.server.address import write_for_user_only

_BYTES = 32  # of a key
_VALID = 30  # s, for a challenge


class ReturnPass:
    """Challenges for tabs that come back, and the check of their answers. Only the server's event loop calls it.

    A challenge is `time.nonce.mac`, with the time in s and a MAC of this process. It is stored only after it was signed
    correctly, so visitors without the key cannot invalidate the challenges of others.
    """

    def __init__(self, accept: bytes | None, give: bytes):
        """`accept` is the key of tabs that the port's last cockpit let in, if any; `give` is for tabs let in now."""
        self._accept, self._give = accept, give
        self._secret = secrets.token_bytes(_BYTES)
        self._spent: dict[str, float] = {}  # correctly signed challenges, with the time (s) at which each expires

    @property
    def key(self) -> str:
        """The key in hexadecimal digits, for a page that has been let in."""
        return self._give.hex()

    def challenge(self) -> str:
        content = f"{int(time.monotonic())}.{secrets.token_hex(16)}"
        return f"{content}.{_mac(self._secret, content)}"

    def is_signed(self, challenge: str, signature: str) -> bool:
        """Return whether a tab has signed one of our valid challenges; each is accepted only once."""
        if self._accept is None or not _is_equal(_mac(self._accept, challenge), signature):
            return False
        content, _, mac = challenge.rpartition(".")
        if not _is_equal(_mac(self._secret, content), mac):
            return False
        now, expires = time.monotonic(), int(content.partition(".")[0]) + _VALID
        self._spent = {spent: end for spent, end in self._spent.items() if end >= now}
        if expires < now or challenge in self._spent:
            return False
        self._spent[challenge] = expires
        return True


def _mac(key: bytes, text: str) -> str:
    return hmac.new(key, text.encode(errors="backslashreplace"), hashlib.sha256).hexdigest()


def _is_equal(mac: str, other: str) -> bool:
    return hmac.compare_digest(mac.encode(errors="backslashreplace"), other.encode(errors="backslashreplace"))


def is_local(connection: ServerConnection) -> bool:
    """Return whether a client is on this machine (or comes through SSH); others would get the key unencrypted."""
    if connection.remote_address is None:  # it has disconnected
        return False
    address = ipaddress.ip_address(connection.remote_address[0])
    return bool((getattr(address, "ipv4_mapped", None) or address).is_loopback)


def new_pass(port: int) -> ReturnPass | None:
    """Return the pass of a cockpit that has just bound `port`, and replace the key in `$ROS_HOME/drone_sim`.

    The file `cockpit_PORT.key`, which only the user can read, holds the key for the next start. Return None if it
    cannot be replaced: then no tab comes back, because the old key would stay valid.
    """
    file = Path(rospkg.get_ros_home()) / "drone_sim" / f"cockpit_{port}.key"
    accept, give = None, secrets.token_bytes(_BYTES)
    with contextlib.suppress(OSError, ValueError):
        accept = _read(file)
    try:
        write_for_user_only(file, give.hex())
    except OSError:
        return None
    return ReturnPass(accept, give)


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
