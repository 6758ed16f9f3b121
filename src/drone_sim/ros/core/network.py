"""Requests to nodes and masters over the network. Imports nothing of ROS, because the doctor checks if ROS is there."""

from __future__ import annotations

import http.client
import socket
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

MASTER = "http://localhost:11311"
TIMEOUT = 2.0  # s, the default for a reply
FAILURES = (OSError, http.client.HTTPException, xmlrpc.client.Error, ExpatError, ValueError)
_CALLER = "/drone_sim"


class _Transport(xmlrpc.client.Transport):
    """HTTP transport with a timeout (s)."""

    def __init__(self, timeout: float):
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


def call(uri: str, method: str, *arguments: Any, timeout: float | None = None) -> Any:
    """Return the reply of a master or a node to a call of ROS's XML-RPC API within `timeout` (s).

    Raises one of FAILURES.
    """
    return _call(uri, method, (_CALLER, *arguments), timeout)


def launched_nodes(uri: str) -> list[str]:
    """Return the names of the nodes that the roslaunch at `uri` runs, and `master` if it runs one. Raises as `call`."""
    running, _ended = _call(uri, "list_processes", (), None)
    return [name.rpartition("-")[0] or name for name, _spawned in running]


def _call(uri: str, method: str, arguments: tuple[Any, ...], timeout: float | None) -> Any:
    server = xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout or TIMEOUT))
    reply = getattr(server, method)(*arguments)
    if not isinstance(reply, list) or len(reply) != 3:
        raise ValueError("the reply is not one of ROS's XML-RPC API")
    code, status, value = reply
    if code != 1:
        raise ValueError(str(status))
    return value


def is_alive(master: str, node: str) -> bool:
    """Return whether a node that is registered with a master answers."""
    try:
        call(call(master, "lookupNode", node), "getPid")
    except FAILURES:
        return False
    return True


def is_reachable(uri: str, timeout: float) -> bool | None:
    """Return whether a program listens at `uri`; None if its host does not answer within `timeout` (s)."""
    try:
        address = urlsplit(uri)
        if not address.hostname or not address.port:
            return False
        socket.create_connection((address.hostname, address.port), timeout=timeout).close()
    except (ConnectionRefusedError, socket.gaierror, ValueError):
        return False
    except OSError:
        return None
    return True


def addresses(host: str) -> set[str]:
    """Return the IP addresses of a host. Raises OSError for an unknown name."""
    try:
        return {str(info[4][0]) for info in socket.getaddrinfo(host or " ", None)}
    except UnicodeError:
        raise OSError("not the name of a host") from None


def check_master_uri(uri: str) -> None:
    """Raise ValueError, in one line, for a URI that cannot be a master's."""
    try:
        address = urlsplit(uri)
        host = address.hostname if address.port != 0 and address.scheme == "http" else None
    except ValueError:  # the port is invalid
        host = None
    if not host:
        raise ValueError(f"ROS_MASTER_URI = '{uri}': must be like {MASTER}")
    try:
        addresses(host)
    except OSError:
        raise ValueError(f"ROS_MASTER_URI = '{uri}': the host '{host}' cannot be resolved") from None
