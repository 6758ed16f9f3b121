"""The record of a flight that the criteria judge: a table with a row per step, contacts, values and other objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from drone_sim.offline.recording import COLUMNS

# A vehicle that moved farther between two rows than this was moved by a script or a client.
_SPEED_MARGIN = 2.0  # times the way that its speed explains
_DISTANCE_MARGIN = 0.01  # m


class ContactEvent(NamedTuple):
    """The vehicle touched the object `name` during the step that ended at `at` (s)."""

    at: float
    name: str  # as the sensor `contacts` gives it


class ValueChange(NamedTuple):
    """A new value of a signal, a topic or the flight state, from `at` (s) on; None for a signal that was cleared."""

    at: float
    value: Any


@dataclass(frozen=True)
class FlightRecord:
    """A flight of one vehicle. `rows` (N, 22) have offline.recording.COLUMNS, N >= 1, times increasing.

    `is_whole`: it lasted as long as the plan says. The other fields hold what the criteria need; grade_live, which only
    listens to topics, may leave some empty.
    """

    rows: np.ndarray
    is_whole: bool = True
    contacts: Sequence[ContactEvent] = ()  # by time; one for each object and step
    states: Sequence[ValueChange] = ()  # the script's flight state: docs/states.md
    values: Mapping[str, Sequence[ValueChange]] = field(default_factory=dict)  # by the names of signals and topics
    object_poses: Mapping[str, np.ndarray] = field(default_factory=dict)  # (N, 7): position, quaternion xyzw, by name
    objects_by_path: Mapping[str, Sequence[str]] = field(default_factory=dict)  # names of the objects a path finds
    paths: Mapping[str, np.ndarray] = field(default_factory=dict)  # (K, 3): the scene's paths at the start, m, world

    @cached_property
    def columns(self) -> dict[str, np.ndarray]:
        """The columns named in UNITS, (N,) each."""
        return columns_of(self.rows)

    @property
    def times(self) -> np.ndarray:
        """Simulated time of each row in s, (N,)."""
        return self.rows[:, 0]

    @property
    def end(self) -> float:
        """Simulated time of the last row in s."""
        return float(self.rows[-1, 0])

    @property
    def teleports(self) -> np.ndarray:
        """The rows (M,) that are farther from the row before than the vehicle's speed explains."""
        distances = np.linalg.norm(np.diff(self.rows[:, 1:4], axis=0), axis=1)
        speeds = self.columns["speed"]
        limits = _distance_limit(np.maximum(speeds[:-1], speeds[1:]), np.diff(self.times))
        return np.flatnonzero(distances > limits) + 1

    def begins_at(self, position: Sequence[float]) -> bool:
        """Return whether the vehicle can have flown from `position` (m) at 0 s to its first row."""
        distance = np.linalg.norm(self.rows[0, 1:4] - position)
        return bool(distance <= _distance_limit(self.columns["speed"][0], self.times[0]))

    def until(self, row: int) -> FlightRecord:
        """Return the flight before a row, which is not its first."""
        poses = {name: poses[:row] for name, poses in self.object_poses.items()}
        return replace(self, rows=self.rows[:row], is_whole=False, object_poses=poses)


def _distance_limit(speed: Any, seconds: Any) -> Any:
    """Return how far (m) a vehicle may get at a speed (m/s) in some seconds."""
    return _DISTANCE_MARGIN + _SPEED_MARGIN * speed * seconds


_RECORDED_NAMES = [name.partition(" ")[0] for name in COLUMNS]
UNITS = {  # of the columns that a criterion can read
    "t": "s",
    **dict.fromkeys("xyz", "m"),
    **dict.fromkeys(("roll", "pitch", "yaw", "tilt"), "rad"),
    **dict.fromkeys(("vx", "vy", "vz", "world_vx", "world_vy", "speed"), "m/s"),
    **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
    **dict.fromkeys(("command_vx", "command_vy", "command_vz"), "m/s"),
    "command_wz": "rad/s",
    **dict.fromkeys((f"propeller{number}" for number in (1, 2, 3, 4)), "m/s"),
}


def columns_of(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns named in UNITS of a table (N, 22).

    roll, pitch, yaw (rad) follow ROS's convention, with yaw unwrapped. tilt is the angle between the body's and the
    world's z. vx, vy, vz are the velocity in the track frame (at the drone, level, turned by its yaw), like commands;
    world_vx, world_vy, wx, wy and wz are in the world frame, like the table.
    """
    recorded = {name: rows[:, index] for index, name in enumerate(_RECORDED_NAMES)}
    x, y, z, w = rows[:, 4:8].T
    r00, r01 = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w)
    r10, r20 = 2 * (x * y + z * w), 2 * (x * z - y * w)
    r21, r22 = 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    turn = np.arctan2(-r01, r00)  # V-REP's gamma, the yaw of Track_base
    east, north, up = rows[:, 8:11].T
    computed = {
        "roll": np.arctan2(r21, r22),
        "pitch": np.arcsin(np.clip(-r20, -1, 1)),
        "yaw": np.unwrap(np.arctan2(r10, r00)),
        "tilt": np.arccos(np.clip(r22, -1, 1)),
        "vx": np.cos(turn) * east + np.sin(turn) * north,
        "vy": np.cos(turn) * north - np.sin(turn) * east,
        "world_vx": east,
        "world_vy": north,
        "speed": np.sqrt(east**2 + north**2 + up**2),
    }
    return {name: column for name, column in {**recorded, **computed}.items() if name in UNITS}
