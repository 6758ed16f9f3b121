"""Reading of bags, and of one vehicle's flight in a bag.

Errors are one line, and no message class is generated from the definitions in the bag.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import rosbag
import rosbag.bag

from drone_sim.files.resources import MEBIBYTE
from drone_sim.forces.pushes import Push
from drone_sim.mechanics.state import Pose
from drone_sim.message_text import near_names
from drone_sim.offline.recording import LARGEST, Recording, SensorSeries
from drone_sim.offline.timeline import Entry, Timeline
from drone_sim.ros.core.message_conversion import message_class, odometry_row, xyz, xyzw
from drone_sim.vehicles.commands import POSE

ODOMETRY, TWIST, COMMAND = "nav_msgs/Odometry", "geometry_msgs/Twist", "geometry_msgs/TwistStamped"
STATE, PUSH = "std_msgs/String", "geometry_msgs/WrenchStamped"
_SUFFIX = "/odom"
_TOLERANCE = 1e-6  # s, between equal stamps
_NORM_TOLERANCE = 1e-3  # of a unit quaternion
_PUSH_DURATION = 0.2  # s, the default of a parameter that is not in a bag
_DEFAULT_STEP = 0.05  # s
_FIRST_REAL_TIME = 1e8  # s; later stamps are of real time, which counts from 1970
MAX_MESSAGES = 500_000  # of one topic
MAX_CHUNK = 256 * MEBIBYTE  # of messages that are unpacked together; rosbag record makes chunks of 768 KiB
# genpy logs a line about a name in a bag that is not UTF-8. It would come in addition to our own line.
logging.getLogger("rosout").addFilter(lambda record: not str(record.msg).startswith("Characters replaced"))


class BagError(ValueError):
    """A bag cannot be read. The message is one line, with the bag's name and the reason."""


class RecordedMessage(NamedTuple):
    """A message, and its time by the recorder's clock (s)."""

    at: float
    message: Any


class Bag:
    """An open bag. Messages are read only if their type is installed here in the same version."""

    def __init__(self, path: str):
        """Open the file at `path`. Raises OSError and BagError."""
        self.path = path
        if not os.path.isfile(path):
            os.stat(path)
            raise BagError(f"{path}: is not a regular file")
        if not os.path.getsize(path):
            raise BagError(f"{path}: is empty")
        with self._reading():
            self._bag = rosbag.Bag(path)
            topics = self._bag.get_type_and_topic_info().topics
            largest = max((chunk.uncompressed_size for chunk in self._bag._chunk_headers.values()), default=0)
        if largest > MAX_CHUNK:
            raise BagError(f"{path}: a chunk of {largest} bytes; at most {MAX_CHUNK} are allowed")
        self.kinds: dict[str, str] = {name: topic.msg_type for name, topic in topics.items()}
        self._counts = {name: topic.message_count for name, topic in topics.items()}

    def close(self) -> None:
        self._bag.close()

    def topics(self, *kinds: str) -> list[str]:
        """Return the names of the topics with these message types, sorted."""
        return sorted(name for name, kind in self.kinds.items() if kind in kinds)

    def read(self, topic: str, kind: str) -> Iterator[RecordedMessage]:
        """Yield the messages of a topic in the order of time; none if the topic is missing or has another type.

        `kind` is a message type, such as nav_msgs/Odometry. Raises BagError.
        """
        if self._counts.get(topic, 0) > MAX_MESSAGES:
            raise BagError(f"{self.path}: {self._counts[topic]} messages on {topic}; at most {MAX_MESSAGES} are read")
        if self.kinds.get(topic) != kind:
            return
        installed_md5sum = message_class(kind)._md5sum
        # With an entry here, rosbag does not generate and run a class from the definition in the bag.
        rosbag.bag._message_types[installed_md5sum] = message_class(kind)
        messages = self._bag.read_messages(
            [topic], connection_filter=lambda _topic, _type, md5sum, *_: md5sum == installed_md5sum
        )
        while True:
            with self._reading():
                record = next(messages, None)
            if record is None:
                return
            yield RecordedMessage(record[2].to_sec(), record[1])

    def choose(self, topic: str | None, topics: list[str], what: str) -> str:
        """Return `topic`, or the first of `topics` if it is None. Raises BagError if it is not among `topics`.

        `what` names such a topic in the error.
        """
        if topic is None and topics:
            return topics[0]
        if topic in topics:
            return str(topic)
        hint = near_names(topic or "", topics) if topics else f"there is no {what} in it"
        raise BagError(f"{self.path}: {f'no {what} {topic}; ' if topic else ''}{hint}")

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        """Turn any error that a broken file causes into a BagError."""
        try:
            yield
        except OSError:
            raise
        except rosbag.ROSBagUnindexedException:
            reason = "was cut off while it was recorded; `rosbag reindex` repairs a copy of it"
            raise BagError(f"{self.path}: {reason}") from None
        except Exception as error:  # rosbag does not catch the exceptions of struct, bz2, genpy and others
            reason = " ".join(str(error).split()) or type(error).__name__
            raise BagError(f"{self.path}: cannot be read as a bag: {reason:.120}") from None


