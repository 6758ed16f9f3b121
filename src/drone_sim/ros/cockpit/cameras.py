"""The drones' cameras in the browser: each on demand, and of each the latest picture alone."""

from __future__ import annotations

import threading
from typing import Any

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import CompressedImage

_BUFFER = 1 << 22  # bytes


class Cameras:
    """A switch for each compressed image topic; who is switched on is listened to, and shown."""

    def __init__(self, gui: Any):
        """Begin without any."""
        self._gui = gui
        self._folder = gui.add_folder("Cameras")
        self._switches: dict[str, Any] = {}
        self._shown: dict[str, _Camera] = {}

    def offer(self, topics: tuple[str, ...]) -> None:
        """Offer these topics."""
        for topic in self._switches.keys() - set(topics):
            self._switches.pop(topic).remove()
            self._switch(topic, False)
        with self._folder:
            for topic in topics:
                if topic not in self._switches:
                    switch = self._switches[topic] = self._gui.add_checkbox(_label(topic), False)
                    switch.on_update(lambda event, topic=topic: self._switch(topic, event.target.value))

    def _switch(self, topic: str, on: bool) -> None:
        if on and topic not in self._shown:
            with self._folder:
                self._shown[topic] = _Camera(self._gui, topic)
        elif not on and topic in self._shown:
            self._shown.pop(topic).close()

    def show(self) -> None:
        """Show the latest pictures."""
        for camera in list(self._shown.values()):
            camera.show()

    def rest(self, resting: bool) -> None:
        """Listen to nobody while no browser is open, and to those that were switched on again afterwards."""
        for camera in list(self._shown.values()):
            camera.listen(not resting)


class _Camera:
    def __init__(self, gui: Any, topic: str):
        self._topic = topic
        self._lock = threading.Lock()
        self._message: CompressedImage | None = None
        self._subscriber: rospy.Subscriber | None = None
        self._image = gui.add_image(np.zeros((3, 4, 3), np.uint8), label=_label(topic), format="jpeg")
        self.listen(True)

    def listen(self, on: bool) -> None:
        if on and self._subscriber is None:
            self._subscriber = rospy.Subscriber(
                self._topic, CompressedImage, self._hear, queue_size=1, buff_size=_BUFFER
            )
        elif not on and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    def _hear(self, message: CompressedImage) -> None:
        with self._lock:
            self._message = message

    def show(self) -> None:
        with self._lock:
            message, self._message = self._message, None
        if message is not None:
            picture = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
            if picture is not None:
                self._image.image = cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        self.listen(False)
        self._image.remove()


def _label(topic: str) -> str:
    return topic.strip("/").removesuffix("/compressed").removesuffix("/image")
