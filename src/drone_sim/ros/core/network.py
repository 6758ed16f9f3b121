"""How nodes and masters are found and asked over the network. Nothing of ROS is imported: the doctor looks for it."""

from __future__ import annotations

import http.client
import socket
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

MASTER = "http://localhost:11311"
PATIENCE = 2.0  # s, for an answer where nothing else is said
FAILURES = (OSError, http.client.HTTPException, xmlrpc.client.Error, ExpatError, ValueError)
_CALLER = "/drone_sim"


class _Transport(xmlrpc.client.Transport):
    """Gives up after a while."""

    def __init__(self, patience: float):
        super().__init__()
        self._patience = patience

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._patience
        return connection


def call(uri: str, method: str, *arguments: Any, patience: float | None = None) -> Any:
    """Return what a master, or a node, answers to a call of ROS's XML-RPC API within `patience` (s).

    Raises one of FAILURES.
    """
    return _answer(uri, method, (_CALLER, *arguments), patience)


def launched(uri: str) -> list[str]:
    """Return what a roslaunch, of which this is the address, runs: names of nodes, and `master`. Raises as `call`."""
    running, _ended = _answer(uri, "list_processes", (), None)
    return [name.rpartition("-")[0] or name for name, _spawned in running]


def _answer(uri: str, method: str, arguments: tuple[Any, ...], patience: float | None) -> Any:
    server = xmlrpc.client.ServerProxy(uri, transport=_Transport(patience or PATIENCE))
    answer = getattr(server, method)(*arguments)
    if not isinstance(answer, list) or len(answer) != 3:
        raise ValueError("the reply is not one of ROS's XML-RPC API")
    code, said, value = answer
    if code != 1:
        raise ValueError(str(said))
    return value


def answers(master: str, node: str) -> bool:
    """Tell whether a node that a master knows is there."""
    try:
        call(call(master, "lookupNode", node), "getPid")
    except FAILURES:
        return False
    return True


def reached(uri: str, patience: float) -> bool | None:
    """Return whether somebody listens there within `patience` (s); None where nothing answers at all."""
    try:
        there = urlsplit(uri)
        if not there.hostname or not there.port:
            return False
        socket.create_connection((there.hostname, there.port), timeout=patience).close()
    except (ConnectionRefusedError, socket.gaierror, ValueError):
        return False
    except OSError:
        return None
    return True


def addresses(host: str) -> set[str]:
    """Return the addresses behind a host's name. Raises OSError for one that is not known."""
    try:
        return {str(one[4][0]) for one in socket.getaddrinfo(host or " ", None)}
    except UnicodeError:
        raise OSError("not the name of a host") from None


def check_master_uri(uri: str) -> None:
    """Raise ValueError, in one line, for what is no master's address."""
    try:
        there = urlsplit(uri)
        host = there.hostname if there.port != 0 and there.scheme == "http" else None
    except ValueError:  # of the port
        host = None
    if not host:
        raise ValueError(f"ROS_MASTER_URI = '{uri}': must be like {MASTER}")
    try:
        addresses(host)
    except OSError:
        raise ValueError(f"ROS_MASTER_URI = '{uri}': the host '{host}' cannot be resolved") from None
