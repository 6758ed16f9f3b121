"""Helpers of the tests with a ROS master: listen to a topic, and wait for subscribers."""

import threading
import time

import rospy


class Listener:
    """Subscriber that stores every message of one topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self._arrival = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, kind, self._store)

    def _store(self, message):
        with self._arrival:
            self.messages.append(message)
            self._arrival.notify_all()

    def close(self):
        self._subscriber.unregister()

    def wait_for(self, condition=lambda message: True, after=None, timeout=90.0):
        """Return the first message that fulfils `condition`, without the first `after` messages (None: all so far)."""
        start = len(self.messages) if after is None else after
        with self._arrival:
            if self._arrival.wait_for(lambda: any(map(condition, self.messages[start:])), timeout):
                return next(filter(condition, self.messages[start:]))
        raise AssertionError(f"nothing such on {self._subscriber.resolved_name} in {timeout} s")


def connected(publisher, listeners=1):
    pause, end = threading.Event(), time.monotonic() + 120.0
    while publisher.get_num_connections() < listeners:
        assert not rospy.is_shutdown() and time.monotonic() < end, f"{publisher.resolved_name} has no subscriber"
        pause.wait(0.02)
    return publisher
