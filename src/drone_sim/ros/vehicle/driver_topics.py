"""Topics that a vehicle publishes under a driver's names: messages of any installed type, and copies of our topics."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import rospy
from std_msgs.msg import Header

from drone_sim.config.types import ParameterError, nested
from drone_sim.mechanics import frames
from drone_sim.message_text import near_names
from drone_sim.ros.core.message_conversion import BASE_LINK, fill, frame, full_name, message_class
from drone_sim.ros.core.message_conversion import pose as pose_message
from drone_sim.ros.core.message_conversion import twist as twist_message
from drone_sim.ros.core.publishing import NewSubscribers, Stamp
from drone_sim.ros.vehicle.cameras import CameraOutput
from drone_sim.ros.vehicle.outputs import SensorOutput
from drone_sim.sensors.battery import Battery
from drone_sim.sensors.imu import Imu
from drone_sim.vehicles.driver import DriverTopic, Source
from drone_sim.vehicles.vehicle import Vehicle

_QUEUE_SIZE = 10
_MOVING = 0.001  # of a command: the Bebop's driver takes smaller numbers for zero
_FULL = 100.0  # %, of a vehicle without a battery


class Missing:
    """Names of the topics and services whose message types are not in the user's workspace."""

    def __init__(self) -> None:
        self._names: dict[str, list[str]] = defaultdict(list)  # by package

    @contextlib.contextmanager
    def noted(self, kind: str | None, name: str) -> Iterator[None]:
        """Note the topic or service if its type cannot be found: message_class and service_class raise ValueError."""
        try:
            yield
        except ParameterError:  # of a field of an installed type
            raise
        except ValueError:
            self._names[str(kind).partition("/")[0]].append(rospy.resolve_name(name))

    def warn(self) -> None:
        """Log one line for each package."""
        for package, names in self._names.items():
            rospy.logwarn(f"the package {package} is not in your workspace, so these are not there: {', '.join(names)}")


class DriverMessage:
    """A topic whose message has quantities of the vehicle in its fields."""

    def __init__(self, vehicle: Vehicle, name: str, entry: DriverTopic, kind: type):
        """Advertise messages of this kind. Raises ParameterError if it has no such fields."""
        self._entry, self._type = entry, kind
        self._frame, self._header_frame = (frame(vehicle.parameters, name) for name in (BASE_LINK, entry.frame))
        try:
            self._whole = {path for path in entry.fields if _slot_type(kind, path).strip("u").startswith("int")}
            self._message(self._values(vehicle, rospy.Time()))
        except ValueError as error:
            raise ParameterError(str(error), ("topics", name, "fields")) from None
        topic = full_name(vehicle.name, entry.topic)
        self.publisher = rospy.Publisher(topic, self._type, queue_size=_QUEUE_SIZE, latch=entry.latch)
        self._steps = 0
        self._sent: dict[str, Any] = {}

    def publish(self, vehicle: Vehicle, stamp: Stamp) -> None:
        """Publish every `every` steps, to subscribers; if it is latched, when a value has changed."""
        self._steps += 1
        if self._steps % self._entry.every or not (self._entry.latch or self.publisher.get_num_connections()):
            return
        values = self._values(vehicle, stamp())
        if self._entry.latch:
            fields = {path: value for path, value in values.items() if not isinstance(value, Header)}
            if fields == self._sent:
                return
            self._sent = fields
        self.publisher.publish(self._message(values))

    def _message(self, values: Mapping[str, Any]) -> Any:
        whole = {path: round(values[path]) for path in self._whole}
        return fill(self._type(), nested({**values, **whole}.items()), str(self._entry.type))

    def _values(self, vehicle: Vehicle, stamp: rospy.Time) -> dict[str, Any]:
        return {path: self._value(source, vehicle, stamp) for path, source in self._entry.fields.items()}

    def _value(self, source: Source, vehicle: Vehicle, stamp: rospy.Time) -> Any:
        if not source.quantity:
            return source.factor
        if source.quantity == "header":
            return Header(stamp=stamp, frame_id=self._header_frame)
        if source.quantity == "child_frame":
            return self._frame
        if source.quantity == "state":  # the driver's word or number; `hovering` is flying without a command
            states, state, command = self._entry.states, str(vehicle.flight_state), vehicle.commands.now
            if state == "flying" and "hovering" in states:
                is_still = max(map(abs, (*command.linear, *command.angular))) < _MOVING
                state = "hovering" if is_still else state
            return states.get(state, states.get("other", state))
        value = _QUANTITIES[source.quantity](vehicle)
        if source.part:
            value = getattr(value, source.part)
        return value * source.factor if isinstance(value, float) else value


def _slot_type(kind: type, path: str) -> str:
    """Return the type of a message's field, given by names with dots between. Raises ValueError if there is none."""
    slots, message = "", kind()
    for name in path.split("."):
        types = dict(zip(message.__slots__, message._slot_types))
        if name not in types:
            raise ValueError(f"{message._type} has no field '{name}'; it has {', '.join(types)}")
        slots, message = types[name], getattr(message, name)
    return slots


