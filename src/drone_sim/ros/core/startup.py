"""How a node starts: problems with environment and master are told in one line; only one node has a name at a time.

A new node takes the place of an older one with the same name, once that has ended, as every ROS node does. But the
master tells the older one to end only when the newer one is registered. If the older one still calls the master then
(for a line on /rosout, rospy asks for a parameter), the master takes it for a new node, and ends the newer one, too.
A node whose launch also runs the master keeps its place: if that launch is to end, the user ends it.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import http.client
import io
import logging
import os
import socket
import sys
import time
import xmlrpc.client
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import rosgraph
import rospkg
import rospy

from drone_sim.ros.core.network import FAILURES, addresses, call, check_master_uri, launched, reached
from drone_sim.ros.core.tcpros import take_connections
from drone_sim.scripting.errors import ScriptError

MASTER_GONE = (ConnectionError, http.client.HTTPException, xmlrpc.client.Error, rosgraph.MasterException)
_EXPECTED = (ScriptError, ValueError, RuntimeError, OSError, rospy.ROSException)  # their messages are for the user
_PATIENCE = 5.0  # s, for an answer of a master or a node
_CONNECTS = 1.0  # s, for a node to be reached
_ENDS = 5.0  # s that a node may take for its end
_STARTS = 60.0  # s that another process may take until it is a node that can end
_LOOK = 0.05  # s, between two looks
_ASKS, _STARTING = 0.1, 5.0  # s, between two questions to the master; for a simulator that is just being started
_Answer = TypeVar("_Answer")


def init_node(name: str, is_required: bool = False, **options: Any) -> bool:
    """Call rospy.init_node; return False, after one line on stderr, where it cannot become a node.

    rospy itself would wait for the master, or fail with a traceback, or be a node that nobody can reach. An older node
    of the same name is ended first, except where its launch also runs the master: that launch is to stay as it is. If
    `is_required`, other processes that want the name wait until release_name. Log lines go to stdout at once: without a
    terminal, Python would keep them until there are 8 KiB.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    try:
        _check_master()
        _check_own_address()
        own = _own_name(name, bool(options.get("anonymous")))
        if own:
            _take_name(own, is_required)
    except (ValueError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr, flush=True)
        return False
    _check_log(name)
    done = not reported(name, lambda: rospy.init_node(name, **options))
    if done:
        take_connections()
    if not is_required:
        release_name()
    return done


def _check_log(name: str) -> None:
    """If no log file can be written, say so and work without one: rospy would not log to the terminal, either."""
    logging.FileHandler.handleError = _do_without_log  # type: ignore[assignment, method-assign]
    mappings = rospy.names.get_mappings()
    folder = os.path.dirname(os.path.abspath(mappings["__log"])) if "__log" in mappings else rospkg.get_log_dir()
    with contextlib.suppress(OSError):
        os.makedirs(folder, exist_ok=True)
    if not os.access(folder, os.W_OK):
        said = f"no log is written, because {folder} is not writable; set ROS_LOG_DIR to another folder"
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
    check_master_uri(uri)
    try:
        call(uri, "getPid", patience=_PATIENCE)
    except FAILURES:
        raise OSError(f"no ROS master at {uri}: start roscore, or use roslaunch") from None


def _check_own_address() -> None:
    """Raise ValueError where other nodes could not find this one."""
    given = next((name for name in ("ROS_HOSTNAME", "ROS_IP") if name in os.environ), None)
    host = os.environ[given] if given else rosgraph.network.get_host_name()
    try:
        addresses(host)
    except OSError:
        what = f"{given or 'the name of this machine'} = '{host}'"
        raise ValueError(
            f"{what}: cannot be resolved; ROS_HOSTNAME=localhost works if all nodes run on this machine"
        ) from None


def reported(name: str, action: Callable[[], Any]) -> int:
    """Return the exit status of an action: 0, or 1 after one line for what a user may have done wrong."""
    try:
        action()
        return 0
    except MASTER_GONE as error:
        said = f"the ROS master at {rosgraph.get_master_uri()} does not answer, or refuses: {error}"
    except _EXPECTED as error:
        said = str(error)
    rospy.logfatal(f"{name}: {' '.join(said.split())}")
    return 1


NOT_GIVEN = "default"  # the default of launch arguments whose parameters a scene or config may set, too


