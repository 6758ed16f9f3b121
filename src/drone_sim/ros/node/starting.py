"""What may be wrong before a node runs: the environment, the master. Each gets one line."""

from __future__ import annotations

import contextlib
import http.client
import io
import logging
import os
import socket
import sys
import xmlrpc.client
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import rosgraph
import rospkg
import rospy

from drone_sim.ros.node import namesake
from drone_sim.scripting.errors import ScriptError

MASTER_GONE = (ConnectionError, http.client.HTTPException, xmlrpc.client.Error, rosgraph.MasterException)
_EXPECTED = (ScriptError, ValueError, RuntimeError, OSError, rospy.ROSException)  # their messages are for the user
_PATIENCE = 5.0  # s, for a master's answer


def init_node(name: str, others_wait: bool = False, **options: Any) -> bool:
    """Call rospy.init_node; return False, after one line on stderr, where it cannot become a node.

    rospy itself would wait for the master, or fail with a traceback, or be a node that nobody can reach. Another node
    of the name has ended by then; `others_wait`: who else wants it waits for namesake.let_others. What is logged goes
    to stdout line by line: where that is no terminal, Python would keep it until 8 KiB have come together.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    patience = socket.getdefaulttimeout()
    socket.setdefaulttimeout(_PATIENCE)
    try:
        _check_master()
        _check_own_address()
        own = _own_name(name, bool(options.get("anonymous")))
        if own:
            namesake.take_name(own)
    except (ValueError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr, flush=True)
        return False
    finally:
        socket.setdefaulttimeout(patience)
    _check_log(name)
    done = not reported(name, lambda: rospy.init_node(name, **options))
    if not others_wait:
        namesake.let_others()
    return done


def _check_log(name: str) -> None:
    """Do without a log, and say so, where none can be written: rospy would say nothing on the terminal then, either."""
    logging.FileHandler.handleError = _do_without_log  # type: ignore[assignment, method-assign]
    mappings = rospy.names.get_mappings()
    folder = os.path.dirname(os.path.abspath(mappings["__log"])) if "__log" in mappings else rospkg.get_log_dir()
    with contextlib.suppress(OSError):
        os.makedirs(folder, exist_ok=True)
    if not os.access(folder, os.W_OK):
        said = f"no log is written: {folder} must not be written to; ROS_LOG_DIR names another folder"
        print(f"{name}: {said}", file=sys.stderr, flush=True)
        mappings["__log"] = os.devnull


_unwritten: set[str] = set()  # files of the log that cannot be written


def _do_without_log(handler: logging.FileHandler, _record: logging.LogRecord) -> None:
    """Say once that a disk is full: Python itself would print a traceback for every line of the log."""
    if handler.baseFilename not in _unwritten:
        _unwritten.add(handler.baseFilename)
        why = sys.exc_info()[1]
        said = why.strerror or why if isinstance(why, OSError) else why
        with contextlib.suppress(OSError):
            print(f"{handler.baseFilename}: no log is written ({said})", file=sys.stderr, flush=True)


def _own_name(name: str, anonymous: bool) -> str:
    """Return the name that the node will have, '' for one that nobody else has."""
    given = rospy.names.get_mappings().get("__name", "" if anonymous else name)
    return str(rosgraph.names.resolve_name(given, rospy.core.get_caller_id())) if given else ""


def _check_master() -> None:
    uri = str(rosgraph.get_master_uri())
    try:
        there = urlsplit(uri)
        host, port = there.hostname, there.port
    except ValueError:  # of the port
        host = None
    if not host or there.scheme != "http":
        raise ValueError(f"ROS_MASTER_URI = '{uri}': must be like http://localhost:11311")
    try:
        socket.getaddrinfo(host, port)
    except (OSError, UnicodeError):
        raise ValueError(f"ROS_MASTER_URI = '{uri}': the host '{host}' is not known") from None
    if not rosgraph.is_master_online():
        raise OSError(f"no ROS master at {uri}: start roscore, or use roslaunch")


def _check_own_address() -> None:
    """Raise ValueError where other nodes could not find this one."""
    given = next((name for name in ("ROS_HOSTNAME", "ROS_IP") if name in os.environ), None)
    host = os.environ[given] if given else rosgraph.network.get_host_name()
    try:
        socket.getaddrinfo(host or " ", None)
    except (OSError, UnicodeError):
        what = f"{given or 'the name of this machine'} = '{host}'"
        raise ValueError(f"{what}: is not known here; ROS_HOSTNAME=localhost will do on one machine") from None


def reported(name: str, action: Callable[[], Any]) -> int:
    """Return the exit status of an action: 0, or 1 after one line for what a user may have done wrong."""
    try:
        action()
        return 0
    except MASTER_GONE as error:
        said = f"the ROS master at {rosgraph.get_master_uri()} has gone, or refuses: {error}"
    except _EXPECTED as error:
        said = str(error)
    rospy.logfatal(f"{name}: {' '.join(said.split())}")
    return 1
