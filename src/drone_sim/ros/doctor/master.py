"""Checks of the ROS master, its nodes and topics, and the simulators' /diagnostics."""

from __future__ import annotations

import os
import threading
import time
import xmlrpc.client
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

from drone_sim.ros.core.network import FAILURES, MASTER, TIMEOUT, call, check_master_uri, is_alive
from drone_sim.ros.doctor import HINT, OK, WRONG, Line
from drone_sim.run.profiles import command_topics, profile_cure

_DIAGNOSTICS_TIMEOUT = 4.0  # s, for all simulators; each publishes once a second
_MARKS = {0: OK, 1: HINT}  # by the level of a DiagnosticStatus
_MAX_CLOCK_DIFFERENCE = 1.0  # s, between this machine and that of the simulator
_NODES_TIMEOUT = 2 * TIMEOUT  # s, for all nodes; each needs two calls
_START = "`roslaunch drone_sim drone.launch` starts one"

Graph = dict[str, list[str]]  # nodes by topic, or by service


class Master:
    """Checks of the shell's master; all but `connection` need a connection to it."""

    def __init__(self) -> None:
        self.uri = os.environ.get("ROS_MASTER_URI", MASTER)
        self.is_connected = False
        self.published: Graph = {}
        self.subscribed: Graph = {}
        self.services: Graph = {}

    def connection(self) -> Iterator[Line]:
        """Get all topics and services from the master, and yield a line about the connection."""
        try:
            check_master_uri(self.uri)
        except ValueError as error:
            yield Line(WRONG, "master", str(error))
            return
        port = urlsplit(self.uri).port or 80
        try:
            graphs = call(self.uri, "getSystemState")
            self.published, self.subscribed, self.services = map(dict, graphs)
        except ConnectionRefusedError:
            yield Line(HINT, "master", f"no master runs at {self.uri}: {_START}")
        except FAILURES as error:
            reason = f"HTTP {error.errcode}" if isinstance(error, xmlrpc.client.ProtocolError) else str(error)
            problem = f"port {port} of {self.uri} does not answer as a master ({reason or type(error).__name__})"
            cure = "end the program that listens there, or `export ROS_MASTER_URI=` with another port"
            yield Line(WRONG, "master", f"{problem}: {cure}")
        else:
            self.is_connected = True
            yield Line(OK, "master", f"at {self.uri}, with {len(self.nodes())} nodes")

    def nodes(self) -> list[str]:
        graphs = (self.published, self.subscribed, self.services)
        return sorted({node for graph in graphs for nodes in graph.values() for node in nodes})

    def clocks(self) -> Iterator[Line]:
        """Check that the publishers of /clock fit to /use_sim_time."""
        try:
            is_simulated = call(self.uri, "getParam", "/use_sim_time") is True
        except FAILURES:
            is_simulated = False
        publishers = self.published.get("/clock", [])
        names = ", ".join(publishers)
        if is_simulated and not publishers:
            problem = "/use_sim_time is true, but no node publishes /clock, so nodes wait forever"
            cure = "`rosparam set /use_sim_time false`, or use_sim_time:=true for drone.launch; then restart the nodes"
            yield Line(WRONG, "clock", f"{problem}: {cure}")
        elif is_simulated and len(publishers) > 1:
            yield Line(WRONG, "clock", f"{names} all publish /clock, so time jumps: stop all but one")
        elif is_simulated:
            yield Line(OK, "clock", f"simulated time, published by {names}")
        elif publishers:
            problem = f"{names} publishes /clock, but /use_sim_time is not true, so nodes use real time"
            yield Line(HINT, "clock", f"{problem}: `rosparam set /use_sim_time true` before they start")
        else:
            yield Line(OK, "clock", "real time")

    def dead_nodes(self) -> Iterator[Line]:
        """Yield a line with the registered nodes that do not answer."""
        nodes, alive = self.nodes(), set()

        def ask(node: str) -> None:
            if is_alive(self.uri, node):
                alive.add(node)

        # One thread for each node: looking up the name of a host that is gone may block for 20 s.
        threads = [threading.Thread(target=ask, args=(node,), daemon=True) for node in nodes]
        for thread in threads:
            thread.start()
        deadline = time.monotonic() + _NODES_TIMEOUT
        for thread in threads:
            thread.join(max(deadline - time.monotonic(), 0.0))
        dead = [node for node in nodes if node not in alive]
        if dead:
            problem = f"{', '.join(dead)} {'is' if len(dead) == 1 else 'are'} registered and did not answer"
            cure = "`rosnode cleanup` removes dead nodes; a node on a machine that you cannot reach may be alive"
            yield Line(HINT, "nodes", f"{problem} within {_NODES_TIMEOUT:g} s: {cure}")

    def commands(self) -> Iterator[Line]:
        """Yield a line for each topic that looks like a command and is published without a subscriber."""
        received = [topic for topic in self.subscribed if topic.endswith("/cmd_vel")]
        for topic, nodes in self.published.items():
            if topic in self.subscribed or not (topic.endswith("cmd_vel") or topic in command_topics()):
                continue
            own = f"{received[0].rpartition('/')[0]}/{topic.rpartition('/')[2]}" if received else ""
            cure = f"start it with {topic[1:]}:={own}" if own else "no simulator with a drone is running"
            cures = ", or ".join(filter(None, (cure, profile_cure(topic))))
            yield Line(HINT, "commands", f"{', '.join(nodes)} publishes {topic}, which has no subscriber: {cures}")