def _twist(vehicle: Vehicle, world_from_frame: frames.Matrix) -> Any:
    """Return linear and angular velocity in a frame."""
    state, back = vehicle.body.state, frames.invert(world_from_frame)
    return twist_message(frames.rotate(back, state.linear_velocity), frames.rotate(back, state.angular_velocity))


def _level(vehicle: Vehicle) -> frames.Matrix:
    return frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, _rpy(vehicle)[2]))


def _rpy(vehicle: Vehicle) -> frames.Vector:
    return frames.to_rpy(vehicle.body.matrix)


def _percent(vehicle: Vehicle) -> float:
    for sensor in vehicle.instruments.by_name.values():
        if isinstance(sensor, Battery) and sensor.latest:
            return _FULL * sensor.latest.value.charge / sensor.parameters.capacity
    return _FULL


def _specific_force(vehicle: Vehicle) -> Any:
    """Return the last specific force (m/s^2) of the vehicle's first IMU, 0 without one."""
    imus = [sensor for sensor in vehicle.instruments.by_name.values() if isinstance(sensor, Imu)]
    force = next((imu.latest.value.specific_force for imu in imus if imu.latest), (0.0, 0.0, 0.0))
    return twist_message(force, force).linear


_QUANTITIES: Mapping[str, Callable[[Vehicle], Any]] = {
    "time": lambda vehicle: vehicle.context.clock.time,
    "pose": lambda vehicle: pose_message(vehicle.body.matrix),
    "position": lambda vehicle: pose_message(vehicle.body.matrix).position,
    "orientation": lambda vehicle: pose_message(vehicle.body.matrix).orientation,
    "roll": lambda vehicle: _rpy(vehicle)[0],
    "pitch": lambda vehicle: _rpy(vehicle)[1],
    "yaw": lambda vehicle: _rpy(vehicle)[2],
    "twist_body": lambda vehicle: _twist(vehicle, vehicle.body.matrix),
    "twist_level": lambda vehicle: _twist(vehicle, _level(vehicle)),
    "twist_world": lambda vehicle: _twist(vehicle, frames.IDENTITY),
    "velocity_body": lambda vehicle: _twist(vehicle, vehicle.body.matrix).linear,
    "velocity_level": lambda vehicle: _twist(vehicle, _level(vehicle)).linear,
    "velocity_world": lambda vehicle: _twist(vehicle, frames.IDENTITY).linear,
    "angular_velocity": lambda vehicle: _twist(vehicle, vehicle.body.matrix).angular,
    "specific_force": _specific_force,
    "battery": _percent,
}


class DriverOutputs:
    """Everything that a vehicle publishes under a driver's names."""

    def __init__(self, vehicle: Vehicle, new_subscribers: NewSubscribers):
        """Advertise; name the topics whose message types are not installed. Raises ParameterError."""
        self.messages: list[DriverMessage] = []
        self.cameras: list[tuple[str, CameraOutput]] = []  # by the name of the camera or sensor
        self.sensors: list[tuple[str, SensorOutput]] = []
        missing = Missing()
        for name, entry in vehicle.parameters.topics.items():
            if entry.copies:
                self._copy(vehicle, name, entry, new_subscribers)
            elif entry.fields:
                with missing.noted(entry.type, full_name(vehicle.name, entry.topic)):
                    kind = message_class(str(entry.type))
                    self.messages.append(DriverMessage(vehicle, name, entry, kind))
        missing.warn()

    def _copy(self, vehicle: Vehicle, name: str, entry: DriverTopic, new_subscribers: NewSubscribers) -> None:
        """Advertise a topic of a camera or sensor under another name. Raises ParameterError if there is none."""
        parameters, wanted = vehicle.parameters, entry.copies
        known: list[str] = []
        for camera, its in parameters.cameras.items():
            known.append(its.topic)
            if its.topic == wanted:
                named = its.model_copy(update={"topic": entry.topic})
                copy = CameraOutput(parameters, vehicle.cameras[camera], named, new_subscribers)
                self.cameras.append((camera, copy))
                return
        for sensor, instrument in vehicle.instruments.by_name.items():
            topics = {output.suffix: f"{instrument.parameters.topic}{output.suffix}" for output in instrument.outputs}
            known += topics.values()
            for suffix in [suffix for suffix, topic in topics.items() if topic == wanted]:
                self.sensors.append((sensor, SensorOutput(parameters, instrument, {suffix: entry.topic})))
                return
        why = f"no such topic of a camera or sensor; {near_names(str(wanted), known)}"
        raise ParameterError(why, ("topics", name, "copies"), str(wanted))

    def close(self) -> None:
        """Unregister the topics of messages; those of cameras and sensors belong to VehicleTopics."""
        for message in self.messages:
            message.publisher.unregister()
