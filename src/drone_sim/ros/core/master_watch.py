"""Report once when the ROS master goes, and once when it comes back; register with a new master, too.

Also connect again to nodes after a network failure. A TCP connection survives a short silence, but not a long one: a
subscriber of rospy's notices after 150 s that nothing comes, closes, and does not connect again until the master tells
it of a publisher. So the node registers again, which makes the master tell the others.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import rosgraph
import rospy
import rospy.core
from rospy.impl.registration import (
    RegManager,
    get_registration_listeners,
    get_service_manager,
    get_topic_manager,
)

from drone_sim.ros.core.network import reached

_PERIOD = 2.0  # s
_PATIENCE = 0.5  # s, for a node to be reached
_USE_SIM_TIME = "/use_sim_time"


class _Peer(NamedTuple):
    """One end of a connection to another node."""

    topic: str
    node: str  # the URI of one that publishes, the name of one that listens
    publishes: bool


class MasterWatch(threading.Thread):
    """Asks the master for its process number now and then; a daemon thread."""

    def __init__(
        self, parameters: Callable[[], Iterable[str]] = tuple, meanwhile: str = "the flight continues"
    ) -> None:
        """Remember the master that the node is registered with.

        `parameters` returns the names of those that the node has set, beside its own; `meanwhile` is what the node
        does without a master.
        """
        super().__init__(name="master watch", daemon=True)
        self._done = threading.Event()
        self._master = rosgraph.Master(rospy.get_name())
        self._parameters: dict[str, Any] = {}
        self._names, self._meanwhile = parameters, meanwhile
        self._before: set[_Peer] = set()  # who was connected
        self._lost: set[_Peer] = set()
        self._pid = self._ask()

    def run(self) -> None:
        """Watch until the node shuts down."""
        lost = False
        rospy.on_shutdown(self._done.set)
        while not self._done.wait(_PERIOD):
            pid = self._ask()
            if pid is None and not lost:
                rospy.logwarn(
                    f"the ROS master does not answer: {self._meanwhile}; only nodes that are connected stay so"
                )
            elif pid is not None and lost and pid == self._pid:
                rospy.logwarn("the ROS master answers again")
            elif pid is not None and pid != self._pid and self._register_again():
                self._pid = pid
                rospy.logwarn("there is a new ROS master: registered this node and its parameters with it")
            lost = pid is None
            if not lost:
                with contextlib.suppress(OSError, rosgraph.MasterException):  # it has gone meanwhile
                    self._find_lost()

    def _ask(self) -> int | None:
        """Return the master's process number, None where it does not answer; remember what it knows of this node."""
        try:
            pid = self._master.getPid()
            if pid == getattr(self, "_pid", pid):
                for name in (rospy.get_name(), _USE_SIM_TIME, *self._names()):
                    with contextlib.suppress(rosgraph.MasterException):  # there is no such parameter
                        self._parameters[name] = self._master.getParam(name)
            return pid
        except (OSError, rosgraph.MasterException):
            return None

    def _register_again(self) -> bool:
        """Tell a new master all that the first one knew of this process; return False where it goes meanwhile.

        rospy does so itself when a node starts before its master, and then only.
        """
        try:
            for name, value in self._parameters.items():
                if not self._master.hasParam(name):
                    self._master.setParam(name, value)
            self._announce(topic for topic, _ in get_topic_manager().get_publications())
            for name, kind in get_topic_manager().get_subscriptions():
                self._subscribe(name, kind)
            for name, service in get_service_manager().get_services():
                self._master.registerService(name, service, rospy.core.get_node_uri())
        except (OSError, rosgraph.MasterException):
            return False
        return True

    # ---- nodes that have been cut off

    def _find_lost(self) -> None:
        """Restore the lost connections to nodes that are registered with the master and can be reached.

        Raises OSError and rosgraph.MasterException where the master does not answer.
        """
        connections = (one[1:5] for one in get_topic_manager().get_pub_sub_info())  # and those that are being made
        now = {_Peer(topic, node, direction == "i") for node, direction, _transport, topic in connections}
        lost, self._lost, self._before = (self._lost | self._before) - now, set(), now
        uris = {peer: self._uri(peer) for peer in lost}
        answers = {uri: reached(uri, _PATIENCE) for uri in set(uris.values())}
        for peer, uri in uris.items():
            if answers[uri]:
                self._meet(peer)
            elif answers[uri] is None:  # its host may come back
                self._lost.add(peer)

    def _uri(self, peer: _Peer) -> str:
        if peer.publishes:
            return peer.node
        try:
            return str(self._master.lookupNode(peer.node))
        except rosgraph.MasterError:  # it has said goodbye
            return ""

    def _meet(self, peer: _Peer) -> None:
        manager = get_topic_manager()
        kinds = dict(manager.get_subscriptions() if peer.publishes else manager.get_publications())
        if peer.topic not in kinds:
            return
        if not peer.publishes:
            self._announce([peer.topic])
        elif peer.node in self._subscribe(peer.topic, kinds[peer.topic]):
            # What that node hears of this one is broken, too, which this one does not know yet.
            self._announce(one.topic for one in self._before if not one.publishes)

    # ---- what rospy has no function for

    def _announce(self, topics: Iterable[str]) -> None:
        """Have the master tell those who listen that this node publishes."""
        told = set(topics)
        for topic, kind in get_topic_manager().get_publications():
            if topic in told:
                self._master.registerPublisher(topic, kind, rospy.core.get_node_uri())

    def _subscribe(self, topic: str, kind: str) -> list[str]:
        """Connect to those that publish a topic, and return their URIs."""
        publishers: list[str] = self._master.registerSubscriber(topic, kind, rospy.core.get_node_uri())
        connector = next(one for one in get_registration_listeners().listeners if isinstance(one, RegManager))
        connector.publisher_update(topic, publishers)
        return publishers
