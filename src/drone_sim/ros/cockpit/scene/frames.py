"""The tree of frames, on which markers hang."""

from __future__ import annotations

import threading
from typing import Any

from drone_sim.ros.cockpit.scene.scene_state import Pose
from drone_sim.ros.core.message_conversion import WORLD_FRAME, xyz, xyzw


class FrameTree:
    """What is where, as it was last heard. Any thread may call."""

    def __init__(self) -> None:
        """Begin with the root alone."""
        self._lock = threading.Lock()
        self._heard: dict[str, tuple[str, Pose]] = {}  # parent and place, by frame
        self._changed: set[str] = set()
        self._rooted: set[str] = set()
        self.came = threading.Event()  # when something has been heard

    def on_transforms(self, message: Any) -> None:
        """Take a tfMessage: all in it is shown together."""
        with self._lock:
            for one in message.transforms:
                pose = (*xyz(one.transform.translation), *xyzw(one.transform.rotation))
                self._heard[one.child_frame_id] = one.header.frame_id, pose
                self._changed.add(one.child_frame_id)
        self.came.set()

    def take(self) -> dict[str, tuple[str, Pose]]:
        """Return parent ('' for the world) and pose of what has changed, parents first.

        What hangs on a frame that is not known waits for it.
        """
        with self._lock:
            parents = {frame: parent for frame, (parent, _) in self._heard.items()}
            depths = {frame: _depth(frame, parents) for frame in self._changed}
            ready = sorted((frame for frame in self._changed if depths[frame]), key=lambda one: depths[one])
            self._changed -= set(ready)
            return {frame: (_above(parents[frame]), self._heard[frame][1]) for frame in ready}


def _above(parent: str) -> str:
    return "" if parent == WORLD_FRAME else parent


def _depth(frame: str, parents: dict[str, str]) -> int:
    """Return how many frames there are from the root to this one, 0 where it does not hang on the root."""
    for depth in range(len(parents) + 1):
        if frame == WORLD_FRAME:
            return depth
        frame = parents.get(frame, "")
    return 0
