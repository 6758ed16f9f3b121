"""Pictures of cameras in the browser, boxes and masks over them, and windows that scripts have opened."""

from __future__ import annotations

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import rospy
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from drone_sim.message_text import shown
from drone_sim.ros.cockpit.panel.board import Board, one_of
from drone_sim.ros.cockpit.server.page_socket import Answer, PageSocket
from drone_sim.ros.cockpit.topics import ImageTopic, read_json

_MAX_PICTURES = 8  # that wait for their truth; and messages of truth that wait for their picture
_TOLERANCE = 1e-6  # s, between equal stamps
_FLOOR = "Floor"  # its box, which is the whole picture, is not drawn
_BUFFER = 1 << 24  # bytes; with a smaller buffer than a picture, old pictures would be shown
_MAX_WIDTH, _MAX_DEPTH_WIDTH = 640, 320  # px; of a wider picture, only every n-th pixel is shown
_WINDOWS = ("views", "dialogs", "consoles")
BOXES, MASK = OVERLAYS = ("boxes", "mask")
_MAX_LENGTH = 1 << 21  # characters of a message; the simulation's are shorter
_CONNECT_TIMEOUT = 10.0  # s, for the simulation to subscribe to answers; rospy connects again after 0.5, 1, 2 and 4 s
_NAMES = {"track": "tracking"}  # names for people, by topic


