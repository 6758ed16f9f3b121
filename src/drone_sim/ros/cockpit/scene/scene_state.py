"""Frames and markers that the browsers show, with versions: a browser gets the changes since its version.

A message is a SceneMessage as a line of JSON, a line feed, and numbers (float32, little-endian). The numbers are
x y z qx qy qz qw (m) for each frame in `moved`, in its parent, and for each marker in `placed`, in its frame; then the
arrays of each of `markers`, in the order of its `arrays`.
"""

from __future__ import annotations

import json
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypedDict

import numpy as np

Pose = tuple[float, ...]  # x, y, z in m, and a quaternion x, y, z, w
Key = tuple[str, ...]
AT_REST: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_MAX_GONE = 10_000  # removed ids; a browser with an older version than these gets everything again


ArrayName = Literal["points", "colors"]  # x y z each, m; r g b a each, 0..1


class Handle(TypedDict):
    """Properties of a handle, and those that every marker has, too."""

    kind: str  # in `markers.py`, or handle
    layer: str  # the topic's name; of a handle that of its server
    ns: str
    frame: str


class Properties(Handle, total=False):
    """Properties of a marker; `text`, `mesh`, `own` and `lit` are only of some kinds."""

    color: list[float]  # r g b a, 0..1, sRGB
    scale: list[float]  # m
    text: str
    mesh: str  # a URL
    own: bool  # use the mesh's own colors
    lit: bool  # false: the marker is not shaded


class MarkerMessage(Properties, total=False):
    """A marker for the browsers."""

    id: int
    arrays: list[tuple[ArrayName, int]]  # with the number of values


class SceneMessage(TypedDict):
    """The changes of the scene since the browser's version."""

    scene: int  # the version
    whole: bool  # the browser must remove everything that it had before
    frames: list[tuple[int, str, int]]  # index, name, and index of the parent (-1: world) of new or re-attached frames
    markers: list[MarkerMessage]  # that are new or look different
    gone: list[int]  # ids of removed markers
    moved: list[int]  # indices of frames whose poses follow
    placed: list[int]  # ids of markers whose poses follow


class Entry(NamedTuple):
    """A marker's properties, its arrays, and its pose."""

    properties: Properties
    arrays: Mapping[ArrayName, np.ndarray]  # float32
    pose: Pose

    def looks_like(self, other: Entry) -> bool:
        """Return whether properties and arrays are equal."""
        if self.properties != other.properties or self.arrays.keys() != other.arrays.keys():
            return False
        return all(np.array_equal(array, other.arrays[name]) for name, array in self.arrays.items())


@dataclass
class _Frame:
    index: int
    parent: int
    pose: Pose
    attached: int  # version in which it got its parent
    moved: int = 0  # version in which it got its pose


@dataclass
class _Marker:
    number: int
    entry: Entry
    changed: int  # version in which it got its properties and arrays
    moved: int = 0  # version in which it got its pose

    def description(self) -> MarkerMessage:
        description: MarkerMessage = {"id": self.number, **self.entry.properties}
        if self.entry.arrays:
            description["arrays"] = [(name, int(array.size)) for name, array in self.entry.arrays.items()]
        return description


@dataclass
class SceneState:
    """The scene for all browsers. One thread changes it, any thread may read it."""

    version: int = 0
    _lock: threading.RLock = field(default_factory=threading.RLock)
    _frames: dict[str, _Frame] = field(default_factory=dict)
    _markers: dict[Key, _Marker] = field(default_factory=dict)
    _gone: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=_MAX_GONE))  # version and id
    _cleared: int = 0  # version of the last `clear`
    _last_number: int = 0
    _last_message: tuple[int, int, bytes] = (-2, -2, b"")  # from and to version

    def change(self, frames: Mapping[str, tuple[str, Pose]], markers: Mapping[Key, Entry | None]) -> bool:
        """Set frames and markers, as one version; return whether anything has changed.

        Frames have their parent ('' for the world) and pose, and come after their parents; None removes a marker.
        """
        with self._lock:
            version, self.version = self.version, self.version + 1
            changed = [self._put_frame(name, *frame) for name, frame in frames.items()]
            changed += [self._put_marker(key, entry) for key, entry in markers.items()]
            if not any(changed):
                self.version = version
            return any(changed)

    def clear(self) -> None:
        with self._lock:
            self.version += 1
            self._cleared = self.version
            self._frames.clear()
            self._markers.clear()
            self._gone.clear()

    def _put_frame(self, name: str, parent: str, pose: Pose) -> bool:
        parent_index = self._frames[parent].index if parent else -1
        known = self._frames.get(name)
        if known is None:
            self._frames[name] = _Frame(len(self._frames), parent_index, pose, self.version, self.version)
            return True
        if (known.parent, known.pose) == (parent_index, pose):
            return False
        known.attached = self.version if known.parent != parent_index else known.attached
        known.parent, known.pose, known.moved = parent_index, pose, self.version
        return True

    def _put_marker(self, key: Key, entry: Entry | None) -> bool:
        known = self._markers.get(key)
        if entry is None:
            if known is not None:
                del self._markers[key]
                self._gone.append((self.version, known.number))
            return known is not None
        if known is None:
            self._last_number += 1
            self._markers[key] = _Marker(self._last_number, entry, self.version, self.version)
            return True
        looks_equal, is_still = known.entry.looks_like(entry), known.entry.pose == entry.pose
        known.changed = known.changed if looks_equal else self.version
        known.moved = known.moved if is_still else self.version
        known.entry = entry
        return not (looks_equal and is_still)

    # ---- messages to the browsers

    def since(self, version: int) -> tuple[int, bytes]:
        """Return the present version, and the message with the changes since `version`; b"" if there are none.

        `version` is -1 for a new browser.
        """
        with self._lock:
            if version == self.version:
                return version, b""
            if self._last_message[:2] != (version, self.version):
                self._last_message = (version, self.version, self._message(version))
            return self.version, self._last_message[2]

    def _message(self, version: int) -> bytes:
        is_too_old = len(self._gone) == _MAX_GONE and self._gone[0][0] > version
        is_whole = version < self._cleared or is_too_old or version < 0
        since = -1 if is_whole else version
        frames = [(name, frame) for name, frame in self._frames.items() if frame.moved > since]
        changed = [marker for marker in self._markers.values() if marker.changed > since]
        placed = [marker for marker in self._markers.values() if marker.moved > since or marker.changed > since]
        header: SceneMessage = {
            "scene": self.version,
            "whole": is_whole,
            "frames": [(frame.index, name, frame.parent) for name, frame in frames if frame.attached > since],
            "markers": [marker.description() for marker in changed],
            "gone": [] if is_whole else [number for when, number in self._gone if when > since],
            "moved": [frame.index for _, frame in frames],
            "placed": [marker.number for marker in placed],
        }
        poses = [frame.pose for _, frame in frames] + [marker.entry.pose for marker in placed]
        arrays = [array for marker in changed for array in marker.entry.arrays.values()]
        numbers = [np.ascontiguousarray(array, dtype="<f4").tobytes() for array in (np.array(poses), *arrays)]
        return json.dumps(header, separators=(",", ":")).encode() + b"\n" + b"".join(numbers)
