"""The tree of tf frames, in which markers have their poses."""

from __future__ import annotations

import threading
from typing import Any

from drone_sim.ros.cockpit.scene.scene_state import Pose
from drone_sim.ros.core.message_conversion import WORLD_FRAME, xyz, xyzw


class FrameTree:
    """Latest parent and pose of each frame. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: dict[str, tuple[str, Pose]] = {}  # parent and pose, by name
        self._changed: set[str] = set()
        self.has_news = threading.Event()  # set by each message

    def on_transforms(self, message: Any) -> None:
        """Store the transforms of a tfMessage."""
        with self._lock:
            for transform in message.transforms:
                pose = (*xyz(transform.transform.translation), *xyzw(transform.transform.rotation))
                self._frames[transform.child_frame_id] = transform.header.frame_id, pose
                self._changed.add(transform.child_frame_id)
        self.has_news.set()

    def take(self) -> dict[str, tuple[str, Pose]]:
        """Return parent ('' for the world) and pose of the frames that have changed since the last call, parents first.

        A frame without a path to the world is returned once it has one.
        """
        with self._lock:
            parents = {frame: parent for frame, (parent, _) in self._frames.items()}
            depths = {frame: _depth(frame, parents) for frame in self._changed}
            ready = sorted((frame for frame in self._changed if depths[frame]), key=lambda frame: depths[frame])
            self._changed -= set(ready)
            return {
                frame: ("" if parents[frame] == WORLD_FRAME else parents[frame], self._frames[frame][1])
                for frame in ready
            }


def _depth(frame: str, parents: dict[str, str]) -> int:
    """Return the number of frames on the path from the world to `frame`; 0 if there is no path."""
    for depth in range(len(parents) + 1):
        if frame == WORLD_FRAME:
            return depth
        frame = parents.get(frame, "")
    return 0