class CameraSwitches:
    """A switch for each topic of pictures. Pictures of topics that are on are shown over the scene."""

    def __init__(self, board: Board, socket: PageSocket):
        """`board` lists the topics; pictures go through `socket`."""
        self._board, self._socket = board, socket
        self._lock = threading.RLock()  # browsers' threads turn switches, too
        self._sources: dict[str, ImageTopic] = {}
        self._names: dict[str, str] = {}
        self._shown: dict[str, _Camera] = {}
        self._views: frozenset[str] = frozenset()
        self._gone: set[str] = set()  # topics that were on when they disappeared, as while a scene is loaded
        self._resting = True

    @property
    def shown(self) -> list[str]:
        """The topics that are on."""
        return list(self._shown)

    def offer(self, sources: tuple[ImageTopic, ...], vehicles: Sequence[str] = ()) -> None:
        """Replace the topics. Their captions contain the names of `vehicles`."""
        with self._lock:
            before, self._sources = self._sources.keys(), {source.topic: source for source in sources}
            self._names = {topic: camera_name(topic, vehicles) for topic in self._sources}
            self._board.show("cameras", [{"topic": topic, "name": name} for topic, name in self._names.items()])
            self._gone |= self._shown.keys() - self._sources.keys()
            for topic in before - self._sources.keys():
                self.turn(topic, False)
            for topic in (self._views | self._gone) & (self._sources.keys() - before):
                self._gone.discard(topic)
                self.turn(topic, True)
            for topic, camera in self._shown.items():
                if camera.source != self._sources[topic]:  # in another scene the camera may have truth, or none
                    camera.listen(False)
                    self._shown[topic] = replacement = _Camera(self._sources[topic])
                    replacement.listen(not self._resting)

    def answer_camera(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Turn a switch, as a browser requests. Raises ValueError for an unknown topic."""
        topic = one_of(message, "topic", [*self._sources, *self._shown])
        self.turn(topic, _is_on(message))
        return {}

    def answer_overlay(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Show or hide boxes or a mask over a camera's picture. Raises ValueError if the camera is not shown."""
        topic = one_of(message, "topic", [topic for topic in self._shown if self._sources[topic].has_truth])
        kind = one_of(message, "overlay", OVERLAYS)
        with self._lock:
            camera = self._shown[topic]
            camera.overlays = camera.overlays | {kind} if _is_on(message) else camera.overlays - {kind}
            camera.listen(not self._resting)
        return {}

    def follow_views(self, topics: frozenset[str]) -> None:
        """Switch cameras on for views that scripts have opened since the last call, and off for closed views."""
        with self._lock:
            before, self._views = self._views, topics
            for topic in before ^ topics:
                self.turn(topic, topic in topics)

    def turn(self, topic: str, on: bool) -> None:
        """Turn a switch on or off; do nothing for an unknown topic."""
        with self._lock:
            if on and topic in self._sources and topic not in self._shown:
                self._shown[topic] = camera = _Camera(self._sources[topic])
                camera.listen(not self._resting)
            elif not on and topic in self._shown:
                self._shown.pop(topic).listen(False)
                self._socket.close_picture(topic)
            else:
                return
            self._socket.tell({"pictures": self.shown})

    def show(self) -> None:
        """Send the latest pictures to the browsers that have shown the last ones."""
        for topic, camera in list(self._shown.items()):
            if not self._socket.wants_picture(topic):
                continue
            message = camera.take()
            if message is None:
                continue
            try:
                picture, caption = encode(message)
            except ValueError as error:
                rospy.logwarn_throttle(10, f"{topic} is not shown: {error}")
                continue
            header: dict[str, Any] = {"picture": topic, "name": self._names.get(topic, topic), "note": caption}
            if camera.source.has_truth:
                picture, truth = camera.add_truth(picture, message.header.stamp.to_sec())
                header |= {"step": _step(message), **truth}
            self._socket.show_picture(header, picture)

    def rest(self, resting: bool) -> None:
        """Unsubscribe while no browser is open (`resting`); otherwise subscribe to the topics that are on."""
        with self._lock:
            self._resting = resting
            for camera in self._shown.values():
                camera.listen(not resting)


class _Camera:
    """Subscriptions to a camera's pictures and, while they are shown, to its boxes and masks."""

    def __init__(self, source: ImageTopic):
        self.source = source
        self.overlays: frozenset[str] = frozenset()  # those of OVERLAYS that are shown
        self._pictures: deque[Any] = deque(maxlen=_MAX_PICTURES)
        self._categories: dict[int, str] = {}
        self._boxes: deque[tuple[float, list[dict[str, Any]]]] = deque(maxlen=_MAX_PICTURES)  # by stamp, s
        self._masks: deque[tuple[float, Image]] = deque(maxlen=_MAX_PICTURES)  # by stamp, s
        self._subscribers: dict[str, rospy.Subscriber] = {}

    def listen(self, on: bool) -> None:
        """Subscribe to the pictures, and to the truth for `overlays`; to nothing if not `on`."""
        topics: dict[str, tuple[type, Callable[[Any], None]]] = {}
        if on:
            kind = CompressedImage if self.source.compressed else Image
            topics[self.source.compressed or self.source.topic] = kind, self._pictures.append
        truth = f"{self.source.topic}/truth"
        if on and self.overlays:
            topics[f"{truth}/labels"] = String, self._on_labels
        if on and BOXES in self.overlays:
            topics[f"{truth}/boxes"] = String, self._on_boxes
        if on and MASK in self.overlays:
            topics[f"{truth}/categories"] = Image, self._on_mask
        for topic in self._subscribers.keys() - topics.keys():
            self._subscribers.pop(topic).unregister()
        for topic in topics.keys() - self._subscribers.keys():
            self._subscribers[topic] = rospy.Subscriber(topic, *topics[topic], queue_size=1, buff_size=_BUFFER)

    def _on_labels(self, message: String) -> None:
        categories = (read_json(message, _MAX_LENGTH) or {}).get("categories")
        if isinstance(categories, Mapping):
            self._categories = {int(key): str(name) for key, name in categories.items() if str(key).isdigit()}

    def _on_boxes(self, message: String) -> None:
        content = read_json(message, _MAX_LENGTH) or {}
        if isinstance(content.get("stamp"), float) and isinstance(content.get("objects"), list):
            boxes = [box for box in content["objects"] if isinstance(box, dict)]
            self._boxes.append((content["stamp"], boxes))

    def _on_mask(self, message: Image) -> None:
        self._masks.append((message.header.stamp.to_sec(), message))

    def take(self) -> Any:
        """Return the newest picture since the last call, or None. Only one thread calls this.

        A picture waits for the truth of its stamp, which comes a little later, but not for ever.
        """
        truths = [self._boxes if overlay == BOXES else self._masks for overlay in self.overlays]

        def is_complete(picture: Any) -> bool:
            stamp = picture.header.stamp.to_sec()
            return all(any(abs(at - stamp) < _TOLERANCE for at, _ in [*messages]) for messages in truths)

        pictures = [*self._pictures]
        complete = list(filter(is_complete, pictures))
        pictures = complete if complete or len(pictures) < _MAX_PICTURES else pictures
        if not pictures:
            return None
        while self._pictures and self._pictures.popleft() is not pictures[-1]:
            pass
        return pictures[-1]

    def add_truth(self, picture: bytes, stamp: float) -> tuple[bytes, dict[str, Any]]:
        """Return a picture (JPEG or PNG) with the mask of its stamp (s) over it, if that is shown and has come.

        Also return the boxes (px) and the legend that the page itself draws.
        """
        if not self.overlays:
            return picture, {"overlays": [], "boxes": [], "legend": []}
        from drone_sim.ros.cockpit.panel.image_conversion import css_color, with_mask  # slow import

        colors = {name: css_color(number) for number, name in self._categories.items()}
        boxes = _nearest(self._boxes, stamp) or [] if BOXES in self.overlays else []
        shown = [
            {"name": box.get("name"), "box": box.get("visible"), "color": colors.get(str(box.get("category")), "#fff")}
            for box in boxes
            if box.get("name") != _FLOOR
        ]
        legend: list[dict[str, str]] = []
        message = _nearest(self._masks, stamp) if MASK in self.overlays else None
        if message is not None:
            picture, numbers = with_mask(picture, message)
            names = {number: self._categories.get(number) for number in numbers}
            legend = [{"name": name, "color": css_color(number)} for number, name in names.items() if name is not None]
        return picture, {"overlays": sorted(self.overlays), "boxes": shown, "legend": legend}


def _nearest(messages: deque[tuple[float, Any]], stamp: float) -> Any:
    """Return the message whose stamp is nearest to `stamp`; None if there are none."""
    return min([*messages], key=lambda message: abs(message[0] - stamp), default=(0.0, None))[1]


class ScriptWindows:
    """Sends views, dialogs and consoles of scripts to the browsers; a view switches its camera on."""

    def __init__(self, node: str, cameras: CameraSwitches, socket: PageSocket):
        """`listen` subscribes to the windows of `node`."""
        self._node = node
        self._cameras, self._socket = cameras, socket
        self._subscriber: rospy.Subscriber | None = None
        self._publisher: rospy.Publisher | None = None
        self._state: dict[str, Any] = {kind: [] for kind in _WINDOWS}

    @property
    def answers(self) -> dict[str, Answer]:
        return {
            "windows": lambda _: {"windows": self._state, "pictures": self._cameras.shown},
            "answer": self._answer_dialog,
            "camera": self._cameras.answer_camera,
            "overlay": self._cameras.answer_overlay,
        }

    def listen(self, on: bool) -> None:
        """Subscribe to windows and advertise answers, or end both."""
        if on and self._subscriber is None:
            self._publisher = rospy.Publisher(f"{self._node}/window_answers", String, queue_size=10)
            self._subscriber = rospy.Subscriber(f"{self._node}/windows", String, self._on_message, queue_size=1)
        elif not on and self._subscriber is not None and self._publisher is not None:
            self._subscriber.unregister()
            self._publisher.unregister()
            self._subscriber = self._publisher = None
            self._show({kind: [] for kind in _WINDOWS})

    def _on_message(self, message: String) -> None:
        state = read_json(message, _MAX_LENGTH) or {}
        if all(isinstance(state.get(kind), list) for kind in _WINDOWS):
            self._show({kind: [window for window in state[kind] if isinstance(window, dict)] for kind in _WINDOWS})

    def _show(self, state: dict[str, Any]) -> None:
        self._state = state
        self._cameras.follow_views(frozenset(str(view.get("topic")) for view in state["views"] if view.get("topic")))
        self._socket.tell({"windows": state})

    def _answer_dialog(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Forward the pressed button to the simulation, which checks it. Raises ValueError if nobody can receive it."""
        publisher = self._publisher
        if publisher is None:
            raise ValueError("no simulation is there to receive the answer")
        deadline = time.monotonic() + _CONNECT_TIMEOUT
        while not publisher.get_num_connections():
            if time.monotonic() > deadline:
                raise ValueError("the simulation does not receive answers now: press the button again")
            time.sleep(0.05)
        publisher.publish(json.dumps({key: message.get(key) for key in ("handle", "button", "typed")}))
        return {}


def camera_name(topic: str, vehicles: Sequence[str] = ()) -> str:
    """Return the caption of a topic of pictures, such as "front"; with several vehicles "wing, front"."""
    plain = topic.strip("/").removesuffix("/image")
    vehicle = next((name for name in vehicles if plain.startswith(f"{name}/")), "")
    own = plain.removeprefix(f"{vehicle}/") if vehicle else plain.partition("/views/")[2] or plain
    name = _NAMES.get(own, own)
    return f"{vehicle}, {name}" if vehicle and len(vehicles) > 1 else name


def _is_on(message: Mapping[str, Any]) -> bool:
    """Return the value of `on` in a browser's message. Raises ValueError."""
    if not isinstance(message.get("on"), bool):
        raise ValueError(f"on = {shown(message.get('on'))}: must be true or false")
    return bool(message["on"])


def _step(message: CompressedImage | Image) -> int:
    """Return n if only every n-th pixel is shown, along each side."""
    if isinstance(message, CompressedImage):
        return 1
    has_bytes = "8" in message.encoding  # rgb8, mono8, 8UC3; all others are depths
    return int(-(-message.width // (_MAX_WIDTH if has_bytes else _MAX_DEPTH_WIDTH)))


def encode(message: CompressedImage | Image) -> tuple[bytes, str]:
    """Return a picture as JPEG (a compressed one unchanged), and a caption. Raises ValueError for other encodings."""
    if isinstance(message, CompressedImage):
        return bytes(message.data), ""
    from drone_sim.ros.cockpit.panel import image_conversion  # slow import, and most pictures are JPEG

    return image_conversion.as_jpeg(message, _step(message))
