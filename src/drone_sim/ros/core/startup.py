"""The start of a node: errors of environment and master in one line, only one node per name, a thread per connection.

As in all of ROS, a new node replaces an older one of the same name. But ROS's master ends the older node only after
the new one is registered. If the older one still calls the master then (rospy reads a parameter for each line on
/rosout), the master takes it for a new node, and ends the newer one, too. So the older node is ended here, before the
new one registers. A node whose launch also runs the master is not replaced: the user must end that launch.
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
import threading
import time
import xmlrpc.client
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import rosgraph
import rospkg
import rospy
from rospy.impl import tcpros_base
from rospy.impl.tcpros_pubsub import QueuedConnection

from drone_sim.ros.core.network import FAILURES, addresses, call, check_master_uri, is_reachable, launched_nodes
from drone_sim.scripting.errors import ScriptError

MASTER_FAILURES = (ConnectionError, http.client.HTTPException, xmlrpc.client.Error, rosgraph.MasterException)
_EXPECTED = (ScriptError, ValueError, RuntimeError, OSError, rospy.ROSException)  # their messages are for the user
_CALL_TIMEOUT = 5.0  # s, for a reply of a master or a node
_CONNECT_TIMEOUT = 1.0  # s, for a TCP connection to a node
_END_TIMEOUT = 5.0  # s, for a node to end
_TURN_TIMEOUT = 60.0  # s, for another process of the same name to become a node
_POLL_PERIOD = 0.05  # s
_MASTER_POLL_PERIOD, _QUIET_PERIOD = 0.1, 5.0  # s, between two requests; until a line says what the tool waits for
_MAX_PENDING = 128  # connections that wait to be accepted, as many as rospy's XML-RPC server allows
_MAX_AT_ONCE = 1 << 16  # bytes of a message that is sent in the thread that publishes it
_FIRST_BYTE_TIMEOUT = 10.0  # s, after which a connection that has sent nothing is closed
_NICENESS = "DRONE_SIM_NICENESS"  # of a simulator that flies and its cockpit, in a course on one machine
_Result = TypeVar("_Result")
_ConnectionHandler = Callable[[socket.socket, Any], None]


def init_node(name: str, is_required: bool = False, **options: Any) -> bool:
    """Call rospy.init_node; return False, after one line on stderr, if that fails.

    rospy itself would wait for the master, raise an exception, or become a node that others cannot reach. An older node
    of the same name is ended first, unless its launch also runs the master. If `is_required`, other processes that
    start with this name wait until release_name is called. Log lines go to stdout at once: without a terminal, Python
    would buffer 8 KiB.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    try:
        _check_network()
        own_name = rospy.names.get_mappings().get("__name", "" if options.get("anonymous") else name)
        if own_name:
            _take_name(str(rosgraph.names.resolve_name(own_name, rospy.core.get_caller_id())), is_required)
    except (ValueError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr, flush=True)
        return False
    _check_log(name)
    is_node = status_of_node(name, lambda: rospy.init_node(name, **options)) == 0
    if is_node:
        _handle_connections_in_threads()
    if not is_required:
        release_name()
    return is_node


def status_of_node(name: str, action: Callable[[], Any]) -> int:
    """Run an action and return the exit status: 0, or 1 after one log line about an error that a user can correct."""
    try:
        action()
        return 0
    except MASTER_FAILURES as error:
        message = f"the ROS master at {rosgraph.get_master_uri()} does not answer, or refuses: {error}"
    except _EXPECTED as error:
        message = str(error)
    rospy.logfatal(f"{name}: {' '.join(message.split())}")
    return 1


def _check_network() -> None:
    """Raise OSError without a master, ValueError if other nodes cannot resolve this node's address."""
    uri = str(rosgraph.get_master_uri())
    check_master_uri(uri)
    try:
        call(uri, "getPid", timeout=_CALL_TIMEOUT)
    except FAILURES:
        raise OSError(f"no ROS master at {uri}: start roscore, or use roslaunch") from None
    variable = next((name for name in ("ROS_HOSTNAME", "ROS_IP") if name in os.environ), None)
    host = os.environ[variable] if variable else rosgraph.network.get_host_name()
    try:
        addresses(host)
    except OSError:
        source = variable or "the name of this machine"
        cure = "ROS_HOSTNAME=localhost works if all nodes run on this machine"
        raise ValueError(f"{source} = '{host}': cannot be resolved; {cure}") from None


