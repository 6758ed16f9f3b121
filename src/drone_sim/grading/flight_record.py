"""The record of a flight for the criteria: a table with a row per step, and what does not fit into a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from drone_sim.offline.recording import COLUMNS

_FARTHEST = 2.0  # times as far as its speed says: a vehicle that got farther between two rows was put there
_ALWAYS = 0.01  # m, that are no jump


class ContactEvent(NamedTuple):
    """The vehicle touched something during the step that ended at `at` (s)."""

    at: float
    what: str  # its name, as the sensor `contacts` has it


class ValueChange(NamedTuple):
    """A signal, a topic or the flight state had another value from `at` (s) on; None: a signal was cleared."""

    at: float
    value: Any


@dataclass(frozen=True)
class FlightRecord:
    """A flight of one vehicle. `rows` (N, 22) are as offline.recording.COLUMNS says, N >= 1, times increasing.

    `is_whole`: it lasted as long as the plan says. The others hold what the criteria ask for; a flight that is only
    observed, over the topics of a node, may lack some.
    """

    rows: np.ndarray
    is_whole: bool = True
    contacts: Sequence[ContactEvent] = ()  # by time; one for each thing and step
    states: Sequence[ValueChange] = ()  # what the script says of its flight state: docs/states.md
    values: Mapping[str, Sequence[ValueChange]] = field(default_factory=dict)  # by the names of signals and topics
    other_poses: Mapping[str, np.ndarray] = field(default_factory=dict)  # (N, 7): position, quaternion xyzw, by name
    found: Mapping[str, Sequence[str]] = field(default_factory=dict)  # names of objects, by the path that finds them
    lines: Mapping[str, np.ndarray] = field(default_factory=dict)  # (K, 3): the scene's paths at the start, m, world

    @cached_property
    def columns(self) -> dict[str, np.ndarray]:
        """Every column that a criterion may be `of`, by name; each (N,)."""
        return columns_of(self.rows)

    @property
    def times(self) -> np.ndarray:
        """Simulated time of each row in s, (N,)."""
        return self.rows[:, 0]

    @property
    def puts(self) -> np.ndarray:
        """The rows (M,) where the vehicle is farther from the row before than its speed allows: it was put there."""
        ways = np.linalg.norm(np.diff(self.rows[:, 1:4], axis=0), axis=1)
        speeds = self.columns["speed"]
        return np.flatnonzero(ways > _could(np.maximum(speeds[:-1], speeds[1:]), np.diff(self.times))) + 1

    def begins_at(self, position: Sequence[float]) -> bool:
        """Whether the vehicle can be at its first row's place if it was at `position` (m) at 0 s."""
        way = np.linalg.norm(self.rows[0, 1:4] - position)
        return bool(way <= _could(self.columns["speed"][0], self.times[0]))

    def until(self, row: int) -> FlightRecord:
        """Return the flight as it was before a row, which is not its first."""
        others = {name: poses[:row] for name, poses in self.other_poses.items()}
        return replace(self, rows=self.rows[:row], is_whole=False, other_poses=others)

    @property
    def end(self) -> float:
        """Simulated time of the last row in s."""
        return float(self.rows[-1, 0])


def _could(speed: Any, seconds: Any) -> Any:
    """Return how far (m) a vehicle can get by itself at a speed (m/s) in so many seconds."""
    return _ALWAYS + _FARTHEST * speed * seconds


_AS_RECORDED = [name.partition(" ")[0] for name in COLUMNS]
UNITS = {  # of the columns that a criterion may be `of`
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

    roll, pitch, yaw (rad) are ROS's, yaw without jumps; tilt is the angle between the body's and the world's z; vx, vy,
    vz are the velocity in the track frame (at the drone, level, turned by its yaw), as commands are; world_vx,
    world_vy, wx, wy and wz are in the world frame, as in the table.
    """
    found = {name: rows[:, index] for index, name in enumerate(_AS_RECORDED)}
    x, y, z, w = rows[:, 4:8].T
    r00, r01 = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w)
    r10, r20 = 2 * (x * y + z * w), 2 * (x * z - y * w)
    r21, r22 = 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    turn = np.arctan2(-r01, r00)  # V-REP's gamma, by which Track_base is turned
    east, north, up = rows[:, 8:11].T
    made = {
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
    return {name: column for name, column in {**found, **made}.items() if name in UNITS}
