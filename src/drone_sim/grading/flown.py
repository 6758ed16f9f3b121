"""What a flight was, for those who judge it: a table with a row per step, and what no table holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from drone_sim.offline.recording import COLUMNS


class Touch(NamedTuple):
    """The vehicle touched something during the step that ended at `at` (s)."""

    at: float
    what: str  # its name; '' for one that has none


class Said(NamedTuple):
    """A signal or a topic had another value from `at` (s) on; None: the signal was cleared."""

    at: float
    value: Any


@dataclass(frozen=True)
class Flown:
    """A flight of one vehicle; `rows` (N, 22) as offline.recording.COLUMNS says, N >= 1, times increasing."""

    rows: np.ndarray
    touches: Sequence[Touch] = ()  # in order of time, one for each thing and step
    states: Sequence[Said] = ()  # what the script says of its flight state, whenever it changes: docs/states.md
    signals: Mapping[tuple[str, str], Sequence[Said]] = field(default_factory=dict)  # by kind and name, as watched
    others: Mapping[str, np.ndarray] = field(default_factory=dict)  # rows of other vehicles, by name

    @cached_property
    def columns(self) -> dict[str, np.ndarray]:
        """Every column that a criterion may be `of`, by name; each (N,)."""
        return columns_of(self.rows)

    @property
    def times(self) -> np.ndarray:
        """Simulated time of each row in s, (N,)."""
        return self.rows[:, 0]

    @property
    def end(self) -> float:
        """Simulated time of the last row in s."""
        return float(self.rows[-1, 0])

    @cached_property
    def places(self) -> np.ndarray:
        """Position of base_link in the world in m, (N, 3)."""
        return self.rows[:, 1:4]


_AS_RECORDED = [name.partition(" ")[0] for name in COLUMNS]
_TRACK = {"vx": "m/s", "vy": "m/s", "vz": "m/s"}
UNITS = {
    "t": "s",
    **dict.fromkeys("xyz", "m"),
    **dict.fromkeys(("roll", "pitch", "yaw", "tilt"), "rad"),
    **_TRACK,
    **dict.fromkeys(("world_vx", "world_vy", "world_vz", "speed"), "m/s"),
    **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
    **dict.fromkeys(("command_vx", "command_vy", "command_vz"), "m/s"),
    "command_wz": "rad/s",
    **dict.fromkeys((f"propeller{number}" for number in (1, 2, 3, 4)), "m/s"),
}


def columns_of(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns named in UNITS of a table (N, 22).

    roll, pitch, yaw (rad) are ROS's, yaw without jumps; tilt is the angle between the body's and the world's z;
    vx, vy, vz are the velocity in the track frame (at the drone, level, turned by its yaw), as commands are.
    """
    found = {name: rows[:, index] for index, name in enumerate(_AS_RECORDED) if name in UNITS}
    x, y, z, w = rows[:, 4:8].T
    velocity = rows[:, 8:11]
    r00, r10, r20 = 1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)
    r01, r21, r22 = 2 * (x * y - z * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    found["roll"], found["pitch"] = np.arctan2(r21, r22), np.arcsin(np.clip(-r20, -1, 1))
    found["yaw"] = np.unwrap(np.arctan2(r10, r00))
    found["tilt"] = np.arccos(np.clip(r22, -1, 1))
    turn = np.arctan2(-r01, r00)  # V-REP's gamma, as Track_base has it
    found["vx"] = np.cos(turn) * velocity[:, 0] + np.sin(turn) * velocity[:, 1]
    found["vy"] = np.cos(turn) * velocity[:, 1] - np.sin(turn) * velocity[:, 0]
    found["vz"] = velocity[:, 2]
    found["world_vx"], found["world_vy"], found["world_vz"] = velocity.T
    found["speed"] = np.linalg.norm(velocity, axis=1)
    return found
