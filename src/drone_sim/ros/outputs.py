"""What a drone publishes after each step, pictures aside; a message that nobody listens to is not made."""

from __future__ import annotations

from typing import Mapping

import rospy
import tf2_ros
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray

from drone_sim.camera.vision import Camera
from drone_sim.drone import Drone
from drone_sim.ros import messages

BASE_LINK = "base_link"
TRACK_BASE = "Track_base"


class DroneOutput:
    """Odometry, propellers, joint states and transforms of one drone."""

    def __init__(self, drone: Drone, mounted: Mapping[str, Camera]):
        """Advertise in the drone's namespace. `mounted`: cameras that the URDF does not know, by frame."""
        self._drone = drone
        self._mounted = mounted
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
                    *(
                        messages.transform(stamp, messages.WORLD, frame, camera.pose())
                        for frame, camera in self._mounted.items()
                    ),
                ]
            )
