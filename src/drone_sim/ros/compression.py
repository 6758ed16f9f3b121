"""The `compressed` transport of image_transport, as its C++ plugin does it: topic, formats, parameters."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Dict, Tuple

import cv2
import numpy as np
import rospy
from dynamic_reconfigure.encoding import extract_params
from dynamic_reconfigure.parameter_generator_catkin import ParameterGenerator, int_t, str_t
from dynamic_reconfigure.server import Server
from sensor_msgs.msg import CompressedImage


def _plugin_parameters() -> SimpleNamespace:
    """Describe the plugin's parameters, in the form that a generated `cfg` module has.

    Made at run time: a .cfg file would make the package useless without a build, for three parameters.
    """
    generator = ParameterGenerator()
    formats = [generator.const(name, str_t, name, f"{name} compression") for name in ("jpeg", "png")]
    generator.add(
        "format", str_t, 0, "compression format", "jpeg", edit_method=generator.enum(formats, "formats to choose from")
    )
    generator.add("jpeg_quality", int_t, 0, "JPEG quality in percent", 80, 1, 100)
    generator.add("png_level", int_t, 0, "PNG compression level", 9, 1, 9)
    description = generator.group.to_dict()
    fields = {field: {p["name"]: p[field] for p in extract_params(description)} for field in ("min", "max", "level")}
    defaults = {p["name"]: p["default"] for p in extract_params(description)}
    return SimpleNamespace(config_description=description, defaults=defaults, **fields)


class CompressedPublisher:
    """Publishes `<base>/compressed` (sensor_msgs/CompressedImage); its parameters live beside it."""

    def __init__(self, base: str):
        """Advertise, and open the dynamic_reconfigure server at `<base>/compressed`."""
        topic = rospy.resolve_name(f"{base}/compressed")
        self._publisher = rospy.Publisher(topic, CompressedImage, queue_size=1)
        self._settings: Dict[str, Any] = {}
        self._server = Server(_plugin_parameters(), self._keep, topic)

    def _keep(self, settings: Dict[str, Any], _level: int) -> Dict[str, Any]:
        if settings["format"] not in ("jpeg", "png"):
            rospy.logwarn(f"compressed/format = '{settings['format']}': must be jpeg or png; jpeg is used")
            settings["format"] = "jpeg"
        self._settings = settings
        return settings

    def get_num_connections(self) -> int:
        """Return how many listen."""
        return self._publisher.get_num_connections()

    def publish(self, stamp: rospy.Time, frame: str, image: np.ndarray) -> None:
        """Publish an RGB picture (height, width, 3) if somebody listens."""
        if not self.get_num_connections():
            return
        message = CompressedImage()
        message.header.stamp, message.header.frame_id = stamp, frame
        message.format = f"rgb8; {self._settings['format']} compressed bgr8"
        extension, options = self._encoding()
        message.data = cv2.imencode(extension, cv2.cvtColor(image, cv2.COLOR_RGB2BGR), options)[1].tobytes()
        self._publisher.publish(message)

    def _encoding(self) -> Tuple[str, Tuple[int, int]]:
        if self._settings["format"] == "png":
            return ".png", (cv2.IMWRITE_PNG_COMPRESSION, self._settings["png_level"])
        return ".jpg", (cv2.IMWRITE_JPEG_QUALITY, self._settings["jpeg_quality"])
