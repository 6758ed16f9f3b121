"""The `compressed` transport of image_transport, as its C++ plugin does it: topic, formats, parameters."""

from __future__ import annotations

import threading
from collections import deque
from types import SimpleNamespace
from typing import Any, NamedTuple

import cv2
import numpy as np
import rospy
from dynamic_reconfigure.server import Server
from sensor_msgs.msg import CompressedImage

from drone_sim.ros.node.newcomers import Newcomers


def _parameter(name: str, kind: str, default: Any, lowest: Any, highest: Any, description: str) -> dict[str, Any]:
    return {
        **{"name": name, "type": kind, "ctype": kind, "cconsttype": f"const {kind}", "default": default},
        **{"min": lowest, "max": highest, "level": 0, "description": description, "edit_method": ""},
        **{"srcfile": "", "srcline": 0},
    }


def _plugin_parameters() -> SimpleNamespace:
    """Describe the plugin's parameters, in the form that a generated `cfg` module has.

    Made at run time: a .cfg file would make the package useless without a build, for three parameters.
    """
    formats = [
        {**_parameter(name, "str", name, "", "", f"{name} compression"), "value": name} for name in ("jpeg", "png")
    ]
    choice = _parameter("format", "str", "jpeg", "", "", "compression format")
    choice["edit_method"] = str({"enum": formats, "enum_description": "formats to choose from"})
    described = [
        choice,
        _parameter("jpeg_quality", "int", 80, 1, 100, "JPEG quality in percent"),
        _parameter("png_level", "int", 9, 1, 9, "PNG compression level"),
    ]
    group = {
        **{"name": "Default", "type": "", "state": True, "cstate": "true", "id": 0, "parent": 0},
        **{"class": "DEFAULT", "parentclass": "", "parentname": "Default", "field": "default", "upper": "DEFAULT"},
        **{"lower": "groups", "groups": [], "parameters": described},
    }
    fields = {field: {one["name"]: one[field] for one in described} for field in ("min", "max", "level")}
    defaults = {one["name"]: one["default"] for one in described}
    return SimpleNamespace(config_description=group, defaults=defaults, **fields)


class _Picture(NamedTuple):
    stamp: rospy.Time
    frame: str
    image: np.ndarray


class CompressedPublisher:
    """Publishes `<base>/compressed` (sensor_msgs/CompressedImage); its parameters live beside it.

    A thread of its own encodes: PNG at the plugin's default level takes longer than a step. Pictures that come
    while it is busy are left out, but for the latest.
    """

    def __init__(self, base: str, newcomers: Newcomers):
        """Advertise, and open the dynamic_reconfigure server at `<base>/compressed`; `newcomers` notes who listens."""
        topic = rospy.resolve_name(f"{base}/compressed")
        self._publisher = rospy.Publisher(topic, CompressedImage, subscriber_listener=newcomers, queue_size=1)
        self._settings: dict[str, Any] = {}
        self._server = Server(_plugin_parameters(), self._keep, topic)
        self._waiting: deque[_Picture] = deque(maxlen=1)
        self._came = threading.Event()
        self._open = True
        threading.Thread(target=self._work, name=f"{topic} encoder", daemon=True).start()

    def _keep(self, settings: dict[str, Any], _level: int) -> dict[str, Any]:
        if settings["format"] not in ("jpeg", "png"):
            rospy.logwarn(f"compressed/format = '{settings['format']}': must be jpeg or png; jpeg is used")
            settings["format"] = "jpeg"
        self._settings = settings
        return settings

    def get_num_connections(self) -> int:
        """Return how many listen."""
        return self._publisher.get_num_connections()

    def unregister(self) -> None:
        """Advertise no more."""
        self._open = False
        self._came.set()
        for publisher in (self._publisher, self._server.descr_topic, self._server.update_topic):
            publisher.unregister()
        self._server.set_service.shutdown()

    def publish(self, stamp: rospy.Time, frame: str, image: np.ndarray) -> None:
        """Have an RGB picture (height, width, 3) encoded and published if somebody listens; it must not change."""
        if self.get_num_connections():
            self._waiting.append(_Picture(stamp, frame, image))
            self._came.set()

    def _work(self) -> None:
        while self._open:
            self._came.wait()
            self._came.clear()
            while self._waiting:
                message = _encoded(self._waiting.popleft(), self._settings)
                try:
                    self._publisher.publish(message)
                except rospy.ROSException:  # the node ends, and has closed the topic
                    return


def _encoded(picture: _Picture, settings: dict[str, Any]) -> CompressedImage:
    message = CompressedImage()
    message.header.stamp, message.header.frame_id = picture.stamp, picture.frame
    message.format = f"rgb8; {settings['format']} compressed bgr8"
    if settings["format"] == "png":
        extension, options = ".png", (cv2.IMWRITE_PNG_COMPRESSION, settings["png_level"])
    else:
        extension, options = ".jpg", (cv2.IMWRITE_JPEG_QUALITY, settings["jpeg_quality"])
    message.data = cv2.imencode(extension, cv2.cvtColor(picture.image, cv2.COLOR_RGB2BGR), options)[1].tobytes()
    return message