def from_shell(name: str) -> str:
    """Return a file's name so that it is valid in any folder; a built-in script's ("target") unchanged; '' for "none".

    A relative path is taken from the folder of the shell that ran roslaunch, which runs nodes in ~/.ros and hands that
    shell's PWD on.
    """
    if name == "none":  # roslaunch's arguments cannot default to nothing without looking required
        return ""
    if not name or name.startswith(("package://", "~", "/")) or ("/" not in name and not Path(name).suffix):
        return name
    return str(Path(os.environ.get("PWD") or os.getcwd()) / name)


def script_from_shell(name: str) -> str:
    """Return a script's name or file as `from_shell` does; '' for a launch file's default, and `none` unchanged."""
    return {NOT_GIVEN: "", "none": "none"}.get(name, from_shell(name))


# ---- one name, one node

_turn: socket.socket | None = None  # held by one process of a name, on this machine; it goes when the process does


def _take_name(name: str, is_required: bool) -> None:
    """End the node of a name, so that this process may register with the master.

    Another process that is started at the same moment, on the same machine, waits until `release_name`. Raises OSError
    where the older node does not end, does not answer, or was launched together with the master.
    """
    _wait_for_turn(name)
    uri = _node(name)
    if uri and _name(name, uri) == name:
        if _launched_with_master(name):
            what = f"a {'simulator' if is_required else 'node'} named {name} is already running"
            raise OSError(f"{what}, and its launch also runs the ROS master: stop it with Ctrl-C first")
        print(
            f"a node named {name} is already running: it is stopped, and this one replaces it",
            file=sys.stderr,
            flush=True,
        )
        _end(name, uri)


def release_name() -> None:
    """Let another process take the name, now that it can end this one properly."""
    global _turn
    if _turn is not None:
        _turn.close()
        _turn = None


def _wait_for_turn(name: str) -> None:
    """Wait for a socket that only one process of this machine can hold at a time. Raises OSError."""
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
            raise OSError(f"another process has been starting as {name} for {_STARTS:g} s: end that process")
        time.sleep(_LOOK)


def _node(name: str) -> str:
    """Return where the master says that a node is, '' where it knows none."""
    try:
        return str(call(rosgraph.get_master_uri(), "lookupNode", name, patience=_PATIENCE))
    except ValueError:
        return ""


def _launched_with_master(name: str) -> bool:
    """Whether the roslaunch that started the node of a name has started the master, too."""
    with contextlib.suppress(*FAILURES):  # no roslaunch, or one that has ended meanwhile
        for uri in call(rosgraph.get_master_uri(), "getParam", "/roslaunch/uris", patience=_PATIENCE).values():
            if {"master", name.strip("/")} <= set(launched(uri)):
                return True
    return False


def _name(name: str, uri: str) -> str:
    """Return the name of the node that answers at `uri`, '' for none. Raises OSError if it does not answer."""
    if not reached(uri, _CONNECTS):  # it was killed, and the master does not know
        return ""
    try:
        return str(call(uri, "getName", patience=_PATIENCE))
    except TimeoutError:
        said = (
            f"a node named {name} is already running at {uri} and does not answer: end it, or choose another __name:="
        )
        raise OSError(said) from None
    except FAILURES:  # it is not one of ours: it is left to the master
        return ""


def _end(name: str, uri: str) -> None:
    """Ask a node to end; return when it has. Raises OSError."""
    with contextlib.suppress(*FAILURES):  # it may be gone before it has answered
        call(uri, "shutdown", "another node with this name was started and replaces it", patience=_PATIENCE)
    end = time.monotonic() + _ENDS
    while reached(uri, _CONNECTS):
        if time.monotonic() > end:
            raise OSError(f"a node named {name} is already running at {uri} and does not stop: end that process")
        time.sleep(_LOOK)


# ---- what becomes another program


def ask_master(tool: str, ask: Callable[[rosgraph.Master], _Answer | None], waits: str) -> _Answer:
    """Ask the master again and again until there is an answer; say once on stderr what is waited for.

    Raises OSError without a master.
    """
    master = rosgraph.Master(f"/{tool}")
    began, said = time.monotonic(), False
    try:
        while True:
            answer = ask(master)
            if answer is not None:
                return answer
            time.sleep(_ASKS)
            if not said and time.monotonic() - began > _STARTING:
                said = True
                print(f"{tool}: waiting for {waits}", file=sys.stderr, flush=True)
    except (OSError, rosgraph.MasterException) as error:
        raise OSError(f"the ROS master at {rosgraph.get_master_uri()} does not answer: {error}") from None
