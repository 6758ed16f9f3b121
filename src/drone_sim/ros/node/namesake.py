"""One name, one node: who is started takes the place of the node that has its name, once that one has ended.

So it is with every node of ROS. But the master tells the older one only when the newer one is there, and takes whatever
the older one still says (for a line on /rosout, rospy asks for a parameter) for a node that has come just now: it ends
the newer one, too.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import http.client
import socket
import sys
import time
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

import rosgraph

_CONNECTS = 1.0  # s, for a node to be reached
_ENDS = 5.0  # s that a node may take for its end
_STARTS = 60.0  # s that another process may take until it is a node that can end
_LOOK = 0.05  # s, between two looks
_FAILURES = (OSError, http.client.HTTPException, xmlrpc.client.Error, ExpatError)


_turn: socket.socket | None = None  # held by one process of a name, on this machine; it goes when the process does


def take_name(name: str) -> None:
    """End the node of a name, so that this process may register with the master.

    Who is started at the same moment, on the same machine, waits for its turn until `let_others`. Raises OSError where
    the older one does not end, or does not answer within the sockets' default timeout.
    """
    _wait_for_turn(name)
    uri = _node(name)
    if uri and _name(name, uri) == name:
        print(f"{name} is there already: it ends, and this one takes its place", file=sys.stderr, flush=True)
        _end(name, uri)


def let_others() -> None:
    """Let another process take the name: this one can end as it should."""
    global _turn
    if _turn is not None:
        _turn.close()
        _turn = None


def _wait_for_turn(name: str) -> None:
    """Hold a socket that one process of this machine can hold. Raises OSError."""
    global _turn
    digest = hashlib.sha256(f"{rosgraph.get_master_uri()} {name}".encode()).hexdigest()
    _turn = socket.socket(socket.AF_UNIX)
    end = time.monotonic() + _STARTS
    while True:
        try:
            return _turn.bind(f"\0drone_sim {digest}")
        except OSError as error:
            if error.errno != errno.EADDRINUSE:  # not a Linux: there is no such socket
                return None
        if time.monotonic() > end:
            raise OSError(f"another node {name} has been about to start for {_STARTS:g} s: end that process")
        time.sleep(_LOOK)


def _node(name: str) -> str:
    """Return where the master says that a node is, '' where it knows none."""
    try:
        return str(rosgraph.Master(name).lookupNode(name))
    except rosgraph.MasterError:
        return ""


def _name(name: str, uri: str) -> str:
    """Return the name of who answers there, '' for nobody. Raises OSError for somebody who does not answer."""
    if not _is_there(uri):  # it was killed, and the master does not know
        return ""
    try:
        answer: Any = xmlrpc.client.ServerProxy(uri).getName(name)
        return str(answer[2])
    except TimeoutError:
        said = f"{name} is there already, at {uri}, and does not answer: end that process, or take another __name:="
        raise OSError(said) from None
    except _FAILURES:  # it is not one of ours: it is left to the master
        return ""


def _end(name: str, uri: str) -> None:
    """Ask a node to end; return when it has. Raises OSError."""
    with contextlib.suppress(*_FAILURES):  # it may be gone before it has answered
        xmlrpc.client.ServerProxy(uri).shutdown(name, "another node of this name has been started, and takes its place")
    end = time.monotonic() + _ENDS
    while _is_there(uri):
        if time.monotonic() > end:
            raise OSError(f"{name} is there already, at {uri}, and does not end: end that process")
        time.sleep(_LOOK)


def _is_there(uri: str) -> bool:
    """Tell whether somebody listens."""
    try:
        there = urlsplit(uri)
        socket.create_connection((there.hostname or "", there.port or 0), timeout=_CONNECTS).close()
    except (OSError, ValueError):
        return False
    return True