def simulator(master: Master) -> Iterator[Line]:
    """Yield the lines that the simulators publish on /diagnostics."""
    nodes = sorted({node for name, nodes in master.services.items() if name.endswith("/save_scene") for node in nodes})
    if not nodes:
        yield Line(HINT, "simulator", "none is running: `roslaunch drone_sim drone.launch` starts one")
        return
    messages = _wait_for_diagnostics(nodes)
    for node in nodes:
        if node in messages:
            yield from _diagnostics_lines(node, messages[node])
        else:
            problem = f"{node} published nothing on /diagnostics within {_DIAGNOSTICS_TIMEOUT:g} s"
            yield Line(WRONG, "simulator", f"{problem}: stop and restart it")


def _wait_for_diagnostics(nodes: list[str]) -> dict[str, Any]:
    """Return the first message of each node that publishes one within _DIAGNOSTICS_TIMEOUT."""
    import rospy
    from diagnostic_msgs.msg import DiagnosticArray

    if not rospy.core.is_initialized():
        rospy.init_node("drone_sim_doctor", anonymous=True, disable_signals=True, disable_rostime=True)
    received: dict[str, Any] = {}
    complete = threading.Event()

    def take(message: Any) -> None:
        for node in nodes:
            if any(status.name.startswith(f"{node[1:]}: ") for status in message.status):
                received.setdefault(node, message)
        if len(received) == len(nodes):
            complete.set()

    subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, take)
    complete.wait(_DIAGNOSTICS_TIMEOUT)
    subscriber.unregister()
    return dict(received)


def _diagnostics_lines(node: str, message: Any) -> Iterator[Line]:
    is_simulated = False
    for status in message.status:
        what = status.name.removeprefix(f"{node[1:]}: ")
        yield Line(_MARKS.get(status.level, WRONG), what, status.message)
        is_simulated |= any(pair.key == "stamps" and pair.value.startswith("simulated") for pair in status.values)
    difference = time.time() - message.header.stamp.to_sec()
    if not is_simulated and abs(difference) > _MAX_CLOCK_DIFFERENCE:
        problem = f"the clocks of this machine and of {node} differ by {difference:.1f} s"
        yield Line(HINT, "clock", f"{problem}: run chrony on both")
