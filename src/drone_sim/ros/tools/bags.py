"""Bags, read with care, and the flight of one vehicle out of a bag.

Errors are told in one line, and no message class is generated from the definitions in the bag.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
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
_TICK = 1e-6  # s, between stamps that are the same
_UNIT = 1e-3  # by which a quaternion's norm may be off
_PUSH = 0.2  # s, that a push lasts unless a parameter says otherwise, which a bag does not know
_STEP = 0.05  # s, of simulations as they mostly are
_REAL = 1e8  # s; stamps so late are of real time, which counts from 1970
MAX_MESSAGES = 500_000  # of one topic
MAX_CHUNK = 256 * MEBIBYTE  # of messages that are unpacked together; rosbag record makes chunks of 768 KiB
# What is wrong with a bag is one line; of a name in it that is no text genpy would log another one.
logging.getLogger("rosout").addFilter(lambda record: not str(record.msg).startswith("Characters replaced"))


class BagError(ValueError):
    """A bag cannot be read; one line that names it and says why."""


class RecordedMessage(NamedTuple):
    """A message, and when it was recorded (s, of the recorder's clock)."""

    at: float
    message: Any


class Bag:
    """An open bag. Its messages are of the classes that are installed here; those of other versions are left out."""

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
            largest = max((one.uncompressed_size for one in self._bag._chunk_headers.values()), default=0)
        if largest > MAX_CHUNK:
            raise BagError(f"{path}: a chunk of {largest} bytes; at most {MAX_CHUNK} are allowed")
        self.kinds: dict[str, str] = {name: one.msg_type for name, one in topics.items()}
        self._counts = {name: one.message_count for name, one in topics.items()}

    def close(self) -> None:
        """Close it."""
        self._bag.close()

    def topics(self, *kinds: str) -> list[str]:
        """Return the names of the topics of these kinds of message."""
        return sorted(name for name, kind in self.kinds.items() if kind in kinds)

    def read(self, topic: str, kind: str) -> Iterator[RecordedMessage]:
        """Yield what was recorded of a topic, in the order of time; nothing for one that is not there.

        `kind` is a message type, such as nav_msgs/Odometry; messages of other types are left out. Raises BagError.
        """
        if self._counts.get(topic, 0) > MAX_MESSAGES:
            raise BagError(f"{self.path}: {self._counts[topic]} messages on {topic}; at most {MAX_MESSAGES} are read")
        if self.kinds.get(topic) != kind:
            return
        sum_of_ours = message_class(kind)._md5sum
        rosbag.bag._message_types[sum_of_ours] = message_class(kind)  # or rosbag would run code made from the bag's own
        messages = self._bag.read_messages(
            [topic], connection_filter=lambda _topic, _type, md5sum, *_: md5sum == sum_of_ours
        )
        while True:
            with self._reading():
                found = next(messages, None)
            if found is None:
                return
            yield RecordedMessage(found[2].to_sec(), found[1])

    def named(self, topic: str | None, among: list[str], what: str) -> str:
        """Return the topic that is meant, by default the first of these. Raises BagError."""
        if topic is None and among:
            return among[0]
        if topic in among:
            return str(topic)
        there = near_names(topic or "", among) if among else f"there is no {what} in it"
        raise BagError(f"{self.path}: {f'no {what} {topic}; ' if topic else ''}{there}")

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        """Turn any error that a broken file causes into a BagError with one line."""
        try:
            yield
        except OSError:
            raise
        except rosbag.ROSBagUnindexedException:
            why = "was cut off while it was recorded; `rosbag reindex` repairs a copy of it"
            raise BagError(f"{self.path}: {why}") from None
        except Exception as error:  # rosbag lets through what struct, bz2, genpy and the like raise
            said = " ".join(str(error).split()) or type(error).__name__
            raise BagError(f"{self.path}: cannot be read as a bag: {said:.120}") from None


class BagFlight:
    """What a bag knows of one vehicle. Times are in s since its first odometry, by its stamps."""

    def __init__(self, bag: Bag, vehicle: str | None = None):
        """Read the odometry in `bag` of a vehicle, by default of the first. Raises BagError."""
        self._bag = bag
        topics = [name for name in bag.topics(ODOMETRY) if name.endswith(_SUFFIX)]
        wanted = None if vehicle is None else f"/{vehicle.strip('/')}{_SUFFIX}"
        topic = bag.named(wanted, topics, "odometry")
        self.namespace = topic.removesuffix(_SUFFIX)
        rows = {
            _stamp(heard): (heard.at, *_state(heard.message)) for heard in bag.read(topic, ODOMETRY)
        }  # of one stamp the last
        stamps = [stamp for stamp in sorted(rows) if len(rows[stamp]) > 1]
        if not stamps:
            raise BagError(f"{bag.path}: no readable message on {topic}")
        table = np.array([rows[stamp] for stamp in stamps])
        self._stamps, self._came, self._rows = np.array(stamps), table[:, 0], table[:, 1:]
        self.start = stamps[0]

    def recording(self) -> Recording:
        """Return the flight as a table, NaN where the propellers were not recorded. Raises BagError."""
        columns = ((self._stamps - self.start)[:, None], self._rows, self._commands(), self._propellers())
        recording = Recording()
        recording.clock = "time by the stamps"
        table = np.hstack(columns)
        table[~(np.abs(table) < LARGEST)] = math.nan
        recording.rows = [tuple(row) for row in cast("list[list[float]]", table.tolist())]
        return recording

    def _commands(self) -> np.ndarray:
        """Return, for every row, the command in force or, where those were not recorded, the last that was sent."""
        in_force = f"{self.namespace}/command"
        if self._bag.kinds.get(in_force) == COMMAND:
            heard = [(_stamp(one), _command(one.message.twist)) for one in self._bag.read(in_force, COMMAND)]
            return _held(heard, self._stamps + _TICK, 0.0)
        sent = [(one.at, _command(one.message)) for one in self._bag.read(f"{self.namespace}/cmd_vel", TWIST)]
        return _held(sent, self._stamps, 0.0)

    def _propellers(self) -> np.ndarray:
        """Return, for every row, the propellers' velocities, which are published right after it, without a stamp."""
        heard = self._bag.read(f"{self.namespace}/propellers", "std_msgs/Float32MultiArray")
        told = [(one.at, list(one.message.data)) for one in heard if len(one.message.data) == 4]
        steps = np.diff(self._came)
        late = float(np.median(steps)) / 2 if len(steps) else _STEP
        return _held(told, self._came + late, math.nan)

    def timeline(self) -> Timeline:
        """Return the poses that it was put to, and the pushes. Raises BagError."""
        entries = []
        for name, kind in (("set_pose", POSE), ("initialpose", "geometry_msgs/PoseWithCovarianceStamped")):
            for one in self._bag.read(f"{self.namespace}/{name}", kind):
                pose = getattr(one.message.pose, "pose", one.message.pose)
                entries.append(Entry(one.at - self.start, Pose((pose.position.x, pose.position.y, pose.position.z))))
        for one in self._bag.read(f"{self.namespace}/push", PUSH):
            wrench = one.message.wrench
            entries.append(Entry(one.at - self.start, Push(xyz(wrench.force), xyz(wrench.torque), _PUSH)))
        end = float(self._stamps[-1]) - self.start
        return Timeline([one for one in entries if 0 <= one.at <= end], _STEP)

    def sensors(self) -> list[SensorSeries]:
        """Return what the vehicle's sensors measured. Raises BagError."""
        found = []
        for topic in self._bag.topics(*_MEASURED):
            name = topic.removeprefix(f"{self.namespace}/")
            if name != topic and name not in _NO_SENSORS and not name.endswith("_raw"):
                heard = list(self._bag.read(topic, self._bag.kinds[topic]))
                found += [self._series(name, what, heard) for what in _MEASURED[self._bag.kinds[topic]] if heard]
        return found

    def _series(self, name: str, what: _Measured, heard: Iterable[RecordedMessage]) -> SensorSeries:
        times = np.array([_stamp(one) - self.start for one in heard])
        values = np.array([what.read(one.message) for one in heard], dtype=float) * what.scale
        return SensorSeries(name, what.unit, times, values, ("x", "y", "z")[: values.shape[1]] if what.axes else ())

    # ---- at a moment

    def steps(self) -> BagSteps:
        """Return the simulation's steps. Raises BagError where it was started anew meanwhile."""
        if np.any(np.diff(self._came) < 0):
            raise BagError(f"{self._bag.path}: time jumps back in it, as at a restart: a bag must hold one flight")
        return BagSteps(self._stamps, self._commands())

    def row_at(self, stamp: float) -> tuple[float, ...]:
        """Return time, position, quaternion and velocities as of a stamp (s)."""
        index = max(0, int(np.searchsorted(self._stamps, stamp + _TICK, "right")) - 1)
        return stamp - self.start, *self._rows[index]


class BagSteps:
    """The steps of a flight: a row for each that was recorded, numbered from 0.

    In simulated time a stamp says which step it was; in real time the first one that was recorded counts as the first.
    """

    def __init__(self, stamps: np.ndarray, commands: np.ndarray):
        """Take the stamps (s), and the commands in force, one for each."""
        self._stamps, self._commands = stamps, commands
        self._step = float(np.median(np.diff(stamps))) if len(stamps) > 1 and stamps[0] < _REAL else _STEP
        self._before = round(float(stamps[0]) / self._step) - 1 if stamps[0] < _REAL else 0

    def row_after(self, moment: float) -> int:
        """Return the first row that is later than a moment (s, of the recorder's clock)."""
        return int(np.searchsorted(self._stamps, moment + _TICK, "right"))

    def begins(self, row: int, command: Sequence[float]) -> bool:
        """Tell whether a command came into force in a row."""
        if not 0 <= row < len(self._commands):
            return False
        before = self._commands[row - 1] if row else np.zeros(4)
        return np.array_equal(self._commands[row], command) and not np.array_equal(before, command)

    def time(self, row: int) -> float:
        """Return the simulated time (s) at which the step of a row began; rows beyond the last one go on."""
        if row < len(self._stamps) and self._stamps[0] < _REAL:
            number = round(float(self._stamps[row]) / self._step) - 1
        else:
            number = self._before + row
        return round(number * self._step, 9)


def _held(values: list[tuple[float, list[float]]], times: np.ndarray, before: float) -> np.ndarray:
    """Return the four numbers of `values` in force at each of `times` (s); `before` where there are none yet."""
    held = np.full((len(times), 4), before)
    if values:
        values.sort(key=lambda one: one[0])
        given = np.array([numbers for _, numbers in values])
        last = np.searchsorted([at for at, _ in values], times, "right") - 1
        held[last >= 0] = given[last[last >= 0]]
    return held


def _stamp(heard: RecordedMessage) -> float:
    return float(heard.message.header.stamp.to_sec())


def _command(twist: Any) -> list[float]:
    return [*xyz(twist.linear), twist.angular.z]


def _state(message: Any) -> tuple[float, ...]:
    """Return position, quaternion and velocities in the world; an empty tuple where they are not valid."""
    pose, twist = message.pose.pose, message.twist.twist
    values = (*xyz(pose.position), *xyz(twist.linear), *xyz(twist.angular))
    is_unit = abs(math.hypot(*xyzw(pose.orientation)) - 1) < _UNIT
    return odometry_row(message) if is_unit and all(abs(value) < LARGEST for value in values) else ()


# ---- sensors


class _Measured(NamedTuple):
    unit: str
    read: Callable[[Any], tuple[float, ...]]
    scale: float = 1.0
    axes: bool = False


_NO_SENSORS = ("push",)  # but what is done to the vehicle
_MEASURED = {
    "sensor_msgs/Imu": (
        _Measured("acceleration [m/s²]", lambda message: xyz(message.linear_acceleration), axes=True),
        _Measured("turning [rad/s]", lambda message: xyz(message.angular_velocity), axes=True),
    ),
    "sensor_msgs/Range": (_Measured("range [m]", lambda message: (message.range,)),),
    "sensor_msgs/MagneticField": (
        _Measured("field [µT]", lambda message: xyz(message.magnetic_field), 1e6, axes=True),
    ),
    "sensor_msgs/FluidPressure": (_Measured("pressure [hPa]", lambda message: (message.fluid_pressure,), 1e-2),),
    "sensor_msgs/NavSatFix": (_Measured("altitude [m]", lambda message: (message.altitude,)),),
    "sensor_msgs/BatteryState": (_Measured("voltage [V]", lambda message: (message.voltage,)),),
    "geometry_msgs/PointStamped": (_Measured("height [m]", lambda message: (message.point.z,)),),
    "geometry_msgs/WrenchStamped": (_Measured("force [N]", lambda message: xyz(message.wrench.force), axes=True),),
}
