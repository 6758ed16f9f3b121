"""What a drone publishes after each step; a message that nobody listens to is not made."""

from __future__ import annotations

from typing import List

import rospy
import tf2_ros
from cv_bridge import CvBridge
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Float32MultiArray

from drone_sim.camera.vision import Camera
from drone_sim.drone import Drone
from drone_sim.parameters import CameraParameters
from drone_sim.ros import messages

BASE_LINK = "base_link"
TRACK_BASE = "Track_base"


class CameraOutput:
    """One camera: `<topic>` (sensor_msgs/Image, rgb8), and camera_info in the same namespace."""

    def __init__(self, topic: str, camera: Camera, parameters: CameraParameters):
        """Advertise; the camera takes pictures only while somebody listens."""
        self._camera = camera
        self._bridge = CvBridge()
        self._image = rospy.Publisher(topic, Image, queue_size=1)
        info_topic = topic.rpartition("/")[0] + "/camera_info"  # image_transport's rule
        self._info_publisher = rospy.Publisher(info_topic, CameraInfo, queue_size=1)
        self._info = messages.camera_info(camera.intrinsics, parameters.frame)
        camera.watched = self._image.get_num_connections

    def publish(self, stamp: rospy.Time) -> None:
        """Publish this step's picture and the model that belongs to it."""
        if self._info_publisher.get_num_connections():
            self._info.header.stamp = stamp
            self._info_publisher.publish(self._info)
        if self._camera.image is not None:
            message = self._bridge.cv2_to_imgmsg(self._camera.image, "rgb8")
            message.header.stamp, message.header.frame_id = stamp, self._info.header.frame_id
            self._image.publish(message)


class DroneOutput:
    """Odometry, propellers, joint states and transforms of one drone."""

    def __init__(self, drone: Drone):
        """Advertise in the drone's namespace."""
        self._drone = drone
        self._odometry = rospy.Publisher(f"{drone.name}/odom", Odometry, queue_size=10)
        self._propellers = rospy.Publisher(f"{drone.name}/propellers", Float32MultiArray, queue_size=10)
        self._joints = rospy.Publisher(f"{drone.name}/joint_states", JointState, queue_size=10)
        self._transforms = tf2_ros.TransformBroadcaster()

    def publish(self, stamp: rospy.Time) -> None:
        """Publish the state after a step."""
        drone = self._drone
        if self._odometry.get_num_connections():
            self._odometry.publish(messages.odometry(stamp, drone.state, BASE_LINK))
        if self._propellers.get_num_connections():
            self._propellers.publish(messages.propellers(drone.particle_velocities))
        if self._joints.get_num_connections():
            self._joints.publish(messages.joint_states(stamp, drone.blade_angles))
        if self._transforms.pub_tf.get_num_connections():
            self._transforms.sendTransform(
                [
                    messages.transform(stamp, messages.WORLD, BASE_LINK, drone.matrix),
                    messages.transform(stamp, messages.WORLD, TRACK_BASE, drone.track),
                ]
            )


def broadcast_mounts(cameras: List[CameraParameters]) -> None:
    """Broadcast, latched and together, where the cameras sit that have no link in the URDF."""
    stamp = rospy.Time.now()
    frames_of_objects = {"Drone": BASE_LINK, "Track_base": TRACK_BASE}
    tf2_ros.StaticTransformBroadcaster().sendTransform(
        [
            messages.transform(stamp, frames_of_objects[camera.mount.parent], camera.frame, camera.mount.matrix)
            for camera in cameras
            if camera.mount is not None
        ]
    )
