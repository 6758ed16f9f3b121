"""Say it, once each way, when the ROS master goes and when it comes back."""

from __future__ import annotations

import threading

import rosgraph
import rospy

_PERIOD = 2.0  # s


class MasterWatch(threading.Thread):
    """Asks the master for its process number now and then; a daemon thread."""

    def __init__(self) -> None:
        """Remember the master that the node is registered with."""
        super().__init__(name="master watch", daemon=True)
        self._done = threading.Event()
        self._master = rosgraph.Master(rospy.get_name())
        self._pid = self._ask()

    def run(self) -> None:
        """Watch until the node shuts down."""
        lost = False
        rospy.on_shutdown(self._done.set)
        while not self._done.wait(_PERIOD):
            pid = self._ask()
            if pid is None and not lost:
                rospy.logwarn("the ROS master is gone: flying on; connected nodes stay connected, new ones cannot join")
            elif pid is not None and lost and pid == self._pid:
                rospy.logwarn("the ROS master answers again")
            elif pid is not None and pid != self._pid:
                self._pid = pid
                rospy.logwarn(
                    "a new ROS master is there, which does not know this node: restart it to be found by others"
                )
            lost = pid is None

    def _ask(self) -> int | None:
        try:
            return self._master.getPid()
        except (OSError, rosgraph.MasterException):
            return None
