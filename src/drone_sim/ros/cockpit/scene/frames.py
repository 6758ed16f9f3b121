"""The tree of frames, from /tf and /tf_static, as nodes of the browser's scene on which markers hang."""

from __future__ import annotations

import threading
from functools import reduce
from typing import Any

from geometry_msgs.msg import Transform

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix

ROOT = "world"
_OPTICAL = "_optical"  # REP 103: how the name of a camera's own frame ends
_AXES = {"axes_length": 0.15, "axes_radius": 0.004}  # m


class Frames:
    """What is where, as it was last heard; `show` puts it into the scene."""

    def __init__(self, scene: Any):
        """Begin with the root alone."""
        self._scene = scene
        self._heard: dict[str, tuple[str, Transform]] = {}  # parent and place, by frame
        self._changed: set[str] = set()
        self._lock = threading.Lock()
        self._nodes: dict[str, Any] = {}
        self._names: dict[str, str] = {}
        self._places: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {}  # position and wxyz of nodes
        self._axes = False
        self.new = False  # whether the tree has grown since somebody asked

    def hear(self, message: Any) -> None:
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
            at, turn = transform.translation, transform.rotation
            node = self._nodes.get(frame) or self._make(frame, parents)
            position, wxyz = self._places.get(frame, ((), ()))
            now = (at.x, at.y, at.z), (turn.w, turn.x, turn.y, turn.z)
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
        return "" if frame == ROOT else self._names.get(frame)

    def place(self, frame: str) -> Matrix | None:
        """Return where a frame is in the world, None while that is not known."""
        chain: list[Matrix] = []
        with self._lock:
            while frame != ROOT:
                found = self._heard.get(frame)
                if found is None or len(chain) > len(self._heard):
                    return None
                frame, (at, turn) = found[0], (found[1].translation, found[1].rotation)
                chain.append(frames.from_quaternion((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)))
        return reduce(frames.multiply, reversed(chain), frames.IDENTITY)

    @property
    def eyes(self) -> list[str]:
        """The frames of cameras that are known: z forward, x right, y down."""
        with self._lock:
            return sorted(frame for frame in self._heard if frame.endswith(_OPTICAL))


def _is_rooted(frame: str, parents: dict[str, str]) -> bool:
    """Tell whether all parents of a frame are known, up to the root: only then has it a place, and a name."""
    for _ in range(len(parents) + 1):
        if frame == ROOT:
            return True
        frame = parents.get(frame, "")
    return False


def _path(frame: str, parents: dict[str, str]) -> str:
    """Return a rooted frame's name in the scene, below those of its parents."""
    names: list[str] = []
    while frame != ROOT:
        names.append(frame)
        frame = parents[frame]
    return "/frames/" + "/".join(name.replace("/", "_") for name in reversed(names))
