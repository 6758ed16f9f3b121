"""Check of the cockpit's address and port, the cockpit's URLs, and the file and terminal in which users find them."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import rospkg

_MAX_PORT = 65535
_MAX_TRIES = 100  # ports, from the requested one on
_LOOPBACK_OF_ALL = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # by addresses that mean all interfaces
_REMOTE_EXAMPLES = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}  # addresses reserved for documentation


class AddressError(ValueError):
    """The cockpit cannot listen at the requested address and port; the message has one line."""


def free_place(address: Any, port: Any) -> tuple[str, int]:
    """Return the numeric form of `address`, and the first free port from `port` on; port 0 means any free port.

    Raises AddressError.
    """
    if not isinstance(port, int) or isinstance(port, bool) or not 0 <= port <= _MAX_PORT:
        raise AddressError(f"port = {str(port)[:80]}: must be a whole number from 0 to {_MAX_PORT}, such as 8080")
    family, host = _resolve(address)
    last = min(port + _MAX_TRIES - 1, _MAX_PORT)
    for candidate in range(port, last + 1):
        if _is_free(family, host, candidate):
            return host, candidate
    raise AddressError(f"port = {port}: all ports from {port} to {last} are in use at {host}")


def _resolve(address: Any) -> tuple[socket.AddressFamily, str]:
    """Return the family and the numeric form of an address, IPv4 if it has both. Raises AddressError."""
    wrong = AddressError(
        f"address = {str(address)[:80]!r}: is not an address of this machine; use 127.0.0.1 for this machine only, "
        "or 0.0.0.0 to let other machines in"
    )
    if not isinstance(address, str) or not address:
        raise wrong
    try:
        resolved = socket.getaddrinfo(address, None, type=socket.SOCK_STREAM)
        family, _, _, _, (host, *_) = min(resolved, key=lambda info: info[0] != socket.AF_INET)
        _is_free(family, str(host), 0)
    except (OSError, UnicodeError):
        raise wrong from None
    return family, str(host)


def _is_free(family: socket.AddressFamily, host: str, port: int) -> bool:
    """Return whether the port is free. Raises AddressError if the user may not use it, OSError for other reasons."""
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does: it can reuse a closed port
        try:
            probe.bind((host, port))
            probe.listen()
        except PermissionError:
            raise AddressError(f"port = {port}: only root may use it; choose one from 1024 on") from None
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            return False
    return True


def urls(host: str, port: int, token: str) -> tuple[str, str]:
    """Return the cockpit's URL on this machine, and on other machines ('' if they cannot reach it)."""
    here = _LOOPBACK_OF_ALL.get(host, host)
    there = _external_address(host) if host in _LOOPBACK_OF_ALL else ""
    url, far = (f"http://{f'[{name}]' if ':' in name else name}:{port}/?token={token}" for name in (here, there))
    return url, far if there else ""


def _external_address(host: str) -> str:
    """Return the address at which other machines reach this one; its host name if it has no route to others."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((_REMOTE_EXAMPLES[family], 9))  # sends nothing, but chooses the local address of the route
            return str(probe.getsockname()[0])
    except OSError:
        return socket.gethostname()


@contextlib.contextmanager
def address_file(address: str, port: int) -> Iterator[str]:
    """Keep the address in `$ROS_HOME/drone_sim/cockpit_PORT.txt`, and yield a line that names the file."""
    file = Path(rospkg.get_ros_home()) / "drone_sim" / f"cockpit_{port}.txt"
    content = f"{address}\n"
    try:
        write_for_user_only(file, content)
    except OSError as error:
        yield f"the address with the token is only in the terminal, because {file} cannot be written ({error.strerror})"
        return
    try:
        yield f"the address with the token that opens it is in {file}"
    finally:
        with contextlib.suppress(OSError, ValueError):
            if file.read_text(encoding="utf-8") == content:  # otherwise another cockpit has replaced it
                file.unlink()


def write_for_user_only(file: Path, content: str) -> None:
    """Write a file that only the user can read, and replace an older file at once. Raises OSError."""
    file.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(prefix=f".{file.name}.", dir=file.parent)  # its mode is 0600
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as opened:
            opened.write(content)
        os.rename(temporary, file)
    except OSError:
        os.unlink(temporary)
        raise


def print_to_terminal(line: str) -> None:
    """Print a line, unless roslaunch writes the output to a log file, as for nodes without output="screen"."""
    if sys.stdout is None:
        return
    target = ""
    with contextlib.suppress(OSError, ValueError):  # stdout is not a file, as in a test
        target = os.readlink(f"/proc/self/fd/{sys.stdout.fileno()}")
    if target.startswith(os.path.realpath(rospkg.get_log_dir()) + os.sep):
        return
    with contextlib.suppress(OSError):  # the reader has closed the pipe
        print(line, flush=True)
