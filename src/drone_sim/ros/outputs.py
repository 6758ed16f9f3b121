"""What a drone publishes after each step, pictures aside; a message that nobody listens to is not made."""

from __future__ import annotations

import rospy
import tf2_ros
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray

from drone_sim.ros import messages
from drone_sim.simulation import Simulation

BASE_LINK = "base_link"
TRACK_BASE = "Track_base"


class DroneOutput:
    """Odometry, propellers, joint states and transforms of one drone."""

    def __init__(self, simulation: Simulation):
        """Advertise in the drone's namespace."""
        self._simulation = simulation
        drone = simulation.drone
        self._mounted = [camera for camera in simulation.parameters.cameras.values() if camera.mount is not None]
        self._odometry = rospy.Publisher(f"{drone.name}/odom", Odometry, queue_size=10)
        self._propellers = rospy.Publisher(f"{drone.name}/propellers", Float32MultiArray, queue_size=10)
        self._joints = rospy.Publisher(f"{drone.name}/joint_states", JointState, queue_size=10)
        self._transforms = tf2_ros.TransformBroadcaster()

    def publish(self, stamp: rospy.Time) -> None:
        """Publish the state after a step."""
        drone = self._simulation.drone
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
                        messages.transform(stamp, messages.WORLD, camera.frame, drone.optical(camera))
                        for camera in self._mounted  # the URDF does not know them
                    ),
                ]
            )