class BagFlight:
    """Flight of one vehicle in a bag. Times are in s since the stamp of its first odometry."""

    def __init__(self, bag: Bag, vehicle: str | None = None):
        """Read the odometry of a vehicle (default: the first). Raises BagError."""
        self._bag = bag
        topics = [name for name in bag.topics(ODOMETRY) if name.endswith(_SUFFIX)]
        requested = None if vehicle is None else f"/{vehicle.strip('/')}{_SUFFIX}"
        topic = bag.choose(requested, topics, "odometry")
        self.namespace = topic.removesuffix(_SUFFIX)
        # Of several messages with one stamp, the last one counts.
        rows = {_stamp(odometry): (odometry.at, *_state(odometry.message)) for odometry in bag.read(topic, ODOMETRY)}
        stamps = [stamp for stamp in sorted(rows) if len(rows[stamp]) > 1]
        if not stamps:
            raise BagError(f"{bag.path}: no readable message on {topic}")
        table = np.array([rows[stamp] for stamp in stamps])
        self._stamps, self._recorded_at, self._rows = np.array(stamps), table[:, 0], table[:, 1:]
        self.start = stamps[0]

    def recording(self) -> Recording:
        """Return the flight as a table, with NaN where no propeller velocities were recorded. Raises BagError."""
        columns = ((self._stamps - self.start)[:, None], self._rows, self._commands(), self._propellers())
        recording = Recording()
        recording.clock = "time by the stamps"
        table = np.hstack(columns)
        table[~(np.abs(table) < LARGEST)] = math.nan
        recording.rows = [tuple(row) for row in cast("list[list[float]]", table.tolist())]
        return recording

    def _commands(self) -> np.ndarray:
        """Return, for each row, the command in force or, if that was not recorded, the last command that was sent."""
        in_force = f"{self.namespace}/command"
        if self._bag.kinds.get(in_force) == COMMAND:
            commands = [
                (_stamp(recorded), _command(recorded.message.twist)) for recorded in self._bag.read(in_force, COMMAND)
            ]
            return _hold(commands, self._stamps + _TOLERANCE, 0.0)
        sent = self._bag.read(f"{self.namespace}/cmd_vel", TWIST)
        return _hold([(recorded.at, _command(recorded.message)) for recorded in sent], self._stamps, 0.0)

    def _propellers(self) -> np.ndarray:
        """Return, for each row, the propellers' velocities. They are published right after it, without a stamp."""
        recorded = self._bag.read(f"{self.namespace}/propellers", "std_msgs/Float32MultiArray")
        velocities = [(each.at, list(each.message.data)) for each in recorded if len(each.message.data) == 4]
        periods = np.diff(self._recorded_at)
        delay = float(np.median(periods)) / 2 if len(periods) else _DEFAULT_STEP
        return _hold(velocities, self._recorded_at + delay, math.nan)

    def timeline(self) -> Timeline:
        """Return the poses that the vehicle was set to, and the pushes. Raises BagError."""
        entries = []
        for name, kind in (("set_pose", POSE), ("initialpose", "geometry_msgs/PoseWithCovarianceStamped")):
            for recorded in self._bag.read(f"{self.namespace}/{name}", kind):
                pose = getattr(recorded.message.pose, "pose", recorded.message.pose)
                entries.append(Entry(recorded.at - self.start, Pose(xyz(pose.position))))
        for recorded in self._bag.read(f"{self.namespace}/push", PUSH):
            wrench = recorded.message.wrench
            push = Push(xyz(wrench.force), xyz(wrench.torque), _PUSH_DURATION)
            entries.append(Entry(recorded.at - self.start, push))
        end = float(self._stamps[-1]) - self.start
        return Timeline([entry for entry in entries if 0 <= entry.at <= end], _DEFAULT_STEP)

    def sensors(self) -> list[SensorSeries]:
        """Return the measurements of the vehicle's sensors. Raises BagError."""
        series = []
        for topic in self._bag.topics(*_QUANTITIES):
            name = topic.removeprefix(f"{self.namespace}/")
            if name == topic or name in _NOT_SENSORS or name.endswith("_raw"):
                continue
            recorded = list(self._bag.read(topic, self._bag.kinds[topic]))
            times = np.array([_stamp(each) - self.start for each in recorded])
            for quantity in _QUANTITIES[self._bag.kinds[topic]] if recorded else ():
                values = np.array([quantity.read(each.message) for each in recorded], dtype=float) * quantity.scale
                axes = ("x", "y", "z")[: values.shape[1]] if quantity.has_axes else ()
                series.append(SensorSeries(name, quantity.label, times, values, axes))
        return series

    def steps(self) -> BagSteps:
        """Return the simulation's steps. Raises BagError if the simulation was restarted during the recording."""
        if np.any(np.diff(self._recorded_at) < 0):
            raise BagError(f"{self._bag.path}: time jumps back in it, as at a restart: a bag must hold one flight")
        return BagSteps(self._stamps, self._commands())

    def row_at(self, stamp: float) -> tuple[float, ...]:
        """Return time, position, quaternion and velocities at a stamp (s)."""
        index = max(0, int(np.searchsorted(self._stamps, stamp + _TOLERANCE, "right")) - 1)
        return stamp - self.start, *self._rows[index]


