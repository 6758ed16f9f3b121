"""A backend that records the messages that scripts publish."""

from typing import Any, NamedTuple


class Published(NamedTuple):
    topic: str
    kind: str
    message: Any


class Recorder:
    def __init__(self):
        self.published = []

    def subscribe(self, topic, kind, take):
        return lambda: None

    def advertise(self, topic, kind, queue, latch):
        return _Topic(self.published, topic, kind)

    def advertise_image(self, topic, queue):
        return _Topic(self.published, topic, "sensor_msgs/Image")


class _Topic:
    def __init__(self, published, topic, kind):
        self._published, self._topic, self._kind = published, topic, kind

    def publish(self, message):
        self._published.append(Published(self._topic, self._kind, message))

    def subscribers(self):
        return 1

    def shutdown(self):
        pass
