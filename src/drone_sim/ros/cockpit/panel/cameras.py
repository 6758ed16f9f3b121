"""The cameras in the browser: each on demand, and of each the latest picture alone."""

from __future__ import annotations

import threading
from typing import Any

import rospy
from sensor_msgs.msg import CompressedImage, Image

from drone_sim.ros.cockpit.found import Source
from drone_sim.ros.cockpit.panel.pictures import packed
from drone_sim.ros.cockpit.server.wire import Wire

_BUFFER = 1 << 24  # bytes: more than a picture, or old ones wait in it


class Cameras:
    """A switch for each topic of pictures; who is switched on is listened to, and shown beside the scene."""

    def __init__(self, gui: Any, wire: Wire):
        """Begin without any."""
        self._gui, self._wire = gui, wire
        self._folder = gui.add_folder("Cameras")
        self._lock = threading.RLock()  # switches are also turned by browsers
        self._sources: dict[str, Source] = {}
        self._switches: dict[str, Any] = {}
        self._shown: dict[str, _Camera] = {}
        self._views: frozenset[str] = frozenset()
        self._resting = True

    @property
    def shown(self) -> list[str]:
        """The topics that are shown."""
        return list(self._shown)

    def offer(self, sources: tuple[Source, ...]) -> None:
        """Offer these."""
        with self._lock:
            self._sources = {one.topic: one for one in sources}
            for topic in self._switches.keys() - self._sources.keys():
                self._switches.pop(topic).remove()
                self._switch(topic, False)
            with self._folder:
                for topic in self._sources:
                    if topic not in self._switches:
                        self._add(topic)

    def _add(self, topic: str) -> None:
        on = topic in self._views
        switch = self._switches[topic] = self._gui.add_checkbox(label(topic), on)
        switch.on_update(lambda event: self._switch(topic, event.target.value))
        self._switch(topic, on)

    def turn(self, topic: str, on: bool) -> None:
        """Turn a switch, as a browser does; a topic that there is not has none."""
        with self._lock:
            switch = self._switches.get(topic)
            if switch is not None and switch.value != on:
                switch.value = on  # which turns it

    def follow_views(self, topics: frozenset[str]) -> None:
        """Show what scripts have opened a view of since, and no more what they have closed."""
        with self._lock:
            before, self._views = self._views, topics
            for topic in before ^ topics:
                self.turn(topic, topic in topics)

    def _switch(self, topic: str, on: bool) -> None:
        with self._lock:
            if on and topic not in self._shown:
                self._shown[topic] = camera = _Camera(self._sources[topic])
                camera.listen(not self._resting)
            elif not on and topic in self._shown:
                self._shown.pop(topic).listen(False)
                self._wire.close_picture(topic)
            else:
                return
            self._wire.tell({"pictures": self.shown})

    def show(self) -> None:
        """Send the latest pictures to the browsers that have shown those before."""
        for topic, camera in list(self._shown.items()):
            if not self._wire.wants_picture(topic):
                continue
            message = camera.take()
            if message is None:
                continue
            try:
                picture, caption = packed(message)
            except ValueError as error:
                rospy.logwarn_throttle(10, f"{topic} is not shown: {error}")
                continue
            self._wire.show_picture({"picture": topic, "name": label(topic), "note": caption}, picture)

    def rest(self, resting: bool) -> None:
        """Listen to nobody while no browser is open, and to those that were switched on again afterwards."""
        with self._lock:
            self._resting = resting
            for camera in self._shown.values():
                camera.listen(not resting)


class _Camera:
    def __init__(self, source: Source):
        self._source = source
        self._message: Any = None
        self._lock = threading.Lock()
        self._subscriber: rospy.Subscriber | None = None

    def listen(self, on: bool) -> None:
        source = self._source
        if on and self._subscriber is None:
            kind = CompressedImage if source.compressed else Image
            topic = source.compressed or source.topic
            self._subscriber = rospy.Subscriber(topic, kind, self._hear, queue_size=1, buff_size=_BUFFER)
        elif not on and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    def _hear(self, message: Any) -> None:
        with self._lock:
            self._message = message

    def take(self) -> Any:
        """Return what has come since the last time, None where nothing has."""
        with self._lock:
            message, self._message = self._message, None
        return message


def label(topic: str) -> str:
    """Return what a person calls a topic of pictures."""
    return topic.strip("/").removesuffix("/image")
