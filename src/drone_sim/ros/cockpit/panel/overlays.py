"""What is shown over a camera's picture: boxes and masks, of the truth that it publishes where `truth: true` is set."""

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
_KEPT = 8  # messages, among which is that of the picture's stamp
_SAME = 1e-6  # s, between two stamps of one picture
_BUFFER = 1 << 24  # bytes: more than a picture
_EVERYWHERE = "Floor"  # whose box is the picture
_LONGEST = 1 << 21  # characters of a message


class Overlay:
    """The truth over one camera's pictures, heard while somebody wants to see it."""

    def __init__(self, topic: str):
        """Take the topic of the pictures; listen to nothing."""
        self._topic = topic
        self.kinds: frozenset[str] = frozenset()
        self._categories: dict[int, str] = {}
        self._boxes: deque[tuple[float, list[dict[str, Any]]]] = deque(maxlen=_KEPT)
        self._masks: deque[tuple[float, Image]] = deque(maxlen=_KEPT)
        self._listening: dict[str, rospy.Subscriber] = {}

    def show(self, kinds: frozenset[str]) -> None:
        """Show these from now on."""
        self.kinds = kinds

    def listen(self, on: bool) -> None:
        """Listen to what is wanted, or to nothing."""
        wanted: dict[str, tuple[type, Callable[[Any], None]]] = {}
        if on and self.kinds:
            wanted["labels"] = String, self._on_labels
        if on and BOXES in self.kinds:
            wanted["boxes"] = String, self._on_boxes
        if on and MASK in self.kinds:
            wanted["categories"] = Image, self._on_mask
        for name in self._listening.keys() - wanted.keys():
            self._listening.pop(name).unregister()
        for name in wanted.keys() - self._listening.keys():
            options = {"queue_size": 1, "buff_size": _BUFFER}
            self._listening[name] = rospy.Subscriber(f"{self._topic}/truth/{name}", *wanted[name], **options)

    def _on_labels(self, message: String) -> None:
        said = _read(message)
        named = said.get("categories")
        if isinstance(named, Mapping):
            self._categories = {int(one): str(name) for one, name in named.items() if str(one).isdigit()}

    def _on_boxes(self, message: String) -> None:
        said = _read(message)
        if isinstance(said.get("stamp"), float) and isinstance(said.get("objects"), list):
            self._boxes.append((said["stamp"], [one for one in said["objects"] if isinstance(one, dict)]))

    def _on_mask(self, message: Image) -> None:
        self._masks.append((message.header.stamp.to_sec(), message))

    def has(self, stamp: float) -> bool:
        """Whether all that is wanted over the picture of a stamp (s) has come."""
        heard = {BOXES: self._boxes, MASK: self._masks}
        return all(any(abs(one[0] - stamp) < _SAME for one in [*heard[kind]]) for kind in self.kinds)

    def said(self, stamp: float) -> dict[str, Any]:
        """Return what the page draws by itself over the picture of a stamp (s): boxes in px, and a legend."""
        colors = {name: color_of(number) for number, name in self._categories.items()}
        boxes = _nearest(self._boxes, stamp) or [] if BOXES in self.kinds else []
        shown = [
            {"name": one.get("name"), "box": one.get("visible"), "color": colors.get(str(one.get("category")), "#fff")}
            for one in boxes
            if one.get("name") != _EVERYWHERE
        ]
        mask = _nearest(self._masks, stamp) if MASK in self.kinds else None
        numbers = np.unique(image_messages.pixels(mask)).tolist() if mask is not None else []
        legend = [
            {"name": self._categories[number], "color": color_of(number)}
            for number in numbers
            if number in self._categories
        ]
        return {"overlays": sorted(self.kinds), "boxes": shown, "legend": legend}

    def painted(self, picture: bytes, stamp: float) -> bytes:
        """Return a picture (JPEG or PNG) with the mask of its stamp over it, where that is wanted and has come."""
        message = _nearest(self._masks, stamp) if MASK in self.kinds else None
        image = None if message is None else cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            return picture
        mask = image_messages.pixels(message)
        mask = cv2.resize(mask, image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
        over = image_messages.draw_mask(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), mask)
        return bytes(cv2.imencode(".jpg", cv2.cvtColor(over, cv2.COLOR_RGB2BGR))[1])


def color_of(number: int) -> str:
    """Return the color of a category's number, as CSS has it."""
    return "#" + "".join(f"{round(255 * one):02x}" for one in image_messages.mask_color(number))


def _nearest(messages: deque[tuple[float, Any]], stamp: float) -> Any:
    """Return the message of a stamp, or of that nearest to it; None without any."""
    return min([*messages], key=lambda one: abs(one[0] - stamp), default=(0.0, None))[1]


def _read(message: String) -> Mapping[str, Any]:
    try:
        said = json.loads(message.data) if len(message.data) <= _LONGEST else None
    except (ValueError, RecursionError):
        said = None
    return said if isinstance(said, Mapping) else {}
