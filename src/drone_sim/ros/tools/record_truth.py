"""Write a camera's pictures and the truth behind them (`truth: true`) to files until Ctrl-C: pictures, masks, boxes.

The messages of one moment have the same stamp. Moments that come while another is written are left out, and counted.
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
_BOXES = "/truth/boxes"
_IMAGES = ("instances", "depth", "normals", "flow", "flow_known")
_ARRAYS = ("depth", "normals", "flow")
_BUFFER = 1 << 24  # bytes; with rospy's default, large images are delayed
_MAX_INCOMPLETE = 20  # stamps whose other messages have not come yet
_PERIOD = 0.1  # s, between two checks for the end
_PUBLISHER_TIMEOUT = 3.0  # s


class _StampGroups:
    """Groups messages by their stamp."""

    def __init__(self) -> None:
        self.complete: queue.Queue[tuple[float, dict[str, Any]]] = queue.Queue(maxsize=2)
        self.lost = 0  # groups that did not become complete, or came too fast
        self._groups: dict[float, dict[str, Any]] = {}
        self._lock = threading.Lock()

    def add(self, name: str, stamp: float, message: Any) -> None:
        """Add a message; move its group to `complete` if all of its messages have come."""
        key = round(stamp, 5)  # stamps in JSON have at most 5 decimals
        with self._lock:
            group = self._groups.setdefault(key, {})
            group[name] = message
            if len(group) == len(_IMAGES) + 2:
                del self._groups[key]
                try:
                    self.complete.put_nowait((key, group))
                except queue.Full:
                    self.lost += 1
            if len(self._groups) > _MAX_INCOMPLETE:
                del self._groups[min(self._groups)]
                self.lost += 1


def main() -> int:
    """Record until a signal; return the exit status."""
    parser = Parser(prog=_NAME, description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("topic", metavar="TOPIC", help="the topic of the camera's pictures, such as /drone/front")
    parser.add_argument("folder", metavar="DIR", help="the folder for the files: a new one, or an empty one")
    options = parser.parse_args(rosgraph.myargv(sys.argv)[1:])
    return run_tool(_NAME, lambda over: _record(options, over))


def _record(options: argparse.Namespace, over: Callable[[], bool]) -> None:
    """Write the files until `over` returns True. Raises OSError and ValueError."""
    topic = rospy.resolve_name(options.topic)
    dataset.check(options.folder)
    _wait_for_truth(topic, over)
    groups = _StampGroups()
    subscribers = _subscribe(topic, groups)
    with dataset.writing_to(options.folder, topic) as written:
        print(f"{_NAME}: {topic} into {options.folder}; Ctrl-C ends it", file=sys.stderr, flush=True)
        while not over():
            try:
                stamp, messages = groups.complete.get(timeout=_PERIOD)
            except queue.Empty:
                continue
            arrays = {name: pixels(messages[name]) for name in _ARRAYS}
            arrays["flow_known"] = pixels(messages["flow_known"]) > 0
            mask = pixels(messages["instances"])
            written.add(stamp, pictures.decode(messages["color"]), mask, messages["boxes"], arrays)
        for subscriber in subscribers:
            subscriber.unregister()
    lost = f"; {groups.lost} are left out, because they came too fast" if groups.lost else ""
    print(f"{_NAME}: wrote {options.folder}: {written}{lost}", flush=True)


def _wait_for_truth(topic: str, over: Callable[[], bool]) -> None:
    """Wait until the camera's truth is published. Raises ValueError after _PUBLISHER_TIMEOUT."""
    deadline = time.monotonic() + _PUBLISHER_TIMEOUT
    while True:
        cameras = [name.removesuffix(_BOXES) for name, _ in rospy.get_published_topics() if name.endswith(_BOXES)]
        if topic in cameras or over():
            return
        if time.monotonic() > deadline:
            hint = near_names(topic, cameras) if cameras else "no camera has `truth: true`"
            raise ValueError(f"{topic}: no node publishes the truth of this camera; {hint}")
        time.sleep(_PERIOD)


def _subscribe(topic: str, groups: _StampGroups) -> list[rospy.Subscriber]:
    def on_boxes(message: String) -> None:
        boxes = json.loads(message.data)
        groups.add("boxes", boxes["stamp"], boxes["objects"])

    def on_image(message: Image, name: str) -> None:
        groups.add(name, message.header.stamp.to_sec(), message)

    names = {"color": topic, **{name: f"{topic}/truth/{name}" for name in _IMAGES}}
    images = [
        rospy.Subscriber(path, Image, on_image, name, queue_size=10, buff_size=_BUFFER) for name, path in names.items()
    ]
    return [*images, rospy.Subscriber(f"{topic}{_BOXES}", String, on_boxes, queue_size=10)]
