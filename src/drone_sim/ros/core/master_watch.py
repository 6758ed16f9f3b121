"""A thread that reports a lost master, registers with a new one, and reconnects nodes after a network failure.

A TCP connection survives a short network failure, but not a long one: after 150 s without data a subscriber of rospy
closes the connection, and does not connect again until the master sends it the list of publishers. So this thread
registers the node again, which makes the master send that list.
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

from drone_sim.ros.core.network import is_reachable

_PERIOD = 2.0  # s
_CONNECT_TIMEOUT = 0.5  # s
_USE_SIM_TIME = "/use_sim_time"


class _Peer(NamedTuple):
    """Other end of a connection to this node."""

    topic: str
    node: str  # the URI of a publisher, the name of a subscriber
    is_publisher: bool


class MasterWatch(threading.Thread):
    """Daemon thread that polls the master's process number."""

    def __init__(
        self, parameters: Callable[[], Iterable[str]] = tuple, meanwhile: str = "the flight continues"
    ) -> None:
        """Store the process number of the present master.

        `parameters` returns the names of parameters that the node has set outside its namespace; `meanwhile` says, in
        a log line, what the node does without a master.
        """
        super().__init__(name="master watch", daemon=True)
        self._done = threading.Event()
        self._master = rosgraph.Master(rospy.get_name())
        self._parameters: dict[str, Any] = {}
        self._names, self._meanwhile = parameters, meanwhile
        self._connected: set[_Peer] = set()  # at the last poll
        self._lost: set[_Peer] = set()
        self._pid: int | None = None
        self._pid = self._poll()

    def run(self) -> None:
        is_lost = False
        rospy.on_shutdown(self._done.set)
        while not self._done.wait(_PERIOD):
            pid = self._poll()
            if pid is None and not is_lost:
                rospy.logwarn(
                    f"the ROS master does not answer: {self._meanwhile}; only nodes that are connected stay so"
                )
            elif pid is not None and is_lost and pid == self._pid:
                rospy.logwarn("the ROS master answers again")
            elif pid is not None and pid != self._pid and self._register_again():
                self._pid = pid
                rospy.logwarn("there is a new ROS master: registered this node and its parameters with it")
            is_lost = pid is None
            if not is_lost:
                with contextlib.suppress(OSError, rosgraph.MasterException):  # the master has just gone
                    self._reconnect_lost()

    def _poll(self) -> int | None:
        """Return the master's process number, or None without an answer; copy this node's parameters from it."""
        try:
            pid: int = self._master.getPid()
            if self._pid in (None, pid):
                for name in (rospy.get_name(), _USE_SIM_TIME, *self._names()):
                    with contextlib.suppress(rosgraph.MasterException):  # there is no such parameter
                        self._parameters[name] = self._master.getParam(name)
            return pid
        except (OSError, rosgraph.MasterException):
            return None

    def _register_again(self) -> bool:
        """Register this node's parameters, topics and services with a new master; return False if it stops answering.

        rospy does this itself only when a node starts before its master.
        """
        try:
            for name, value in self._parameters.items():
                if not self._master.hasParam(name):
                    self._master.setParam(name, value)
            self._register_publishers(topic for topic, _ in get_topic_manager().get_publications())
            for name, kind in get_topic_manager().get_subscriptions():
                self._subscribe(name, kind)
            for name, service in get_service_manager().get_services():
                self._master.registerService(name, service, rospy.core.get_node_uri())
        except (OSError, rosgraph.MasterException):
            return False
        return True

    # ---- lost connections

    def _reconnect_lost(self) -> None:
        """Restore lost connections to nodes that are registered with the master and reachable.

        Raises OSError and rosgraph.MasterException if the master does not answer.
        """
        # get_pub_sub_info also lists connections that are being made.
        connections = (info[1:5] for info in get_topic_manager().get_pub_sub_info())
        connected = {_Peer(topic, node, direction == "i") for node, direction, _transport, topic in connections}
        lost, self._lost, self._connected = (self._lost | self._connected) - connected, set(), connected
        uris = {peer: self._uri(peer) for peer in lost}
        is_up = {uri: is_reachable(uri, _CONNECT_TIMEOUT) for uri in set(uris.values())}
        for peer, uri in uris.items():
            if is_up[uri]:
                self._reconnect(peer)
            elif is_up[uri] is None:  # its host may come back
                self._lost.add(peer)

    def _uri(self, peer: _Peer) -> str:
        if peer.is_publisher:
            return peer.node
        try:
            return str(self._master.lookupNode(peer.node))
        except rosgraph.MasterError:  # the node has unregistered
            return ""

    def _reconnect(self, peer: _Peer) -> None:
        manager = get_topic_manager()
        kinds = dict(manager.get_subscriptions() if peer.is_publisher else manager.get_publications())
        if peer.topic not in kinds:
            return
        if not peer.is_publisher:
            self._register_publishers([peer.topic])
        elif peer.node in self._subscribe(peer.topic, kinds[peer.topic]):
            # Connections in the other direction are broken, too, but rospy may not have noticed yet.
            self._register_publishers(peer.topic for peer in self._connected if not peer.is_publisher)

    def _register_publishers(self, topics: Iterable[str]) -> None:
        """Register this node as a publisher again, which makes the master notify the subscribers."""
        names = set(topics)
        for topic, kind in get_topic_manager().get_publications():
            if topic in names:
                self._master.registerPublisher(topic, kind, rospy.core.get_node_uri())

    def _subscribe(self, topic: str, kind: str) -> list[str]:
        """Register as a subscriber again, connect to the publishers, and return their URIs."""
        publishers: list[str] = self._master.registerSubscriber(topic, kind, rospy.core.get_node_uri())
        listeners = get_registration_listeners().listeners
        connector = next(listener for listener in listeners if isinstance(listener, RegManager))
        connector.publisher_update(topic, publishers)
        return publishers
