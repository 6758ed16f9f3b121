"""Boxes and masks over a camera's picture, from the truth that a camera with `truth: true` publishes."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import String

from drone_sim.ros.core import image_messages

BOXES, MASK = KINDS = ("boxes", "mask")
_MAX_MESSAGES = 8  # that are stored until their picture comes
_TOLERANCE = 1e-6  # s, between equal stamps
_BUFFER = 1 << 24  # bytes; more than a picture
_FLOOR = "Floor"  # its box, which is the whole picture, is not drawn
_MAX_LENGTH = 1 << 21  # characters of a message


class Overlay:
    """Boxes and masks of one camera; it subscribes to those that are shown."""

    def __init__(self, topic: str):
        """`topic` is that of the camera's pictures."""
        self._topic = topic
        self.kinds: frozenset[str] = frozenset()
        self._categories: dict[int, str] = {}
        self._boxes: deque[tuple[float, list[dict[str, Any]]]] = deque(maxlen=_MAX_MESSAGES)
        self._masks: deque[tuple[float, Image]] = deque(maxlen=_MAX_MESSAGES)
        self._subscribers: dict[str, rospy.Subscriber] = {}

    def listen(self, on: bool) -> None:
        """Subscribe to the topics of `kinds` (`on`), or to none."""
        topics: dict[str, tuple[type, Callable[[Any], None]]] = {}
        if on and self.kinds:
            topics["labels"] = String, self._on_labels
        if on and BOXES in self.kinds:
            topics["boxes"] = String, self._on_boxes
        if on and MASK in self.kinds:
            topics["categories"] = Image, self._on_mask
        for name in self._subscribers.keys() - topics.keys():
            self._subscribers.pop(name).unregister()
        for name in topics.keys() - self._subscribers.keys():
            options = {"queue_size": 1, "buff_size": _BUFFER}
            self._subscribers[name] = rospy.Subscriber(f"{self._topic}/truth/{name}", *topics[name], **options)

    def _on_labels(self, message: String) -> None:
        categories = _parse(message).get("categories")
        if isinstance(categories, Mapping):
            self._categories = {int(key): str(name) for key, name in categories.items() if str(key).isdigit()}

    def _on_boxes(self, message: String) -> None:
        content = _parse(message)
        if isinstance(content.get("stamp"), float) and isinstance(content.get("objects"), list):
            boxes = [box for box in content["objects"] if isinstance(box, dict)]
            self._boxes.append((content["stamp"], boxes))

    def _on_mask(self, message: Image) -> None:
        self._masks.append((message.header.stamp.to_sec(), message))

    def has(self, stamp: float) -> bool:
        """Return whether the messages of all `kinds` with a stamp (s) have come."""
        messages = {BOXES: self._boxes, MASK: self._masks}
        return all(any(abs(at - stamp) < _TOLERANCE for at, _ in [*messages[kind]]) for kind in self.kinds)

    def description(self, stamp: float) -> dict[str, Any]:
        """Return what the page itself draws over the picture with a stamp (s): boxes in px, and a legend."""
        colors = {name: color_of(number) for number, name in self._categories.items()}
        boxes = _nearest(self._boxes, stamp) or [] if BOXES in self.kinds else []
        shown = [
            {"name": box.get("name"), "box": box.get("visible"), "color": colors.get(str(box.get("category")), "#fff")}
            for box in boxes
            if box.get("name") != _FLOOR
        ]
        mask = _nearest(self._masks, stamp) if MASK in self.kinds else None
        numbers = np.unique(image_messages.pixels(mask)).tolist() if mask is not None else []
        legend = [
            {"name": self._categories[number], "color": color_of(number)}
            for number in numbers
            if number in self._categories
        ]
        return {"overlays": sorted(self.kinds), "boxes": shown, "legend": legend}

    def draw(self, picture: bytes, stamp: float) -> bytes:
        """Return a picture (JPEG or PNG) with the mask of its stamp over it, if that is shown and has come."""
        message = _nearest(self._masks, stamp) if MASK in self.kinds else None
        image = None if message is None else cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            return picture
        mask = image_messages.pixels(message)
        mask = cv2.resize(mask, image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
        masked = image_messages.draw_mask(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), mask)
        return bytes(cv2.imencode(".jpg", cv2.cvtColor(masked, cv2.COLOR_RGB2BGR))[1])


def color_of(number: int) -> str:
    """Return the CSS color of a category's number."""
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in image_messages.mask_color(number))


def _nearest(messages: deque[tuple[float, Any]], stamp: float) -> Any:
    """Return the message whose stamp is nearest to `stamp`; None if there are none."""
    return min([*messages], key=lambda message: abs(message[0] - stamp), default=(0.0, None))[1]


def _parse(message: String) -> Mapping[str, Any]:
    """Return the mapping in a JSON message; {} for an invalid one."""
    try:
        content = json.loads(message.data) if len(message.data) <= _MAX_LENGTH else None
    except (ValueError, RecursionError):
        content = None
    return content if isinstance(content, Mapping) else {}
