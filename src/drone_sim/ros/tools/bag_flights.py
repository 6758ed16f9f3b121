"""The flight of one vehicle out of a bag: what it did and was told, pushes and jumps, and what its sensors measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from drone_sim.forces.pushes import Push
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose
from drone_sim.offline.plot_sensors import Series
from drone_sim.offline.recording import Recording
from drone_sim.offline.tables import LARGEST
from drone_sim.offline.timeline import Entry, Timeline
from drone_sim.ros.tools.bags import Bag, BagRefused, Heard
from drone_sim.vehicles.requests import POSE

ODOMETRY, TWIST, COMMAND = "nav_msgs/Odometry", "geometry_msgs/Twist", "geometry_msgs/TwistStamped"
STATE, PUSH = "std_msgs/String", "geometry_msgs/WrenchStamped"
_SUFFIX = "/odom"
_TICK = 1e-6  # s, between stamps that are the same
_UNIT = 1e-3  # by which a quaternion's norm may be off
_PUSH = 0.2  # s, that a push lasts unless a parameter says otherwise, which a bag does not know
_STEP = 0.05  # s, of simulations as they mostly are
_REAL = 1e8  # s; stamps so late are of real time, which counts from 1970


class BagFlight:
    """What a bag knows of one vehicle. Times are in s since its first odometry, by its stamps."""

    def __init__(self, bag: Bag, vehicle: str | None = None):
        """Read the odometry of a vehicle, by default of the first. Raises BagRefused."""
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
            raise BagRefused(f"{bag.path}: no message on {topic} that can be read")
        table = np.array([rows[stamp] for stamp in stamps])
        self._stamps, self._came, self._rows = np.array(stamps), table[:, 0], table[:, 1:]
        self.start = stamps[0]

    def recording(self) -> Recording:
        """Return the flight as a table, NaN where the propellers were not recorded. Raises BagRefused."""
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
        """Return the poses that it was put to, and the pushes. Raises BagRefused."""
        entries = []
        for name, kind in (("set_pose", POSE), ("initialpose", "geometry_msgs/PoseWithCovarianceStamped")):
            for one in self._bag.read(f"{self.namespace}/{name}", kind):
                pose = getattr(one.message.pose, "pose", one.message.pose)
                entries.append(Entry(self._time(one), Pose((pose.position.x, pose.position.y, pose.position.z))))
        for one in self._bag.read(f"{self.namespace}/push", PUSH):
            wrench = one.message.wrench
            entries.append(Entry(self._time(one), Push(_xyz(wrench.force), _xyz(wrench.torque), _PUSH)))
        end = float(self._stamps[-1]) - self.start
        return Timeline([one for one in entries if 0 <= one.at <= end], _STEP)

    def _time(self, heard: Heard) -> float:
        return heard.at - self.start

    def sensors(self) -> list[Series]:
        """Return what the vehicle's sensors measured. Raises BagRefused."""
        found = []
        for topic in self._bag.topics(*_MEASURED):
            name = topic.removeprefix(f"{self.namespace}/")
            if name != topic and name not in _NO_SENSORS and not name.endswith("_raw"):
                heard = list(self._bag.read(topic, self._bag.kinds[topic]))
                found += [self._series(name, what, heard) for what in _MEASURED[self._bag.kinds[topic]] if heard]
        return found

    def _series(self, name: str, what: _Measured, heard: Iterable[Heard]) -> Series:
        times = np.array([_stamp(one) - self.start for one in heard])
        values = np.array([what.read(one.message) for one in heard], dtype=float) * what.scale
        return Series(name, what.unit, times, values, ("x", "y", "z")[: values.shape[1]] if what.axes else ())

    # ---- at a moment

    def steps(self) -> BagSteps:
        """Return the simulation's steps. Raises BagRefused where it was started anew meanwhile."""
        if np.any(np.diff(self._came) < 0):
            raise BagRefused(f"{self._bag.path}: time goes back in it, as at every start: one flight in one bag")
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
        """Take the stamps (s), and the command in force in each."""
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
    """Return the last of four values, each with its time, at each of these times (s); `before` where there is none."""
    held = np.full((len(times), 4), before)
    if values:
        values.sort(key=lambda one: one[0])
        given = np.array([numbers for _, numbers in values])
        last = np.searchsorted([at for at, _ in values], times, "right") - 1
        held[last >= 0] = given[last[last >= 0]]
    return held


def _stamp(heard: Heard) -> float:
    return float(heard.message.header.stamp.to_sec())


def _xyz(vector: Any) -> frames.Vector:
    return vector.x, vector.y, vector.z


def _command(twist: Any) -> list[float]:
    return [*_xyz(twist.linear), twist.angular.z]


def _state(message: Any) -> tuple[float, ...]:
    """Return position, quaternion and velocities in the world; nothing where they are none."""
    turn = message.pose.pose.orientation
    place, quaternion = _xyz(message.pose.pose.position), (turn.x, turn.y, turn.z, turn.w)
    linear, angular = _xyz(message.twist.twist.linear), _xyz(message.twist.twist.angular)
    if (
        not all(abs(value) < LARGEST for value in (*place, *linear, *angular))
        or not abs(math.hypot(*quaternion) - 1) < _UNIT
    ):
        return ()
    matrix = frames.from_quaternion(place, quaternion)
    return *place, *quaternion, *frames.rotate(matrix, linear), *frames.rotate(matrix, angular)


# ---- sensors


class _Measured(NamedTuple):
    unit: str
    read: Callable[[Any], tuple[float, ...]]
    scale: float = 1.0
    axes: bool = False


_NO_SENSORS = ("push",)  # but what is done to the vehicle
_MEASURED = {
    "sensor_msgs/Imu": (
        _Measured("acceleration [m/s²]", lambda message: _xyz(message.linear_acceleration), axes=True),
        _Measured("turning [rad/s]", lambda message: _xyz(message.angular_velocity), axes=True),
    ),
    "sensor_msgs/Range": (_Measured("range [m]", lambda message: (message.range,)),),
    "sensor_msgs/MagneticField": (
        _Measured("field [µT]", lambda message: _xyz(message.magnetic_field), 1e6, axes=True),
    ),
    "sensor_msgs/FluidPressure": (_Measured("pressure [hPa]", lambda message: (message.fluid_pressure,), 1e-2),),
    "sensor_msgs/NavSatFix": (_Measured("altitude [m]", lambda message: (message.altitude,)),),
    "sensor_msgs/BatteryState": (_Measured("voltage [V]", lambda message: (message.voltage,)),),
    "geometry_msgs/PointStamped": (_Measured("height [m]", lambda message: (message.point.z,)),),
    "geometry_msgs/WrenchStamped": (_Measured("force [N]", lambda message: _xyz(message.wrench.force), axes=True),),
}
