"""The ROS master, what it knows of, and what the simulator says of itself, where it runs."""

from __future__ import annotations

import os
import threading
import time
import xmlrpc.client
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

from drone_sim.ros.core.network import FAILURES, MASTER, answers, call, check_master_uri
from drone_sim.ros.doctor import HINT, OK, WRONG, Line

_DIAGNOSTICS = 4.0  # s; it speaks once a second
_MARKS = {0: OK, 1: HINT}
_APART = 1.0  # s, between this machine's clock and that of the simulator
_ENOUGH = 5  # nodes that do not answer: each takes its time
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
            return Line(HINT, "master", f"none at {self.uri}: {_START}")
        except FAILURES as error:
            why = f"HTTP {error.errcode}" if isinstance(error, xmlrpc.client.ProtocolError) else str(error)
            said = f"port {port} of {self.uri} does not answer as a master ({why or type(error).__name__})"
            cure = "end what listens there, or `export ROS_MASTER_URI=` with another port"
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
            cure = "`rosparam set /use_sim_time false`, or use_sim_time:=true for drone.launch; then start them anew"
            yield Line(
                WRONG, "clock", f"/use_sim_time is true, and nobody publishes /clock: nodes wait forever: {cure}"
            )
        elif simulated is True and len(tellers) > 1:
            yield Line(WRONG, "clock", f"{', '.join(tellers)} all publish /clock: time jumps; end all but one")
        elif simulated is True:
            yield Line(OK, "clock", f"simulated time, from {tellers[0]}")
        elif tellers:
            said = f"{', '.join(tellers)} publishes /clock, but /use_sim_time is not true: nodes go by real time"
            yield Line(HINT, "clock", f"{said}; set it before they start")
        else:
            yield Line(OK, "clock", "real time")

    def dead(self) -> Iterator[Line]:
        """Are there nodes that have gone without a word?"""
        gone = 0
        for node in self.nodes() if self.there else ():
            if not answers(self.uri, node):
                gone += 1
                cure = "`rosnode cleanup` removes it, if it is not just another machine that cannot be reached"
                yield Line(HINT, "nodes", f"{node} is registered and does not answer: {cure}")
            if gone == _ENOUGH:
                return

    def commands(self) -> Iterator[Line]:
        """Are there commands that nobody hears?"""
        heard = [topic for topic in self.subscribed if topic.endswith("/cmd_vel")]
        for topic, nodes in self.published.items():
            if topic.endswith("cmd_vel") and topic not in self.subscribed:
                cure = f"start it with cmd_vel:={heard[0]}" if heard else "no drone is there to hear it"
                yield Line(HINT, "commands", f"{', '.join(nodes)} publishes {topic}, which nobody receives: {cure}")


def simulator(master: Master) -> Iterator[Line]:
    """Listen to its diagnostics."""
    if not master.there:
        return
    nodes = sorted({node for name, nodes in master.services.items() if name.endswith("/save_scene") for node in nodes})
    if not nodes:
        yield Line(HINT, "simulator", "does not run: `roslaunch drone_sim drone.launch`")
    for node in nodes:
        message = _wait_for_diagnostics(node)
        if message is None:
            yield Line(
                WRONG, "simulator", f"{node} says nothing on /diagnostics in {_DIAGNOSTICS:g} s: end and restart it"
            )
            continue
        yield from _diagnosed(node, message)


def _wait_for_diagnostics(node: str) -> Any:
    """Return the first of its messages, or None where none comes in time."""
    import rospy
    from diagnostic_msgs.msg import DiagnosticArray

    if not rospy.core.is_initialized():
        rospy.init_node("drone_sim_doctor", anonymous=True, disable_signals=True, disable_rostime=True)
    heard: list[Any] = []
    came = threading.Event()

    def take(message: Any) -> None:
        if not heard and any(one.name.startswith(f"{node[1:]}: ") for one in message.status):
            heard.append(message)
            came.set()

    subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, take)
    came.wait(_DIAGNOSTICS)
    subscriber.unregister()
    return heard[0] if heard else None


def _diagnosed(node: str, message: Any) -> Iterator[Line]:
    simulated = False
    for one in message.status:
        what = one.name.removeprefix(f"{node[1:]}: ")
        yield Line(_MARKS.get(one.level, WRONG), what, one.message)
        simulated |= any(pair.key == "stamps" and pair.value.startswith("simulated") for pair in one.values)
    apart = time.time() - message.header.stamp.to_sec()
    if not simulated and abs(apart) > _APART:
        said = (
            f"the clocks here and of {node} are {apart:.1f} s apart: transforms and pictures will not fit; run chrony"
        )
        yield Line(HINT, "clock", said)
