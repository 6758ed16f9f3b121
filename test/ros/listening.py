"""Follow topics and wait for what they say; used by the tests with a master."""

import threading
import time

import rospy


class Listener:
    """Keeps every message of one topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self._came = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, kind, self._keep)

    def _keep(self, message):
        with self._came:
            self.messages.append(message)
            self._came.notify_all()

    def close(self):
        self._subscriber.unregister()

    def wait_for(self, condition=lambda message: True, after=None, timeout=90.0):
        """Return the first message that fulfils `condition`, of those that come after `after` messages."""
        start = len(self.messages) if after is None else after
        with self._came:
            if self._came.wait_for(lambda: any(map(condition, self.messages[start:])), timeout):
                return next(filter(condition, self.messages[start:]))
        raise AssertionError(f"nothing such on {self._subscriber.resolved_name} in {timeout} s")


def connected(publisher, listeners=1):
    patience, end = threading.Event(), time.monotonic() + 120.0
    while publisher.get_num_connections() < listeners:
        assert not rospy.is_shutdown() and time.monotonic() < end, f"nobody hears {publisher.resolved_name}"
        patience.wait(0.02)
    return publisher
