"""Write a camera's pictures and the truth behind them (`truth: true`) to files until Ctrl-C: pictures, masks, boxes.

What belongs together has the same stamp. Pictures that come while one is written are left out, and counted.
"""

from __future__ import annotations

import argparse
import json
import queue
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import String

from drone_sim.command_line import Parser
from drone_sim.message_text import near_names
from drone_sim.offline import dataset
from drone_sim.ros.core.image_messages import pixels
from drone_sim.ros.core.shutdown import run_tool
from drone_sim.ros.tools import pictures

_NAME = "record_truth"
_TRUTH = "/truth/boxes"
_IMAGES = ("instances", "depth", "normals", "flow", "flow_known")
_ARRAYS = ("depth", "normals", "flow")
_BUFFER = 1 << 24  # bytes; rospy's default makes large pictures late
_MOST = 20  # stamps that wait for the rest of their messages
_PERIOD = 0.1  # s, between two looks at whether to end
_PATIENCE = 3.0  # s, for somebody to publish


class _Moments:
    """Puts messages of the same stamp together."""

    def __init__(self) -> None:
        self.whole: queue.Queue[tuple[float, dict[str, Any]]] = queue.Queue(maxsize=2)
        self.missed = 0
        self._parts: dict[float, dict[str, Any]] = {}
        self._lock = threading.Lock()

    def take(self, name: str, stamp: float, message: Any) -> None:
        """Take a message; pass on the messages of its stamp if they are complete now."""
        key = round(stamp, 5)  # a stamp in JSON has no more digits
        with self._lock:
            parts = self._parts.setdefault(key, {})
            parts[name] = message
            if len(parts) == len(_IMAGES) + 2:
                self._hand_on(key, self._parts.pop(key))
            if len(self._parts) > _MOST:
                del self._parts[min(self._parts)]
                self.missed += 1

    def _hand_on(self, stamp: float, parts: dict[str, Any]) -> None:
        try:
            self.whole.put_nowait((stamp, parts))
        except queue.Full:
            self.missed += 1


def main() -> int:
    """Record until a signal comes; return the exit status."""
    parser = Parser(prog=_NAME, description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("topic", metavar="TOPIC", help="the topic of the camera's pictures, such as /drone/front")
    parser.add_argument("folder", metavar="DIR", help="the folder for the files: a new one, or an empty one")
    options = parser.parse_args(rosgraph.myargv(sys.argv)[1:])
    return run_tool(_NAME, lambda over: _record(options, over))


def _record(options: argparse.Namespace, over: Callable[[], bool]) -> None:
    """Raises OSError and ValueError."""
    topic = rospy.resolve_name(options.topic)
    dataset.check(options.folder)
    _check_topic(topic, over)
    moments = _Moments()
    listening = [*_subscribed(topic, moments)]
    with dataset.writing_to(options.folder, topic) as made:
        print(f"{_NAME}: {topic} into {options.folder}; Ctrl-C ends it", file=sys.stderr, flush=True)
        while not over():
            try:
                stamp, parts = moments.whole.get(timeout=_PERIOD)
            except queue.Empty:
                continue
            _add(made, stamp, parts)
        for one in listening:
            one.unregister()
    left = f"; {moments.missed} are left out, because they came too fast" if moments.missed else ""
    print(f"{_NAME}: wrote {options.folder}: {made}{left}", flush=True)


def _check_topic(topic: str, over: Callable[[], bool]) -> None:
    """Wait for the camera's truth. Raises ValueError where nobody publishes it."""
    until = time.monotonic() + _PATIENCE
    while True:
        cameras = [name.removesuffix(_TRUTH) for name, _ in rospy.get_published_topics() if name.endswith(_TRUTH)]
        if topic in cameras or over():
            return
        if time.monotonic() > until:
            known = near_names(topic, cameras) if cameras else "no camera has `truth: true`"
            raise ValueError(f"{topic}: no node publishes the truth of this camera; {known}")
        time.sleep(_PERIOD)


def _subscribed(topic: str, moments: _Moments) -> list[rospy.Subscriber]:
    def on_boxes(message: String) -> None:
        said = json.loads(message.data)
        moments.take("boxes", said["stamp"], said["objects"])

    def on_image(message: Image, name: str) -> None:
        moments.take(name, message.header.stamp.to_sec(), message)

    names = {"color": topic, **{name: f"{topic}/truth/{name}" for name in _IMAGES}}
    images = [
        rospy.Subscriber(path, Image, on_image, name, queue_size=10, buff_size=_BUFFER) for name, path in names.items()
    ]
    return [*images, rospy.Subscriber(f"{topic}{_TRUTH}", String, on_boxes, queue_size=10)]


def _add(made: dataset.Dataset, stamp: float, parts: dict[str, Any]) -> None:
    arrays = {name: pixels(parts[name]) for name in _ARRAYS}
    arrays["flow_known"] = pixels(parts["flow_known"]) > 0
    mask = pixels(parts["instances"])
    made.add(stamp, pictures.decode(parts["color"]), mask, parts["boxes"], arrays)
