"""Nodes whose connections a network has broken: they are found again once they can be reached.

TCP holds a connection over a silence, but not over any: a subscriber of rospy's notices after 150 s that nothing comes,
closes, and does not connect again until the master tells it of a publisher. So the master is asked to tell.
"""

from __future__ import annotations

import socket
from collections.abc import Collection
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import rosgraph
import rospy.core
from rospy.impl.registration import RegManager, get_registration_listeners, get_topic_manager

_PATIENCE = 0.5  # s, for a node to be reached


class _Peer(NamedTuple):
    """One end of a connection to another node."""

    topic: str
    node: str  # the URI of one that publishes, the name of one that listens
    publishes: bool


class LostPeers:
    """Compares the connections of this process with those of before; one thread alone calls it."""

    def __init__(self, master: Any) -> None:
        """Ask this master, a rosgraph.Master."""
        self._master = master
        self._before: set[_Peer] = set()
        self._lost: set[_Peer] = set()

    def find(self) -> None:
        """Have those connected again that are lost, registered with the master, and can be reached.

        Raises OSError and rosgraph.MasterException where the master does not answer.
        """
        now = _peers()
        lost, self._lost, self._before = (self._lost | self._before) - now, set(), now
        uris = {peer: self._uri(peer) for peer in lost}
        reached = {uri: _reached(uri) for uri in set(uris.values())}
        for peer, uri in uris.items():
            if reached[uri]:
                self._meet(peer)
            elif reached[uri] is None:  # its host may come back
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
            return
        publishers = self._master.registerSubscriber(peer.topic, kinds[peer.topic], rospy.core.get_node_uri())
        if peer.node in publishers:
            subscribers_connector().publisher_update(peer.topic, publishers)
            # What that node hears of this one is broken, too, which this one does not know yet.
            self._announce({one.topic for one in self._before if not one.publishes})

    def _announce(self, topics: Collection[str]) -> None:
        """Have the master tell those who listen that this node publishes."""
        for topic, kind in get_topic_manager().get_publications():
            if topic in topics:
                self._master.registerPublisher(topic, kind, rospy.core.get_node_uri())


def _peers() -> set[_Peer]:
    """Return who is connected, or is being connected."""
    found = (one[1:5] for one in get_topic_manager().get_pub_sub_info())
    return {_Peer(topic, node, direction == "i") for node, direction, _transport, topic in found}


def _reached(uri: str) -> bool | None:
    """Return whether somebody listens there; None where nothing answers at all."""
    try:
        there = urlsplit(uri)
        if not there.hostname or not there.port:
            return False
        socket.create_connection((there.hostname, there.port), timeout=_PATIENCE).close()
    except (ConnectionRefusedError, socket.gaierror, ValueError):
        return False
    except OSError:
        return None
    return True


def subscribers_connector() -> Any:
    """Return rospy's own object that connects subscribers to publishers: it has no function for that."""
    return next(one for one in get_registration_listeners().listeners if isinstance(one, RegManager))