# ---- log files


def _check_log(name: str) -> None:
    """If the log folder is not writable, say so and log to no file; otherwise rospy would not log to the terminal."""
    logging.FileHandler.handleError = _report_log_error  # type: ignore[assignment, method-assign]
    mappings = rospy.names.get_mappings()
    folder = os.path.dirname(os.path.abspath(mappings["__log"])) if "__log" in mappings else rospkg.get_log_dir()
    with contextlib.suppress(OSError):
        os.makedirs(folder, exist_ok=True)
    if not os.access(folder, os.W_OK):
        problem = f"no log is written, because {folder} is not writable; set ROS_LOG_DIR to another folder"
        print(f"{name}: {problem}", file=sys.stderr, flush=True)
        mappings["__log"] = os.devnull


_failed_logs: set[str] = set()  # log files whose error has been reported


def _report_log_error(handler: logging.FileHandler, _record: logging.LogRecord) -> None:
    """Report once that a log file cannot be written: Python would print a traceback for each line of the log."""
    if handler.baseFilename not in _failed_logs:
        _failed_logs.add(handler.baseFilename)
        error = sys.exc_info()[1]
        reason = error.strerror or error if isinstance(error, OSError) else error
        with contextlib.suppress(OSError):
            print(f"{handler.baseFilename}: no log is written ({reason})", file=sys.stderr, flush=True)


# ---- one node per name

_turn: socket.socket | None = None  # held by one process of a name on this machine; the kernel frees it at its end


def _take_name(name: str, is_required: bool) -> None:
    """End the node of this name, so that this process can register with the master.

    Another process of this name on this machine waits until `release_name`. Raises OSError if the older node does not
    end, does not answer, or was launched together with the master.
    """
    _wait_for_turn(name)
    try:
        uri = str(call(rosgraph.get_master_uri(), "lookupNode", name, timeout=_CALL_TIMEOUT))
    except ValueError:  # no such node is registered
        return
    if _name_at(uri, name) != name:
        return
    if _was_launched_with_master(name):
        node = f"a {'simulator' if is_required else 'node'} named {name} is already running"
        raise OSError(f"{node}, and its launch also runs the ROS master: stop it with Ctrl-C first")
    warning = f"a node named {name} is already running: it is stopped, and this one replaces it"
    print(warning, file=sys.stderr, flush=True)
    with contextlib.suppress(*FAILURES):  # the node may end before it has answered
        call(uri, "shutdown", "another node with this name was started and replaces it", timeout=_CALL_TIMEOUT)
    deadline = time.monotonic() + _END_TIMEOUT
    while is_reachable(uri, _CONNECT_TIMEOUT):
        if time.monotonic() > deadline:
            raise OSError(f"a node named {name} is already running at {uri} and does not stop: end that process")
        time.sleep(_POLL_PERIOD)


def release_name() -> None:
    """Let another process take the name. This node is now able to end when the other one asks for that."""
    global _turn
    if _turn is not None:
        _turn.close()
        _turn = None


def _wait_for_turn(name: str) -> None:
    """Wait for a socket that only one process of this machine can hold at a time. Raises OSError."""
    global _turn
    digest = hashlib.sha256(f"{rosgraph.get_master_uri()} {name}".encode()).hexdigest()
    _turn = socket.socket(socket.AF_UNIX)
    deadline = time.monotonic() + _TURN_TIMEOUT
    while True:
        try:
            return _turn.bind(f"\0drone_sim {digest}")
        except OSError as error:
            if error.errno != errno.EADDRINUSE:  # not Linux, which alone has abstract sockets
                return None
        if time.monotonic() > deadline:
            raise OSError(f"another process has been starting as {name} for {_TURN_TIMEOUT:g} s: end that process")
        time.sleep(_POLL_PERIOD)


def _name_at(uri: str, name: str) -> str:
    """Return the name of the node at `uri`, where the master says `name` is; '' for none.

    Raises OSError if the node accepts a connection, but does not answer.
    """
    if not is_reachable(uri, _CONNECT_TIMEOUT):  # the node was killed, and is still registered
        return ""
    try:
        return str(call(uri, "getName", timeout=_CALL_TIMEOUT))
    except TimeoutError:
        problem = f"a node named {name} is already running at {uri} and does not answer"
        raise OSError(f"{problem}: end it, or choose another __name:=") from None
    except FAILURES:  # not a node; the master will find out
        return ""


