"""The checks of the ROS master, its nodes and topics, and the /diagnostics of the simulator."""

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

_DIAGNOSTICS = 4.0  # s, for the /diagnostics of all simulators; each publishes once a second
_MARKS = {0: OK, 1: HINT}
_APART = 1.0  # s, between this machine's clock and that of the simulator
_ANSWERS = 2 * TIMEOUT  # s, for the answers of all nodes; each takes two calls
_START = "`roslaunch drone_sim drone.launch` starts one"

Graph = dict[str, list[str]]  # nodes by topic, or by service


class Master:
    """The master of this shell. The checks ask it; where `there` is False, they have nothing to ask."""

    def __init__(self) -> None:
        """Know nothing yet but where it should be."""
        self.uri = os.environ.get("ROS_MASTER_URI", MASTER)
        self.there = False
        self.published: Graph = {}
        self.subscribed: Graph = {}
        self.services: Graph = {}

    def found(self) -> Iterator[Line]:
        """Is it there?"""
        try:
            check_master_uri(self.uri)
        except ValueError as error:
            yield Line(WRONG, "master", str(error))
            return
        yield self._asked()

    def _asked(self) -> Line:
        port = urlsplit(self.uri).port or 80
        try:
            graph = call(self.uri, "getSystemState")
            self.published, self.subscribed, self.services = (dict(one) for one in graph)
        except ConnectionRefusedError:
            return Line(HINT, "master", f"no master runs at {self.uri}: {_START}")
        except FAILURES as error:
            why = f"HTTP {error.errcode}" if isinstance(error, xmlrpc.client.ProtocolError) else str(error)
            said = f"port {port} of {self.uri} does not answer as a master ({why or type(error).__name__})"
            cure = "end the program that listens there, or `export ROS_MASTER_URI=` with another port"
            return Line(WRONG, "master", f"{said}: {cure}")
        self.there = True
        return Line(OK, "master", f"at {self.uri}, with {len(self.nodes())} nodes")

    def nodes(self) -> list[str]:
        """Return the names of all nodes."""
        graphs = (self.published, self.subscribed, self.services)
        return sorted({node for graph in graphs for nodes in graph.values() for node in nodes})

    def clocks(self) -> Iterator[Line]:
        """Does somebody tell the time that nodes go by?"""
        if not self.there:
            return
        try:
            simulated = call(self.uri, "getParam", "/use_sim_time")
        except FAILURES:
            simulated = False
        tellers = self.published.get("/clock", [])
        if simulated is True and not tellers:
            cure = "`rosparam set /use_sim_time false`, or use_sim_time:=true for drone.launch; then restart the nodes"
            yield Line(
                WRONG, "clock", f"/use_sim_time is true, but no node publishes /clock, so nodes wait forever: {cure}"
            )
        elif simulated is True and len(tellers) > 1:
            yield Line(WRONG, "clock", f"{', '.join(tellers)} all publish /clock, so time jumps: stop all but one")
        elif simulated is True:
            yield Line(OK, "clock", f"simulated time, published by {tellers[0]}")
        elif tellers:
            said = f"{', '.join(tellers)} publishes /clock, but /use_sim_time is not true, so nodes use real time"
            yield Line(HINT, "clock", f"{said}: `rosparam set /use_sim_time true` before they start")
        else:
            yield Line(OK, "clock", "real time")

    def dead(self) -> Iterator[Line]:
        """Yield a line that names the registered nodes that do not answer."""
        dead = self._unanswered() if self.there else []
        if dead:
            nodes = f"{', '.join(dead)} {'is' if len(dead) == 1 else 'are'} registered and"
            cure = "`rosnode cleanup` removes dead nodes; a node on a machine that you cannot reach may be alive"
            yield Line(HINT, "nodes", f"{nodes} did not answer within {_ANSWERS:g} s: {cure}")

    def _unanswered(self) -> list[str]:
        """Ask all nodes at the same time: looking up the name of a host that is gone may block for 20 s."""
        nodes, alive = self.nodes(), set()

        def ask(node: str) -> None:
            if is_alive(self.uri, node):
                alive.add(node)

        threads = [threading.Thread(target=ask, args=(node,), daemon=True) for node in nodes]
        for thread in threads:
            thread.start()
        end = time.monotonic() + _ANSWERS
        for thread in threads:
            thread.join(max(end - time.monotonic(), 0.0))
        return [node for node in nodes if node not in alive]

    def commands(self) -> Iterator[Line]:
        """Are there commands that nobody hears?"""
        heard = [topic for topic in self.subscribed if topic.endswith("/cmd_vel")]
        for topic, nodes in self.published.items():
            if topic.endswith("cmd_vel") and topic not in self.subscribed:
                cure = f"start it with cmd_vel:={heard[0]}" if heard else "no simulator with a drone is running"
                yield Line(HINT, "commands", f"{', '.join(nodes)} publishes {topic}, which has no subscriber: {cure}")


def simulator(master: Master) -> Iterator[Line]:
    """Yield what the simulators publish on /diagnostics."""
    if not master.there:
        return
    nodes = sorted({node for name, nodes in master.services.items() if name.endswith("/save_scene") for node in nodes})
    if not nodes:
        yield Line(HINT, "simulator", "none is running: `roslaunch drone_sim drone.launch` starts one")
        return
    messages = _wait_for_diagnostics(nodes)
    for node in nodes:
        if node in messages:
            yield from _diagnosed(node, messages[node])
        else:
            said = f"{node} published nothing on /diagnostics within {_DIAGNOSTICS:g} s: stop and restart it"
            yield Line(WRONG, "simulator", said)


def _wait_for_diagnostics(nodes: list[str]) -> dict[str, Any]:
    """Return the first message of each node; without those that publish none within _DIAGNOSTICS."""
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
    complete.wait(_DIAGNOSTICS)
    subscriber.unregister()
    return dict(received)


def _diagnosed(node: str, message: Any) -> Iterator[Line]:
    simulated = False
    for one in message.status:
        what = one.name.removeprefix(f"{node[1:]}: ")
        yield Line(_MARKS.get(one.level, WRONG), what, one.message)
        simulated |= any(pair.key == "stamps" and pair.value.startswith("simulated") for pair in one.values)
    apart = time.time() - message.header.stamp.to_sec()
    if not simulated and abs(apart) > _APART:
        said = f"the clocks of this machine and of {node} differ by {apart:.1f} s: run chrony on both"
        yield Line(HINT, "clock", said)
