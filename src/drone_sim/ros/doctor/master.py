"""The ROS master, and what it knows of."""

from __future__ import annotations

import http.client
import os
import xmlrpc.client
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

from drone_sim.ros.doctor.line import HINT, OK, WRONG, Line
from drone_sim.ros.doctor.network import MASTER, PATIENCE, addresses

_ME = "/drone_sim_doctor"
_ENOUGH = 5  # nodes that do not answer: each takes its time
_START = "`roslaunch drone_sim drone.launch` starts one"
FAILURES = (OSError, http.client.HTTPException, xmlrpc.client.Error, ValueError)

Graph = dict[str, list[str]]  # nodes by topic, or by service


class _Transport(xmlrpc.client.Transport):
    """Gives up after a while."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = PATIENCE
        return connection


def asked(uri: str, call: str, *arguments: Any) -> Any:
    """Return what a master, or a node, answers to a call of ROS's XML-RPC API. Raises one of FAILURES."""
    answer = getattr(xmlrpc.client.ServerProxy(uri, transport=_Transport()), call)(_ME, *arguments)
    if not isinstance(answer, list) or len(answer) != 3:
        raise ValueError("no answer of ROS's")
    code, said, value = answer
    if code != 1:
        raise ValueError(str(said))
    return value


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
            there = urlsplit(self.uri)
            host, port = there.hostname, there.port or 80
        except ValueError:  # of the port
            host, port = None, 0
        if not host or urlsplit(self.uri).scheme != "http":
            yield Line(WRONG, "master", f"ROS_MASTER_URI = '{self.uri}' must be like {MASTER}")
            return
        try:
            addresses(host)
        except OSError:
            yield Line(WRONG, "master", f"ROS_MASTER_URI = '{self.uri}': the host '{host}' is not known")
            return
        yield self._asked(port)

    def _asked(self, port: int) -> Line:
        try:
            graph = asked(self.uri, "getSystemState")
            self.published, self.subscribed, self.services = (dict(one) for one in graph)
        except ConnectionRefusedError:
            return Line(HINT, "master", f"none at {self.uri}: {_START}")
        except FAILURES as error:
            why = f"HTTP {error.errcode}" if isinstance(error, xmlrpc.client.ProtocolError) else str(error)
            said = f"port {port} of {self.uri} does not answer as a master ({why or type(error).__name__})"
            return Line(
                WRONG, "master", f"{said}: end what listens there, or `export ROS_MASTER_URI=` with another port"
            )
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
            simulated = asked(self.uri, "getParam", "/use_sim_time")
        except FAILURES:
            simulated = False
        tellers = self.published.get("/clock", [])
        if simulated is True and not tellers:
            cure = "`rosparam set /use_sim_time false`, or use_sim_time:=true for drone.launch; then start them anew"
            yield Line(
                WRONG, "clock", f"/use_sim_time is true, and nobody publishes /clock: nodes wait for ever: {cure}"
            )
        elif simulated is True and len(tellers) > 1:
            yield Line(WRONG, "clock", f"{', '.join(tellers)} all publish /clock: time jumps; end all but one")
        elif simulated is True:
            yield Line(OK, "clock", f"simulated time, told by {tellers[0]}")
        elif tellers:
            said = f"{', '.join(tellers)} publishes /clock, but /use_sim_time is not true: nodes go by real time"
            yield Line(HINT, "clock", f"{said}; set it before they start")
        else:
            yield Line(OK, "clock", "real time")

    def dead(self) -> Iterator[Line]:
        """Are there nodes that have gone without a word?"""
        gone = 0
        for node in self.nodes() if self.there else ():
            try:
                asked(asked(self.uri, "lookupNode", node), "getPid")
            except FAILURES:
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
                yield Line(HINT, "commands", f"{', '.join(nodes)} publishes {topic}, which nobody hears: {cure}")

    def simulators(self) -> list[str]:
        """Return the names of the nodes that are ours."""
        return sorted({node for name, nodes in self.services.items() if name.endswith("/save_scene") for node in nodes})
