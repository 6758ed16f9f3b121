"""Say it, once each way, when the ROS master goes and when it comes back; be found by a new one, too.

And by nodes that have been cut off: see lost_peers.py.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable
from typing import Any

import rosgraph
import rospy
import rospy.core
from rospy.impl.registration import get_service_manager, get_topic_manager

from drone_sim.ros.node.lost_peers import LostPeers, subscribers_connector

_PERIOD = 2.0  # s
_USE_SIM_TIME = "/use_sim_time"


class MasterWatch(threading.Thread):
    """Asks the master for its process number now and then; a daemon thread."""

    def __init__(self, parameters: Callable[[], Iterable[str]] = tuple, meanwhile: str = "flying on") -> None:
        """Remember the master that the node is registered with.

        `parameters` returns the names of those that the node has set, beside its own; `meanwhile` is what the node
        does without a master.
        """
        super().__init__(name="master watch", daemon=True)
        self._done = threading.Event()
        self._master = rosgraph.Master(rospy.get_name())
        self._parameters: dict[str, Any] = {}
        self._names, self._meanwhile = parameters, meanwhile
        self._pid = self._ask()
        self._lost_peers = LostPeers(self._master)

    def run(self) -> None:
        """Watch until the node shuts down."""
        lost = False
        rospy.on_shutdown(self._done.set)
        while not self._done.wait(_PERIOD):
            pid = self._ask()
            if pid is None and not lost:
                rospy.logwarn(
                    f"the ROS master is gone: {self._meanwhile}; connected nodes stay connected, new ones cannot join"
                )
            elif pid is not None and lost and pid == self._pid:
                rospy.logwarn("the ROS master answers again")
            elif pid is not None and pid != self._pid and self._register_again():
                self._pid = pid
                rospy.logwarn("a new ROS master is there: registered again, with the parameters as they were")
            lost = pid is None
            if not lost:
                with contextlib.suppress(OSError, rosgraph.MasterException):  # it has gone meanwhile
                    self._lost_peers.find()

    def _ask(self) -> int | None:
        """Return the master's process number, None where it does not answer; remember what it knows of this node."""
        try:
            pid = self._master.getPid()
            if pid == getattr(self, "_pid", pid):
                self._remember()
            return pid
        except (OSError, rosgraph.MasterException):
            return None

    def _remember(self) -> None:
        for name in (rospy.get_name(), _USE_SIM_TIME, *self._names()):
            with contextlib.suppress(rosgraph.MasterException):  # there is no such parameter
                self._parameters[name] = self._master.getParam(name)

    def _register_again(self) -> bool:
        """Tell a new master all that the first one knew of this process; return False where it goes meanwhile.

        rospy has no function for that. This is what it does itself when a node starts before its master.
        """
        uri = rospy.core.get_node_uri()
        connector = subscribers_connector()
        try:
            for name, value in self._parameters.items():
                if not self._master.hasParam(name):
                    self._master.setParam(name, value)
            for name, kind in get_topic_manager().get_publications():
                self._master.registerPublisher(name, kind, uri)
            for name, kind in get_topic_manager().get_subscriptions():
                connector.publisher_update(name, self._master.registerSubscriber(name, kind, uri))
            for name, service in get_service_manager().get_services():
                self._master.registerService(name, service, uri)
        except (OSError, rosgraph.MasterException):
            return False
        return True
