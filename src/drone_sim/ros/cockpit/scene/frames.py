"""The tree of frames, as nodes of the browser's scene on which markers hang; and where in it the browsers look from."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from functools import reduce
from typing import Any

import numpy as np
from geometry_msgs.msg import Transform

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.ros.core.message_conversion import TRACK_BASE, WORLD_FRAME, xyz, xyzw

_OPTICAL = "_optical"  # REP 103: how the name of a camera's own frame ends
FREE, BEHIND = "free", "behind the drone"
_BACK, _UP = 1.6, 0.7  # m: where the one behind is, in the level frame of the drone
_AHEAD = 0.4  # m, where it looks at
_STILL = 1e-4  # m
_AXES = {"axes_length": 0.15, "axes_radius": 0.004}  # m


class FrameTree:
    """What is where, as it was last heard; `show` puts it into the scene."""

    def __init__(self, scene: Any):
        """Show in `scene`; begin with the root alone."""
        self._scene = scene
        self._heard: dict[str, tuple[str, Transform]] = {}  # parent and place, by frame
        self._changed: set[str] = set()
        self._lock = threading.Lock()
        self._nodes: dict[str, Any] = {}
        self._names: dict[str, str] = {}
        self._places: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {}  # position and wxyz of nodes
        self._axes = False
        self.new = False  # whether the tree has grown since somebody asked

    def on_transforms(self, message: Any) -> None:
        """Take a tfMessage; any thread may call."""
        with self._lock:
            for one in message.transforms:
                self._heard[one.child_frame_id] = one.header.frame_id, one.transform
                self._changed.add(one.child_frame_id)

    def forget(self) -> None:
        """Have an empty tree: another simulation begins, or nobody looks."""
        with self._lock:
            self._heard, self._changed = {}, set()
        for node in sorted(self._nodes.values(), key=lambda one: -one.name.count("/")):  # what hangs on others first
            node.remove()
        self._nodes, self._names, self._places = {}, {}, {}

    def show(self) -> None:
        """Put into the scene what has changed."""
        with self._lock:
            parents = {frame: parent for frame, (parent, _) in self._heard.items()}
            known = {frame for frame in self._changed if frame in self._nodes or _is_rooted(frame, parents)}
            changed = {frame: self._heard[frame] for frame in known}
            self._changed -= known
        for frame, (_, transform) in changed.items():
            turn = transform.rotation
            node = self._nodes.get(frame) or self._make(frame, parents)
            position, wxyz = self._places.get(frame, ((), ()))
            now = xyz(transform.translation), (turn.w, turn.x, turn.y, turn.z)
            if now[0] != position:
                node.position = now[0]
            if now[1] != wxyz:
                node.wxyz = now[1]
            self._places[frame] = now

    def _make(self, frame: str, parents: dict[str, str]) -> Any:
        self._names[frame] = name = _path(frame, parents)
        self._nodes[frame] = node = self._scene.add_frame(name, show_axes=self._axes, **_AXES)
        self.new = True
        return node

    def show_axes(self, shown: bool) -> None:
        """Let the axes of all frames be seen, or not."""
        if shown == self._axes:
            return
        self._axes = shown
        for node in self._nodes.values():
            node.show_axes = shown

    def name(self, frame: str) -> str | None:
        """Return the scene's name of a frame; None while it is not known."""
        return "" if frame == WORLD_FRAME else self._names.get(frame)

    def place(self, frame: str) -> Matrix | None:
        """Return where a frame is in the world, None while that is not known."""
        chain: list[Matrix] = []
        with self._lock:
            while frame != WORLD_FRAME:
                found = self._heard.get(frame)
                if found is None or len(chain) > len(self._heard):
                    return None
                frame, transform = found
                chain.append(frames.from_quaternion(xyz(transform.translation), xyzw(transform.rotation)))
        return reduce(frames.multiply, reversed(chain), frames.IDENTITY)

    @property
    def eyes(self) -> list[str]:
        """The frames of cameras that are known: z forward, x right, y down."""
        with self._lock:
            return sorted(frame for frame in self._heard if frame.endswith(_OPTICAL))


class Viewpoint:
    """How the browsers look; the same for all that are open."""

    def __init__(self) -> None:
        """Begin behind the drone."""
        self.choice = BEHIND

    @staticmethod
    def choices(known: FrameTree, prefix: str) -> tuple[str, ...]:
        """Return what may be chosen for the vehicle whose frames begin with a prefix."""
        return BEHIND, FREE, *(frame for frame in known.eyes if frame.startswith(prefix))

    def follow(self, clients: Iterable[Any], known: FrameTree, prefix: str) -> None:
        """Move the browsers' eyes with the drone, where that is chosen."""
        if self.choice == FREE:
            return
        behind = self.choice == BEHIND
        matrix = known.place(f"{prefix}{TRACK_BASE}" if behind else self.choice)
        if matrix is None:
            return
        eye = np.array(frames.transform(matrix, (-_BACK, 0, _UP) if behind else (0, 0, 0)))
        aim = np.array(frames.transform(matrix, (_AHEAD, 0, 0) if behind else (0, 0, 1)))
        up = frames.rotate(matrix, (0, 0, 1) if behind else (0, -1, 0))
        for camera in (client.camera for client in clients):
            if max(np.linalg.norm(camera.position - eye), np.linalg.norm(camera.look_at - aim)) > _STILL:
                with camera.client.atomic():
                    camera.up_direction = up
                    camera.position = eye
                    camera.look_at = aim


def _is_rooted(frame: str, parents: dict[str, str]) -> bool:
    """Tell whether all parents of a frame are known, up to the root: only then has it a place, and a name."""
    for _ in range(len(parents) + 1):
        if frame == WORLD_FRAME:
            return True
        frame = parents.get(frame, "")
    return False


def _path(frame: str, parents: dict[str, str]) -> str:
    """Return a rooted frame's name in the scene, below those of its parents."""
    names: list[str] = []
    while frame != WORLD_FRAME:
        names.append(frame)
        frame = parents[frame]
    return "/frames/" + "/".join(name.replace("/", "_") for name in reversed(names))
