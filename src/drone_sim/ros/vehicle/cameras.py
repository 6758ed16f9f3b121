"""What a camera publishes, as image_transport's subscribers expect it; nothing is made that nobody listens to."""

from __future__ import annotations

import numpy as np
import rospy
from cv_bridge import CvBridge
from sensor_msgs.msg import CameraInfo, Image

from drone_sim.ros.node.newcomers import Newcomers
from drone_sim.ros.node.step_time import Stamp
from drone_sim.ros.vehicle import frame_names, messages
from drone_sim.ros.vehicle.compression import CompressedPublisher
from drone_sim.sensors.camera import Camera
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.vehicles.parameters import VehicleParameters

_ENCODINGS = {"color": "rgb8", "depth": "32FC1"}


class CameraOutput:
    """One camera: `<topic>`, `<topic>/compressed` (colour), and camera_info in the same namespace."""

    def __init__(self, vehicle: VehicleParameters, camera: Camera, parameters: CameraParameters, newcomers: Newcomers):
        """Advertise in the vehicle's namespace; the camera takes pictures only while somebody listens.

        `newcomers` notes who begins to.
        """
        topic = f"{vehicle.name}/{parameters.topic}"
        self._frame = frame_names.frame(vehicle, parameters.frame)
        info_topic = topic.rpartition("/")[0] + "/camera_info"  # image_transport's rule
        self._bridge = CvBridge()
        self._image = rospy.Publisher(topic, Image, subscriber_listener=newcomers, queue_size=1)
        self._compressed = CompressedPublisher(topic, newcomers) if parameters.kind == "color" else None
        self._info_publisher = rospy.Publisher(info_topic, CameraInfo, queue_size=1)
        self.follow(camera)

    def follow(self, camera: Camera) -> None:
        """Publish what this camera sees from now on; it has taken the place of the last one."""
        self._camera = camera
        self._describe()
        camera.watched = self._watched

    def _describe(self) -> None:
        self._intrinsics = self._camera.intrinsics
        self._info = messages.camera_info(self._intrinsics, self._frame)

    def close(self) -> None:
        """Advertise no more."""
        for publisher in (self._image, self._compressed, self._info_publisher):
            if publisher is not None:
                publisher.unregister()

    def _watched(self) -> bool:
        compressed = self._compressed
        return self._image.get_num_connections() > 0 or bool(compressed and compressed.get_num_connections())

    def publish(self, stamp: Stamp) -> None:
        """Publish what the camera sees, and the model that belongs to it, stamped with when it was taken.

        Over a link both come together, or neither; of a silent camera nothing comes.
        """
        camera = self._camera
        is_there = camera.image is not None or (camera.over is None and camera.failure != "silent")
        if is_there and self._info_publisher.get_num_connections():
            if self._intrinsics is not camera.intrinsics:
                self._describe()
            self._info.header.stamp = stamp(camera.age)
            self._info_publisher.publish(self._info)
        if camera.image is not None:
            self._publish_image(stamp(camera.age), camera.image)

    def _publish_image(self, stamp: rospy.Time, image: np.ndarray) -> None:
        frame = self._frame
        if self._image.get_num_connections():
            message = self._bridge.cv2_to_imgmsg(image, _ENCODINGS[self._camera.kind])
            message.header.stamp, message.header.frame_id = stamp, frame
            self._image.publish(message)
        if self._compressed is not None:
            self._compressed.publish(stamp, frame, image)
