"""The cameras in the browser: each on demand, of each the latest picture alone; and what scripts have opened there."""

from __future__ import annotations

import json
import math
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from drone_sim.message_text import shown
from drone_sim.ros.cockpit.panel import overlays
from drone_sim.ros.cockpit.panel.board import Board, one_of
from drone_sim.ros.cockpit.server.page_socket import Answer, PageSocket
from drone_sim.ros.cockpit.topics import ImageTopic
from drone_sim.ros.core import image_messages

_KEPT = 8  # pictures, while their truth is waited for
_BUFFER = 1 << 24  # bytes: more than a picture, or old ones wait in it
_WIDEST, _WIDEST_DEPTHS = 640, 320  # px; of a larger one, every other pixel, or less, is shown
_COLORS = cv2.COLORMAP_TURBO  # near is blue, far is red
_JPEG = (cv2.IMWRITE_JPEG_QUALITY, 80)
_MILLIMETRES = "16UC1"  # REP-118
_KINDS = ("views", "dialogs", "consoles")
_CONNECTING = 3.0  # s, for the simulation to hear of who answers
_LONGEST = 1 << 21  # characters of a message; the simulation's own have less
_KNOWN = {"track": "tracking"}  # what people call it in place of the topic


class CameraSwitches:
    """A switch for each topic of pictures; topics that are switched on are listened to, and shown over the scene."""

    def __init__(self, board: Board, socket: PageSocket):
        """Show on `board` which there are; pictures go through `socket`."""
        self._board, self._socket = board, socket
        self._lock = threading.RLock()  # browsers turn switches, too
        self._sources: dict[str, ImageTopic] = {}
        self._names: dict[str, str] = {}
        self._shown: dict[str, _CameraListener] = {}
        self._views: frozenset[str] = frozenset()
        self._gone: set[str] = set()  # that were shown when they went, as while a scene is loaded
        self._resting = True

    @property
    def shown(self) -> list[str]:
        """The topics that are shown."""
        return list(self._shown)

    def offer(self, sources: tuple[ImageTopic, ...], vehicles: Sequence[str] = ()) -> None:
        """Offer these topics; the names of `vehicles` are used for their captions."""
        with self._lock:
            before, self._sources = self._sources.keys(), {one.topic: one for one in sources}
            self._names = {topic: camera_name(topic, vehicles) for topic in self._sources}
            self._board.show("cameras", [{"topic": topic, "name": name} for topic, name in self._names.items()])
            self._gone |= self._shown.keys() - self._sources.keys()
            for topic in before - self._sources.keys():
                self.turn(topic, False)
            for topic in (self._views | self._gone) & (self._sources.keys() - before):
                self._gone.discard(topic)
                self.turn(topic, True)
            for topic, camera in self._shown.items():
                if camera.source != self._sources[topic]:  # another scene: there is truth now, or none any more
                    camera.listen(False)
                    self._shown[topic] = following = _CameraListener(self._sources[topic])
                    following.listen(not self._resting)

    def turn_asked(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Turn a switch, as a browser asks. Raises ValueError for a topic that there is not."""
        topic = one_of(message, "topic", [*self._sources, *self._shown])
        self.turn(topic, _switch(message))
        return {}

    def overlay_asked(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Show boxes or a mask over a camera's picture, or no more. Raises ValueError for one that is not shown."""
        topic = one_of(message, "topic", [one for one in self._shown if self._sources[one].has_truth])
        kind = one_of(message, "overlay", overlays.KINDS)
        with self._lock:
            self._shown[topic].show_over(kind, _switch(message))
        return {}

    def follow_views(self, topics: frozenset[str]) -> None:
        """Show the cameras of which scripts have opened views since the last call; hide those of closed views."""
        with self._lock:
            before, self._views = self._views, topics
            for topic in before ^ topics:
                self.turn(topic, topic in topics)

    def turn(self, topic: str, on: bool) -> None:
        """Turn a switch; a topic that does not exist cannot be switched on."""
        with self._lock:
            if on and topic in self._sources and topic not in self._shown:
                self._shown[topic] = camera = _CameraListener(self._sources[topic])
                camera.listen(not self._resting)
            elif not on and topic in self._shown:
                self._shown.pop(topic).listen(False)
                self._socket.close_picture(topic)
            else:
                return
            self._socket.tell({"pictures": self.shown})

    def show(self) -> None:
        """Send the latest pictures to the browsers that have shown those before."""
        for topic, camera in list(self._shown.items()):
            if not self._socket.wants_picture(topic):
                continue
            message = camera.take()
            if message is None:
                continue
            try:
                picture, caption = packed(message)
            except ValueError as error:
                rospy.logwarn_throttle(10, f"{topic} is not shown: {error}")
                continue
            name = self._names.get(topic, topic)
            stamp = message.header.stamp.to_sec()
            over = {"step": _step(message), **camera.overlay.said(stamp)} if camera.overlay else {}
            said = {"picture": topic, "name": name, "note": caption, **over}
            self._socket.show_picture(said, camera.overlay.painted(picture, stamp) if camera.overlay else picture)

    def rest(self, resting: bool) -> None:
        """Stop listening while no browser is open (`resting`); afterwards listen again to what is switched on."""
        with self._lock:
            self._resting = resting
            for camera in self._shown.values():
                camera.listen(not resting)


class _CameraListener:
    def __init__(self, source: ImageTopic):
        self.source = source
        self._latest: deque[Any] = deque(maxlen=_KEPT)
        self._subscriber: rospy.Subscriber | None = None
        self.overlay = overlays.Overlay(source.topic) if source.has_truth else None

    def show_over(self, kind: str, on: bool) -> None:
        if self.overlay is not None:
            self.overlay.show(self.overlay.kinds | {kind} if on else self.overlay.kinds - {kind})
            self.overlay.listen(self._subscriber is not None)

    def listen(self, on: bool) -> None:
        source = self.source
        if self.overlay is not None:
            self.overlay.listen(on)
        if on and self._subscriber is None:
            kind = CompressedImage if source.compressed else Image
            topic = source.compressed or source.topic
            self._subscriber = rospy.Subscriber(topic, kind, self._latest.append, queue_size=1, buff_size=_BUFFER)
        elif not on and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    def take(self) -> Any:
        """Return the newest picture since the last time, None where there is none. One thread alone calls this.

        The truth comes a little after its picture: it is waited for, unless it does not come at all.
        """
        came = [*self._latest]
        if self.overlay is not None:
            complete = [one for one in came if self.overlay.has(one.header.stamp.to_sec())]
            came = complete if complete or len(came) < _KEPT else came
        if not came:
            return None
        while self._latest and self._latest.popleft() is not came[-1]:
            pass
        return came[-1]


class ScriptWindows:
    """Tells the browsers of views, dialogs and consoles; a view switches its camera on."""

    def __init__(self, node: str, cameras: CameraSwitches, socket: PageSocket):
        """Begin without listening to `node`; a view switches one of `cameras` on, `socket` tells browsers."""
        self._node = node
        self._cameras, self._socket = cameras, socket
        self._listening: rospy.Subscriber | None = None
        self._answering: rospy.Publisher | None = None
        self._state: dict[str, Any] = {kind: [] for kind in _KINDS}

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers `windows`, `answer` and `camera`."""
        return {
            "windows": lambda _: {"windows": self._state, "pictures": self._cameras.shown},
            "answer": self._answer,
            "camera": self._cameras.turn_asked,
            "overlay": self._cameras.overlay_asked,
        }

    def listen(self, on: bool) -> None:
        """Listen, and be there to answer dialogs, or do neither."""
        if on and self._listening is None:
            self._answering = rospy.Publisher(f"{self._node}/window_answers", String, queue_size=10)
            self._listening = rospy.Subscriber(f"{self._node}/windows", String, self._on_message, queue_size=1)
        elif not on and self._listening is not None and self._answering is not None:
            self._listening.unregister()
            self._answering.unregister()
            self._listening = self._answering = None
            self._show({kind: [] for kind in _KINDS})

    def _on_message(self, message: String) -> None:
        try:
            state = json.loads(message.data) if len(message.data) <= _LONGEST else None
        except (ValueError, RecursionError):
            state = None
        if isinstance(state, Mapping) and all(isinstance(state.get(kind), list) for kind in _KINDS):
            self._show({kind: [one for one in state[kind] if isinstance(one, dict)] for kind in _KINDS})

    def _show(self, state: dict[str, Any]) -> None:
        self._state = state
        self._cameras.follow_views(frozenset(str(one.get("topic")) for one in state["views"] if one.get("topic")))
        self._socket.tell({"windows": state})

    def _answer(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Hand on which button was pressed; the simulation checks it."""
        if self._answering is None:
            raise ValueError("no simulation is there to receive the answer")
        until = time.monotonic() + _CONNECTING
        while not self._answering.get_num_connections() and time.monotonic() < until:
            time.sleep(0.05)  # the first message of a new publisher is heard by nobody
        self._answering.publish(json.dumps({key: message.get(key) for key in ("handle", "button", "typed")}))
        return {}


def camera_name(topic: str, vehicles: Sequence[str] = ()) -> str:
    """Return what a person calls a topic of pictures: front, tracking; with several vehicles: wing, front."""
    plain = topic.strip("/").removesuffix("/image")
    vehicle = next((one for one in vehicles if plain.startswith(f"{one}/")), "")
    own = plain.removeprefix(f"{vehicle}/") if vehicle else plain.partition("/views/")[2] or plain
    known = _KNOWN.get(own, own)
    return f"{vehicle}, {known}" if vehicle and len(vehicles) > 1 else known


def _switch(message: Mapping[str, Any]) -> bool:
    """Return whether a browser asks for on. Raises ValueError."""
    if not isinstance(message.get("on"), bool):
        raise ValueError(f"on = {shown(message.get('on'))}: must be true or false")
    return bool(message["on"])


def _step(message: CompressedImage | Image) -> int:
    """Return n if only each n-th pixel is shown, along each side."""
    if isinstance(message, CompressedImage):
        return 1
    has_bytes = "8" in message.encoding  # rgb8, mono8, 8UC3; all others are depths
    return int(-(-message.width // (_WIDEST if has_bytes else _WIDEST_DEPTHS)))


def packed(message: CompressedImage | Image) -> tuple[bytes, str]:
    """Return a picture as a browser shows it, and a caption. Raises ValueError for one of an unknown kind."""
    if isinstance(message, CompressedImage):
        return bytes(message.data), ""
    encoding, step = message.encoding, _step(message)
    try:
        image = image_messages.pixels(message)
        if image.ndim == 2 and image.dtype != np.uint8:
            depths = image[::step, ::step].astype(np.float32)
            return _depths(depths * (1e-3 if encoding == _MILLIMETRES else 1.0))
        return _encoded(image_messages.bgr(message)[::step, ::step]), ""
    except ValueError as error:
        raise ValueError(f"encoding '{encoding[:40]}': {error}") from None


def _depths(depths: np.ndarray) -> tuple[bytes, str]:
    """Return depths (m) in colours, black where there is none, and the range of these."""
    there = np.isfinite(depths) & (depths > 0)
    if not there.any():
        return _encoded(np.zeros((*depths.shape, 3), np.uint8)), "nothing within range"
    near, far = float(depths[there].min()), float(depths[there].max())
    share = np.log(np.where(there, depths, near) / near) / max(math.log(far / near), 1e-6)  # as eyes see distances
    scaled = (255 * share).astype(np.uint8)
    colored = cv2.applyColorMap(scaled, _COLORS)
    colored[~there] = 0
    return _encoded(colored), f"{near:.2f} m (blue) to {far:.2f} m (red)"


def _encoded(image: np.ndarray) -> bytes:
    return bytes(cv2.imencode(".jpg", image, _JPEG)[1])
