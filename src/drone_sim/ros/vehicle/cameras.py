"""Topics of a camera, as subscribers of image_transport expect them; messages are made only for subscribers."""

from __future__ import annotations

import threading
import traceback
from collections import deque
from typing import Any

import cv2
import numpy as np
import rospy
from dynamic_reconfigure.server import Server
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

from drone_sim.config.fields import ParameterField
from drone_sim.ros.core import image_messages, message_conversion
from drone_sim.ros.core.publishing import NewSubscribers, Stamp
from drone_sim.ros.vehicle.camera_truth import TruthOutput
from drone_sim.ros.vehicle.tuning_server import described
from drone_sim.sensors.camera import Camera
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.vehicles.parameters import VehicleParameters

_ERROR_PERIOD = 5.0  # s, between two errors in the log
_ENCODINGS = {"color": "rgb8", "depth": "32FC1"}
_COMPRESSION = {
    "format": ParameterField(("format",), str, choices=("jpeg", "png"), description="compression format"),
    "jpeg_quality": ParameterField(("jpeg_quality",), int, low=1, high=100, description="JPEG quality in percent"),
    "png_level": ParameterField(("png_level",), int, low=1, high=9, description="PNG compression level"),
}
_DEFAULTS = {"format": "jpeg", "jpeg_quality": 80, "png_level": 9}


class CameraOutput:
    """One camera: `<topic>`, `<topic>/compressed` (colour), and camera_info in the same namespace."""

    def __init__(
        self, vehicle: VehicleParameters, camera: Camera, parameters: CameraParameters, new_subscribers: NewSubscribers
    ):
        """Advertise in the vehicle's namespace; `new_subscribers` collects new subscribers to pictures.

        The camera takes pictures only while there are subscribers.
        """
        topic = message_conversion.full_name(vehicle.name, parameters.topic)
        self._frame = message_conversion.frame(vehicle, parameters.frame)
        folder, slash, _ = topic.rpartition("/")
        info_topic = f"{folder}{slash}camera_info"  # image_transport's rule
        self._image = rospy.Publisher(topic, Image, subscriber_listener=new_subscribers, queue_size=1)
        self._compressed = CompressedPublisher(topic, new_subscribers) if parameters.kind == "color" else None
        self._info_publisher = rospy.Publisher(info_topic, CameraInfo, queue_size=1)
        self._truth = TruthOutput(topic, self._frame, new_subscribers) if parameters.truth else None
        self.follow(camera)

    def follow(self, camera: Camera) -> None:
        """Use this camera, which replaces the last one, from now on."""
        self._camera = camera
        self._describe()
        camera.viewers.add(self._watched)

    def _describe(self) -> None:
        self._intrinsics = self._camera.intrinsics
        self._info = message_conversion.camera_info(self._intrinsics, self._frame)

    def close(self) -> None:
        """Unregister the topics."""
        for publisher in (self._image, self._compressed, self._info_publisher):
            if publisher is not None:
                publisher.unregister()
        if self._truth is not None:
            self._truth.close()

    def _watched(self) -> bool:
        compressed = self._compressed
        listened = self._image.get_num_connections() > 0
        return listened or (compressed is not None and compressed.publisher.get_num_connections() > 0)

    def publish(self, stamp: Stamp) -> None:
        """Publish the picture and its camera_info, stamped with the time of the picture.

        A radio link delays or loses both together; a silent camera publishes nothing.
        """
        camera = self._camera
        if self._truth is not None:
            self._truth.publish(camera, stamp)
        is_there = camera.image is not None or (not camera.is_linked and camera.failure != "silent")
        if is_there and self._info_publisher.get_num_connections():
            if self._intrinsics is not camera.intrinsics:
                self._describe()
            self._info.header.stamp = stamp(camera.age)
            self._info_publisher.publish(self._info)
        if camera.image is None:
            return
        header = Header(stamp=stamp(camera.age), frame_id=self._frame)
        if self._image.get_num_connections():
            self._image.publish(image_messages.image(camera.image, _ENCODINGS[camera.kind], header))
        if self._compressed is not None:
            self._compressed.publish(header, camera.image)


class CompressedPublisher:
    """Publishes `<base>/compressed` with the formats and parameters of image_transport's C++ plugin.

    It encodes in its own thread, because PNG at the plugin's default level takes longer than a step. If pictures arrive
    while the thread is busy, only the latest is encoded. A picture that cannot be encoded is logged and skipped.
    """

    def __init__(self, base: str, new_subscribers: NewSubscribers):
        """Advertise the topic and its dynamic_reconfigure server; `new_subscribers` collects new subscribers."""
        topic = rospy.resolve_name(f"{base}/compressed")
        self.publisher = rospy.Publisher(topic, CompressedImage, subscriber_listener=new_subscribers, queue_size=1)
        self._settings: dict[str, Any] = {}
        self._server = Server(described(_COMPRESSION, _DEFAULTS), self._store_settings, topic)
        self._pending: deque[tuple[Header, np.ndarray]] = deque(maxlen=1)
        self._has_pending = threading.Event()
        self._is_open = True
        threading.Thread(target=self._work, name=f"{topic} encoder", daemon=True).start()

    def _store_settings(self, settings: dict[str, Any], _level: int) -> dict[str, Any]:
        if settings["format"] not in ("jpeg", "png"):
            rospy.logwarn(f"compressed/format = '{settings['format']}': must be jpeg or png; jpeg is used")
            settings["format"] = "jpeg"
        self._settings = settings
        return settings

    def unregister(self) -> None:
        """Unregister the topics."""
        self._is_open = False
        self._has_pending.set()
        for publisher in (self.publisher, self._server.descr_topic, self._server.update_topic):
            publisher.unregister()
        self._server.set_service.shutdown()

    def publish(self, header: Header, image: np.ndarray) -> None:
        """Encode and publish an RGB picture (height, width, 3), which must not change, if there are subscribers."""
        if self.publisher.get_num_connections():
            self._pending.append((header, image))
            self._has_pending.set()

    def _work(self) -> None:
        while self._is_open:
            self._has_pending.wait()
            self._has_pending.clear()
            while self._pending:
                try:
                    self.publisher.publish(_encoded(*self._pending.popleft(), self._settings))
                except rospy.ROSException:  # the node ends
                    return
                except Exception as error:  # the thread must survive one bad picture
                    rospy.logerr_throttle(
                        _ERROR_PERIOD, f"{self.publisher.name}: a picture could not be encoded: {error}"
                    )
                    rospy.logdebug(traceback.format_exc())


def _encoded(header: Header, image: np.ndarray, settings: dict[str, Any]) -> CompressedImage:
    message = CompressedImage(header=header, format=f"rgb8; {settings['format']} compressed bgr8")
    if settings["format"] == "png":
        extension, options = ".png", (cv2.IMWRITE_PNG_COMPRESSION, settings["png_level"])
    else:
        extension, options = ".jpg", (cv2.IMWRITE_JPEG_QUALITY, settings["jpeg_quality"])
    message.data = cv2.imencode(extension, cv2.cvtColor(image, cv2.COLOR_RGB2BGR), options)[1].tobytes()
    return message
