"""Messages of a vehicle, its sensors and its frames after each step; made only for topics with subscribers."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import rospy
from geometry_msgs.msg import TransformStamped, TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float32MultiArray, String
from tf2_msgs.msg import TFMessage

from drone_sim.mechanics import frames
from drone_sim.ros.core import message_conversion
from drone_sim.ros.core.message_conversion import (
    BASE_LINK,
    TRACK_BASE,
    WORLD_FRAME,
    fill,
    first_frame,
    frame,
    full_name,
    message_class,
    transform,
)
from drone_sim.ros.core.publishing import NewSubscribers, Stamp
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.sensor import Instrument, SensorParameters
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.situation import doing, hears_commands
from drone_sim.vehicles.vehicle import Vehicle

_DISPLAY_PERIOD = 1 / 30  # s of real time, between two messages that are only displayed
_STATE_PERIOD = 0.2  # s of real time, between two updates of the flight state
# Messages for a subscriber that reads too slowly. In lockstep, a recorder that loses one records another flight.
_QUEUE_SIZE, _LOCKSTEP_QUEUE_SIZE = 10, 1000
_READINGS_QUEUE = 100  # messages: half a second at 200 Hz, which come ten at a time


class VehicleOutputs:
    """Odometry, command, propellers, joint states and flight state of one vehicle."""

    def __init__(self, parameters: VehicleParameters, new_subscribers: NewSubscribers, is_in_lockstep: bool = False):
        """Advertise in the namespace of the vehicle with these parameters.

        `new_subscribers` collects new subscribers to odometry.
        """
        name, size = parameters.name, _LOCKSTEP_QUEUE_SIZE if is_in_lockstep else _QUEUE_SIZE
        self._base_link, self._track_base = frame(parameters, BASE_LINK), frame(parameters, TRACK_BASE)
        is_drivers = any(entry.fields and entry.topic == "odom" for entry in parameters.topics.values())
        own = "exact_odom" if is_drivers else "odom"
        self._odometry = rospy.Publisher(
            f"{name}/{own}", Odometry, subscriber_listener=new_subscribers, queue_size=size
        )
        self._command = rospy.Publisher(f"{name}/command", TwistStamped, queue_size=size)
        self._propellers = rospy.Publisher(f"{name}/propellers", Float32MultiArray, queue_size=size)
        self._joints = rospy.Publisher(f"{name}/joint_states", JointState, queue_size=size)
        self._flight_state = rospy.Publisher(f"{name}/state", String, queue_size=10, latch=True)
        self._hears_commands = rospy.Publisher(f"{name}/hears_commands", Bool, queue_size=10, latch=True)
        self._script_state = ""
        self._published: tuple[str, bool] = ("", False)
        self._display_throttle, self._state_throttle = Throttle(_DISPLAY_PERIOD), Throttle(_STATE_PERIOD)

    def close(self) -> None:
        state = self._odometry, self._command, self._propellers, self._joints, self._flight_state, self._hears_commands
        for publisher in state:
            publisher.unregister()

    def publish_state(self, vehicle: Vehicle, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the state with the stamp that `stamp` returns."""
        if self._odometry.get_num_connections():
            self._odometry.publish(message_conversion.odometry(stamp(), vehicle.body.state, self._base_link))
        if self._propellers.get_num_connections():
            stamp()  # /clock before the message
            self._propellers.publish(message_conversion.propellers(vehicle.propulsion.particle_velocities))
        script_state = str(vehicle.flight_state)
        if script_state != self._script_state or self._state_throttle.passes():
            self._script_state = script_state
            before, self._published = self._published, (doing(vehicle), hears_commands(vehicle))
            state, hears = self._published
            if state != before[0]:
                self._flight_state.publish(state)
            if hears != before[1] or not before[0]:
                self._hears_commands.publish(hears)

    def publish_joints(self, vehicle: Vehicle, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the angles of the propellers' blades, at the rate of a display."""
        if self._joints.get_num_connections() and self._display_throttle.passes():
            self._joints.publish(message_conversion.joint_states(stamp(), vehicle.propulsion.blades.angles))

    def publish_command(self, vehicle: Vehicle, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the current command, which may also change while the simulation is paused."""
        if self._command.get_num_connections():
            self._command.publish(message_conversion.command(stamp(), vehicle.commands.now, self._track_base))


class SensorOutput:
    """The topics of one sensor, one for each of its outputs; messages are made only for topics with subscribers."""

    def __init__(self, vehicle: VehicleParameters, sensor: Instrument, names: Mapping[str, str] | None = None):
        """Advertise the sensor's outputs in the vehicle's namespace, or those with a suffix in `names` as they say.

        Raises ValueError for a message type that is not installed.
        """
        own: SensorParameters = sensor.parameters
        self._frame = frame(vehicle, own.frame)
        names = names or {output.suffix: f"{own.topic}{output.suffix}" for output in sensor.outputs}
        self._publishers = {
            suffix: rospy.Publisher(full_name(vehicle.name, topic), message_class(kind), queue_size=_READINGS_QUEUE)
            for suffix, topic in names.items()
            for kind in [output.kind for output in sensor.outputs if output.suffix == suffix]
        }
        self.follow(sensor)

    def follow(self, sensor: Instrument) -> None:
        """Use this sensor from now on; its place and parameters are those of the last one."""
        self._sensor = sensor

    def close(self) -> None:
        for publisher in self._publishers.values():
            publisher.unregister()

    def publish(self, stamp: Stamp, now: float) -> None:
        """Publish the readings of a step that ended at `now` (s of simulated time), each stamped with its own time."""
        sensor = self._sensor
        is_heard = {suffix: publisher.get_num_connections() for suffix, publisher in self._publishers.items()}
        heard = [output for output in sensor.outputs if is_heard.get(output.suffix)]
        for reading in sensor.readings if heard else ():
            measured = sensor.header(reading)["stamp"]
            header = {"stamp": stamp(now - measured), "frame_id": self._frame}
            for output in heard:
                publisher = self._publishers[output.suffix]
                publisher.publish(fill(publisher.data_class(), output.fields(reading.value, header), output.kind))


# ---- frames


class Transforms:
    """Broadcasts the poses of vehicles once a step, and those of the links of their URDFs.

    Children of `world` are base_link, Track_base and cameras with a `mount`; links have the parents of the URDF, and
    sensors that of their carrier. Frames that do not move relative to base_link are published once, on /tf_static; so
    is the frame that rviz follows: Track_base of the first vehicle, whatever its name, or `world`.
    """

    def __init__(self, simulation: Simulation, stamp: Stamp) -> None:
        """Advertise for the vehicles of `simulation`; `stamp` returns the stamp of messages that are sent now."""
        self._simulation, self._stamp = simulation, stamp
        self._new_subscribers = NewSubscribers()
        self._moving = rospy.Publisher("/tf", TFMessage, subscriber_listener=self._new_subscribers, queue_size=100)
        self._fixed = rospy.Publisher("/tf_static", TFMessage, queue_size=10, latch=True)
        self._display_throttle = Throttle(_DISPLAY_PERIOD)

    def publish_static(self) -> None:
        """Publish the fixed links; called when vehicles are added or removed."""
        now, vehicles = self._stamp(), self._simulation.vehicles.values()
        first = next((frame(vehicle.parameters, TRACK_BASE) for vehicle in vehicles), WORLD_FRAME)
        fixed = [transform(now, first, first_frame(rospy.get_name()), frames.IDENTITY)]
        for vehicle in vehicles:
            body, own = vehicle.body, vehicle.parameters
            fixed += [_link(now, vehicle, name) for name in body.links if name not in body.rigid.blade_joints]
            fixed += [
                transform(now, frame(own, BASE_LINK), frame(own, name), matrix)
                for name, matrix in vehicle.instruments.fixed_frames.items()
            ]
        self._fixed.publish(TFMessage(fixed))

    def publish(self) -> None:
        """Publish all moving frames: tf2 takes only one transform for each stamp."""
        if not self._moving.get_num_connections():
            return
        self._new_subscribers.take()  # the messages below reach them, too
        now, vehicles = self._stamp(), self._simulation.vehicles.values()
        self._moving.publish(TFMessage([each for vehicle in vehicles for each in _moving(now, vehicle)]))
        if self._display_throttle.passes():
            self._moving.publish(TFMessage([each for vehicle in vehicles for each in _turning(now, vehicle)]))

    def tell_new_subscribers(self) -> None:
        """Send the moving frames, with the present stamp, to new subscribers only."""
        for send in self._new_subscribers.take():
            now = self._stamp()
            vehicles = self._simulation.vehicles.values()
            send(TFMessage([each for own in vehicles for each in (*_moving(now, own), *_turning(now, own))]))


def _moving(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    own = vehicle.parameters
    places = {
        BASE_LINK: vehicle.body.matrix,
        TRACK_BASE: vehicle.track.matrix(),
        # The URDF does not know cameras with a mount; the frame of a stereo pair is its left camera's.
        **{
            camera.frame: vehicle.optical(camera)
            for camera in own.cameras.values()
            if camera.mount and not camera.baseline
        },
        **{name: matrix() for name, matrix in vehicle.instruments.moving_frames.items()},
    }
    return [transform(now, WORLD_FRAME, frame(own, name), matrix) for name, matrix in places.items()]


def _turning(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    angles = vehicle.propulsion.blades.angles
    return [
        _link(now, vehicle, link, angles.get(joint, 0.0)) for link, joint in vehicle.body.rigid.blade_joints.items()
    ]


def _link(now: rospy.Time, vehicle: Vehicle, name: str, angle: float = 0.0) -> TransformStamped:
    """Return the transform of a link relative to its parent, turned about its z axis."""
    parent, matrix = vehicle.body.links[name]
    if angle:
        matrix = frames.multiply(matrix, frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angle)))
    return transform(now, frame(vehicle.parameters, parent), frame(vehicle.parameters, name), matrix)