def _was_launched_with_master(name: str) -> bool:
    """Return whether the roslaunch that started a node also started the master."""
    with contextlib.suppress(*FAILURES):  # there is no roslaunch, or it has just ended
        for uri in call(rosgraph.get_master_uri(), "getParam", "/roslaunch/uris", timeout=_CALL_TIMEOUT).values():
            if {"master", name.strip("/")} <= set(launched_nodes(uri)):
                return True
    return False


# ---- connections from other nodes


def _handle_connections_in_threads() -> None:
    """Handle each connection to this node in a thread of its own. Call this once, after rospy.init_node.

    In rospy only five connections can wait to be accepted; TCP retries the others after 1, 3 and 7 s. And one thread
    accepts and reads them one after the other: a client that sends nothing blocks all others for good.
    """
    tcpros_base.start_tcpros_server()
    server = tcpros_base._tcpros_server.tcp_ros_server  # rospy has no public access to it
    server.server_sock.listen(_MAX_PENDING)
    handle: _ConnectionHandler = server.inbound_handler

    def handle_after_first_byte(connection: socket.socket, address: Any) -> None:
        with contextlib.suppress(OSError):
            connection.settimeout(_FIRST_BYTE_TIMEOUT)
            connection.recv(1, socket.MSG_PEEK)
            connection.settimeout(None)
            # Without this option a small message waits for the acknowledgment of the last one, for up to 40 ms.
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return handle(connection, address)
        connection.close()
        return None

    def start_thread(connection: socket.socket, address: Any) -> None:
        threading.Thread(target=handle_after_first_byte, args=(connection, address), daemon=True).start()

    server.inbound_handler = start_thread
    QueuedConnection.write_data = _send


_send_by_thread = QueuedConnection.write_data


def _send(queued: QueuedConnection, data: bytes) -> bool:
    """Send a message to a subscriber in the thread that publishes it, if no other message waits for this subscriber.

    rospy wakes a thread of the connection for each message, which takes more processor time than the message. That
    thread still sends what the kernel does not take at once, and finds a broken connection.
    """
    connection, sent = queued._connection, 0
    own = connection.socket  # None after the end of the connection
    with queued._lock:
        is_idle = not queued._queue and queued._cond_data_available._waiters
        if is_idle and own is not None and len(data) <= _MAX_AT_ONCE:
            with contextlib.suppress(OSError):
                sent = own.send(data, socket.MSG_DONTWAIT)
    connection.stat_bytes += sent
    if sent == len(data):
        connection.stat_num_msg += 1
        return True
    _send_by_thread(queued, data[sent:])
    while sent and queued._queue and not queued.done:  # rospy drops messages from a full queue, but not half a message
        time.sleep(0)
    return True


def give_way() -> None:
    """Let other processes of the machine go first, by as much as the environment says (a niceness, from 0 to 19)."""
    niceness = os.environ.get(_NICENESS, "0")
    if niceness.isdecimal() and os.nice(0) < int(niceness) <= 19:
        os.nice(int(niceness) - os.nice(0))
        with contextlib.suppress(OSError):  # Linux may compare sessions instead of processes, and each node is one
            Path("/proc/self/autogroup").write_text(niceness, encoding="ascii")


# ---- tools that wait for the simulator, and then run another program


def poll_master(tool: str, request: Callable[[rosgraph.Master], _Result | None], awaited: str) -> _Result:
    """Call `request` with the master until it returns a result; print once on stderr what is `awaited`.

    Raises OSError without a master.
    """
    master = rosgraph.Master(f"/{tool}")
    began, is_announced = time.monotonic(), False
    try:
        while True:
            result = request(master)
            if result is not None:
                return result
            time.sleep(_MASTER_POLL_PERIOD)
            if not is_announced and time.monotonic() - began > _QUIET_PERIOD:
                is_announced = True
                print(f"{tool}: waiting for {awaited}", file=sys.stderr, flush=True)
    except (OSError, rosgraph.MasterException) as error:
        raise OSError(f"the ROS master at {rosgraph.get_master_uri()} does not answer: {error}") from None
