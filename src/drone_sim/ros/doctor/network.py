"""Names and ports of this machine: can other nodes reach a node that starts here?"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from urllib.parse import urlsplit

from drone_sim.ros.doctor.line import HINT, OK, WRONG, Line

PATIENCE = 2.0  # s, for an answer of the network's
MASTER = "http://localhost:11311"
_CURE = "on one machine `export ROS_HOSTNAME=localhost` will do"


def own_host() -> tuple[str, str]:
    """Return the name under which nodes of this shell tell others to reach them, and what says so."""
    for given in ("ROS_HOSTNAME", "ROS_IP"):
        if given in os.environ:
            return os.environ[given], given
    return socket.gethostname(), "the name of this machine"


def addresses(host: str) -> set[str]:
    """Return the addresses behind a host's name. Raises OSError for one that is not known."""
    try:
        return {str(one[4][0]) for one in socket.getaddrinfo(host or " ", None)}
    except UnicodeError:
        raise OSError("no name of a host") from None


def is_loopback(host: str) -> bool:
    """Whether a host's name means this machine, from inside only. Raises OSError for one that is not known."""
    return all(one.startswith("127.") or one == "::1" for one in addresses(host))


def names() -> Iterator[Line]:
    """Does `localhost` mean this machine, and can its own nodes be reached under their name?"""
    try:
        if not is_loopback("localhost"):
            raise OSError
    except OSError:
        yield Line(
            WRONG, "host names", "'localhost' is not this machine: /etc/hosts needs the line '127.0.0.1 localhost'"
        )
    host, given = own_host()
    if {"ROS_HOSTNAME", "ROS_IP"} <= os.environ.keys():
        yield Line(HINT, "host names", f"ROS_IP = '{os.environ['ROS_IP']}' counts for nothing beside ROS_HOSTNAME")
    try:
        addresses(host)
    except OSError:
        yield Line(WRONG, "host names", f"{given} = '{host}' is not known here: {_CURE}")
        return
    yield _reaches_itself(host, given)


def _reaches_itself(host: str, given: str) -> Line:
    """Listen on a free port and connect to it, as another node would."""
    with socket.socket() as listening:
        listening.bind(("", 0))
        listening.listen(1)
        try:
            socket.create_connection((host, listening.getsockname()[1]), timeout=PATIENCE).close()
        except OSError as error:
            said = f"{given} = '{host}' does not lead back to this machine ({error}): {_CURE}"
            return Line(WRONG, "host names", said)
    return Line(OK, "host names", f"nodes from here are reached at {host} ({given})")


def across() -> Iterator[Line]:
    """Where the master is on another machine: can nodes there reach those from here?"""
    master = urlsplit(os.environ.get("ROS_MASTER_URI", MASTER)).hostname or "localhost"
    host, given = own_host()
    try:
        if is_loopback(host) and not is_loopback(master):
            cure = "`export ROS_IP=` with an address that they can reach, and ROS_HOSTNAME unset"
            yield Line(
                WRONG, "host names", f"the master is on {master}, whose nodes cannot reach {given} = '{host}': {cure}"
            )
    except OSError:  # said by others
        return
