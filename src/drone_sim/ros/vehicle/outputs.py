"""What a drone publishes after each step, pictures aside; a message that nobody listens to is not made."""

from __future__ import annotations

from collections.abc import Callable

import rospy
import tf2_ros
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray

from drone_sim.ros.vehicle import messages
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation

BASE_LINK = "base_link"
TRACK_BASE = "Track_base"
_EYES = 1 / 30  # s of real time, between two messages that are for eyes


class DroneOutput:
    """Odometry, command, propellers, joint states and transforms of one drone."""

    def __init__(self, simulation: Simulation):
        """Advertise in the drone's namespace."""
        self._simulation = simulation
        drone = simulation.drone
        self._mounted = [camera for camera in simulation.parameters.cameras.values() if camera.mount is not None]
        self._odometry = rospy.Publisher(f"{drone.name}/odom", Odometry, queue_size=10)
        self._command = rospy.Publisher(f"{drone.name}/command", TwistStamped, queue_size=10)
        self._propellers = rospy.Publisher(f"{drone.name}/propellers", Float32MultiArray, queue_size=10)
        self._joints = rospy.Publisher(f"{drone.name}/joint_states", JointState, queue_size=10)
        self._transforms = tf2_ros.TransformBroadcaster()
        self._eyes = Throttle(_EYES)

    def publish_transforms(self, stamp: Callable[[], rospy.Time]) -> None:
        """Publish what becomes transforms, under what `stamp` returns: tf2 takes but one for each stamp."""
        drone = self._simulation.drone
        if self._joints.get_num_connections() and self._eyes.passes():
            self._joints.publish(messages.joint_states(stamp(), drone.blade_angles))
        if self._transforms.pub_tf.get_num_connections():
            now = stamp()
            self._transforms.sendTransform(
                [
                    messages.transform(now, messages.WORLD, BASE_LINK, drone.matrix),
                    messages.transform(now, messages.WORLD, TRACK_BASE, drone.track),
                    *(
                        messages.transform(now, messages.WORLD, camera.frame, drone.optical(camera))
                        for camera in self._mounted  # the URDF does not know them
                    ),
                ]
            )

    def publish_state(self, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the rest of the state, under what `stamp` returns."""
        drone = self._simulation.drone
        if self._odometry.get_num_connections():
            self._odometry.publish(messages.odometry(stamp(), drone.state, BASE_LINK))
        if self._propellers.get_num_connections():
            stamp()  # /clock before the message
            self._propellers.publish(messages.propellers(drone.particle_velocities))

    def publish_command(self, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the command in force, under what `stamp` returns; it may change while the simulation stands."""
        if self._command.get_num_connections():
            self._command.publish(messages.command(stamp(), self._simulation.drone.command, TRACK_BASE))