class BagSteps:
    """Steps of a flight: a row for each recorded step, numbered from 0.

    In simulated time the stamp gives the number of the simulation's step; in real time the first recorded step counts
    as the simulation's first.
    """

    def __init__(self, stamps: np.ndarray, commands: np.ndarray):
        """`stamps` (s) and `commands`, which are those in force, have a row for each step."""
        self._stamps, self._commands = stamps, commands
        self._is_simulated = bool(stamps[0] < _FIRST_REAL_TIME)
        has_period = len(stamps) > 1 and self._is_simulated
        self._step = float(np.median(np.diff(stamps))) if has_period else _DEFAULT_STEP
        self._first_number = round(float(stamps[0]) / self._step) - 1 if self._is_simulated else 0

    def row_after(self, moment: float) -> int:
        """Return the first row that is later than a moment (s, of the recorder's clock)."""
        return int(np.searchsorted(self._stamps, moment + _TOLERANCE, "right"))

    def begins(self, row: int, command: Sequence[float]) -> bool:
        """Return whether a command came into force in a row."""
        if not 0 <= row < len(self._commands):
            return False
        before = self._commands[row - 1] if row else np.zeros(4)
        return np.array_equal(self._commands[row], command) and not np.array_equal(before, command)

    def time(self, row: int) -> float:
        """Return the simulated time (s) at which the step of a row began; `row` may be after the last one."""
        if row < len(self._stamps) and self._is_simulated:
            number = round(float(self._stamps[row]) / self._step) - 1
        else:
            number = self._first_number + row
        return round(number * self._step, 9)


def _hold(values: list[tuple[float, list[float]]], times: np.ndarray, before: float) -> np.ndarray:
    """Return, for each of `times` (s), the last four numbers in `values`; `before` where there are none yet."""
    result = np.full((len(times), 4), before)
    if values:
        values.sort(key=lambda value: value[0])
        numbers = np.array([numbers for _, numbers in values])
        last = np.searchsorted([at for at, _ in values], times, "right") - 1
        result[last >= 0] = numbers[last[last >= 0]]
    return result


def _stamp(recorded: RecordedMessage) -> float:
    return float(recorded.message.header.stamp.to_sec())


def _command(twist: Any) -> list[float]:
    return [*xyz(twist.linear), twist.angular.z]


def _state(message: Any) -> tuple[float, ...]:
    """Return position, quaternion and velocities in the world; an empty tuple if they are not valid."""
    pose, twist = message.pose.pose, message.twist.twist
    values = (*xyz(pose.position), *xyz(twist.linear), *xyz(twist.angular))
    is_unit = abs(math.hypot(*xyzw(pose.orientation)) - 1) < _NORM_TOLERANCE
    return odometry_row(message) if is_unit and all(abs(value) < LARGEST for value in values) else ()


# ---- sensors


class _Quantity(NamedTuple):
    label: str  # with the unit
    read: Callable[[Any], tuple[float, ...]]
    scale: float = 1.0
    has_axes: bool = False


_NOT_SENSORS = ("push",)  # has the type of a sensor, but is a command
_QUANTITIES = {
    "sensor_msgs/Imu": (
        _Quantity("acceleration [m/s²]", lambda message: xyz(message.linear_acceleration), has_axes=True),
        _Quantity("turning [rad/s]", lambda message: xyz(message.angular_velocity), has_axes=True),
    ),
    "sensor_msgs/Range": (_Quantity("range [m]", lambda message: (message.range,)),),
    "sensor_msgs/MagneticField": (
        _Quantity("field [µT]", lambda message: xyz(message.magnetic_field), 1e6, has_axes=True),
    ),
    "sensor_msgs/FluidPressure": (_Quantity("pressure [hPa]", lambda message: (message.fluid_pressure,), 1e-2),),
    "sensor_msgs/NavSatFix": (_Quantity("altitude [m]", lambda message: (message.altitude,)),),
    "sensor_msgs/BatteryState": (_Quantity("voltage [V]", lambda message: (message.voltage,)),),
    "geometry_msgs/PointStamped": (_Quantity("height [m]", lambda message: (message.point.z,)),),
    "geometry_msgs/WrenchStamped": (_Quantity("force [N]", lambda message: xyz(message.wrench.force), has_axes=True),),
}
