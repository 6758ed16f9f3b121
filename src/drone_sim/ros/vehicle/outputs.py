"""What a vehicle publishes after each step, pictures aside; a message that nobody listens to is not made."""

from __future__ import annotations

from collections.abc import Callable

import rospy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, String

from drone_sim.ros.node.newcomers import Newcomers
from drone_sim.ros.vehicle import frame_names, messages
from drone_sim.run.pacing import Throttle
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_EYES = 1 / 30  # s of real time, between two messages that are for eyes


class VehicleOutputs:
    """Odometry, command, propellers, joint states and flight state of one vehicle."""

    def __init__(self, parameters: VehicleParameters, newcomers: Newcomers):
        """Advertise in the vehicle's namespace; `newcomers` notes who begins to listen to odometry."""
        name = parameters.name
        self._base_link, self._track_base = frame_names.base_link(parameters), frame_names.track_base(parameters)
        self._odometry = rospy.Publisher(f"{name}/odom", Odometry, subscriber_listener=newcomers, queue_size=10)
        self._command = rospy.Publisher(f"{name}/command", TwistStamped, queue_size=10)
        self._propellers = rospy.Publisher(f"{name}/propellers", Float32MultiArray, queue_size=10)
        self._joints = rospy.Publisher(f"{name}/joint_states", JointState, queue_size=10)
        self._flight_state = rospy.Publisher(f"{name}/state", String, queue_size=10, latch=True)
        self._told = ""
        self._eyes = Throttle(_EYES)

    def close(self) -> None:
        """Advertise no more."""
        for publisher in (self._odometry, self._command, self._propellers, self._joints, self._flight_state):
            publisher.unregister()

    def publish_state(self, vehicle: Vehicle, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the state, under what `stamp` returns."""
        if self._odometry.get_num_connections():
            self._odometry.publish(messages.odometry(stamp(), vehicle.state, self._base_link))
        if self._propellers.get_num_connections():
            stamp()  # /clock before the message
            self._propellers.publish(messages.propellers(vehicle.particle_velocities))
        state = str(vehicle.flight_state)
        if state != self._told:
            self._told = state
            self._flight_state.publish(state)

    def publish_joints(self, vehicle: Vehicle, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the blades' angles, as often as eyes need them."""
        if self._joints.get_num_connections() and self._eyes.passes():
            self._joints.publish(messages.joint_states(stamp(), vehicle.blade_angles))

    def publish_command(self, vehicle: Vehicle, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the command in force, under what `stamp` returns; it may change while the simulation stands."""
        if self._command.get_num_connections():
            self._command.publish(messages.command(stamp(), vehicle.command, self._track_base))
