"""What the browsers show, by versions: each gets what has changed since it was told last, a new one the whole.

A message is a line of JSON, a line feed, and numbers (float32, little-endian):

| in the line | |
|---|---|
| `scene` | the version |
| `whole` | true where all that was there before is gone |
| `frames` | [index, name, index of the parent, -1 for the world], new, or with another parent |
| `markers` | what is new, or looks different: `id`, `frame`, and what `markers.py` and `handles.py` say of it |
| `gone` | the ids of markers that are no more |
| `moved`, `placed` | indices of frames, and ids of markers, whose poses follow |

The numbers are x y z qx qy qz qw (m) for each that is `moved`, then `placed`, seen from the parent, or from the frame;
then what each of `markers` has in its `arrays`, [name, numbers], in that order.
"""

from __future__ import annotations

import json
import threading
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

Pose = tuple[float, ...]  # x, y, z in m, and a quaternion x, y, z, w
Key = tuple[str, ...]
AT_REST: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_KEPT = 10_000  # ids that are gone; who was told last before the oldest of them gets the whole


class Entry(NamedTuple):
    """What is said of a marker, what it is made of, and where it is."""

    said: Mapping[str, Any]
    arrays: Mapping[str, np.ndarray]  # float32
    pose: Pose

    def looks_like(self, other: Entry) -> bool:
        """Tell whether both differ by their pose alone."""
        if self.said != other.said or self.arrays.keys() != other.arrays.keys():
            return False
        return all(np.array_equal(array, other.arrays[name]) for name, array in self.arrays.items())


@dataclass
class _Frame:
    index: int
    parent: int
    pose: Pose
    hung: int  # versions: when it came, or was hung on another parent,
    moved: int = 0  # and when it moved


@dataclass
class _Shown:
    number: int
    entry: Entry
    made: int
    moved: int = 0


@dataclass
class SceneState:
    """All that is to be seen now. One thread changes it, any thread asks."""

    version: int = 0
    _lock: threading.RLock = field(default_factory=threading.RLock)
    _frames: dict[str, _Frame] = field(default_factory=dict)
    _markers: dict[Key, _Shown] = field(default_factory=dict)
    _gone: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _begun: int = 0  # version before which there was something else
    _numbers: int = 0
    _made: tuple[int, int, bytes] = (-2, -2, b"")  # the last message: since when, until when

    def change(
        self,
        frames: Mapping[str, tuple[str, Pose]],
        markers: Mapping[Key, Entry | None],
    ) -> bool:
        """Take frames with their parent ('' for the world) and pose, parents before children; markers, None for gone.

        All of it is one version. Return whether anything has changed.
        """
        with self._lock:
            version, self.version = self.version, self.version + 1
            changed = [self._put_frame(name, *one) for name, one in frames.items()]
            changed += [self._put_marker(key, one) for key, one in markers.items()]
            if not any(changed):
                self.version = version
            return any(changed)

    def clear(self) -> None:
        """Have nothing to show."""
        with self._lock:
            self.version += 1
            self._begun = self.version
            self._frames.clear()
            self._markers.clear()
            self._gone.clear()

    def keys(self) -> list[Key]:
        """Return the keys of all markers."""
        with self._lock:
            return list(self._markers)

    def _put_frame(self, name: str, parent: str, pose: Pose) -> bool:
        above = self._frames[parent].index if parent else -1
        known = self._frames.get(name)
        if known is None:
            self._frames[name] = _Frame(len(self._frames), above, pose, self.version, self.version)
            return True
        if (known.parent, known.pose) == (above, pose):
            return False
        known.hung = self.version if known.parent != above else known.hung
        known.parent, known.pose, known.moved = above, pose, self.version
        return True

    def _put_marker(self, key: Key, entry: Entry | None) -> bool:
        known = self._markers.get(key)
        if entry is None:
            if known is not None:
                del self._markers[key]
                self._gone.append((self.version, known.number))
            return known is not None
        if known is None:
            self._numbers += 1
            self._markers[key] = _Shown(self._numbers, entry, self.version, self.version)
            return True
        is_like, stands = known.entry.looks_like(entry), known.entry.pose == entry.pose
        known.made = known.made if is_like else self.version
        known.moved = known.moved if stands else self.version
        known.entry = entry
        return not (is_like and stands)

    # ---- what a browser is told

    def since(self, version: int) -> tuple[int, bytes]:
        """Return the version now, and the message on what has changed since another one, empty for nothing.

        A version of -1 is that of a browser that knows nothing.
        """
        with self._lock:
            if version == self.version:
                return version, b""
            if self._made[:2] != (version, self.version):
                self._made = (version, self.version, self._message(version))
            return self.version, self._made[2]

    def _message(self, version: int) -> bytes:
        lost = len(self._gone) == _KEPT and self._gone[0][0] > version
        whole = version < self._begun or lost or version < 0
        since = -1 if whole else version
        frames = [(name, one) for name, one in self._frames.items() if one.moved > since]
        made = [one for one in self._markers.values() if one.made > since]
        placed = [one for one in self._markers.values() if one.moved > since or one.made > since]
        said = {
            "scene": self.version,
            "whole": whole,
            "frames": [[one.index, name, one.parent] for name, one in frames if one.hung > since],
            "markers": [_told(one) for one in made],
            "gone": [] if whole else [number for when, number in self._gone if when > since],
            "moved": [one.index for _, one in frames],
            "placed": [one.number for one in placed],
        }
        poses = [one.pose for _, one in frames] + [one.entry.pose for one in placed]
        numbers = [np.array(poses, dtype="<f4").tobytes(), *_bytes(made)]
        return json.dumps(said, separators=(",", ":")).encode() + b"\n" + b"".join(numbers)


def _told(one: _Shown) -> dict[str, Any]:
    arrays = [[name, int(array.size)] for name, array in one.entry.arrays.items()]
    return {"id": one.number, **one.entry.said, **({"arrays": arrays} if arrays else {})}


def _bytes(made: Iterable[_Shown]) -> Iterable[bytes]:
    for one in made:
        for array in one.entry.arrays.values():
            yield np.ascontiguousarray(array, dtype="<f4").tobytes()
