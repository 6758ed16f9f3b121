"""Handles to drag in the browser, which are the simulation's interactive markers, and the browsers that hold them.

A handle is sent to the browsers as a marker of the kind `handle`: its name is `ns`, its server is `layer`. The markers
of a handle that is always visible, such as the green sphere, are sent as separate markers of the same layer.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

import rospy
from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    Marker,
)

from drone_sim.mechanics import frames
from drone_sim.message_text import shown
from drone_sim.ros.cockpit.scene import scene_state
from drone_sim.ros.cockpit.scene.markers import entry_of, pose_of
from drone_sim.ros.cockpit.scene.scene_state import Entry, Key, Properties
from drone_sim.ros.core.message_conversion import WORLD_FRAME

_KEEP_ALIVE_PERIOD = 0.25  # s, between messages to the simulation while a handle is held
_MAX_INVISIBLE = 0.05  # opacity of markers that are only for the mouse
_MAX_COORDINATE = 1e6  # m, in a browser's message
PHASES = {
    "start": InteractiveMarkerFeedback.MOUSE_DOWN,
    "move": InteractiveMarkerFeedback.POSE_UPDATE,
    "end": InteractiveMarkerFeedback.MOUSE_UP,
}


class Drag(NamedTuple):
    """A browser's message about a handle: start, move or end of a drag, and the pose in the world."""

    server: str
    name: str
    phase: str
    pose: scene_state.Pose


def read_drag(given: Mapping[str, Any]) -> Drag:
    """Return the drag in a browser's message. Raises ValueError."""
    phase = given.get("drag")
    if not isinstance(phase, str) or phase not in PHASES:
        raise ValueError(f"drag = {shown(phase)}: must be one of {', '.join(PHASES)}")
    for name in ("server", "name"):
        if not isinstance(given.get(name), str):
            raise ValueError(f"{name} = {shown(given.get(name))}: must be a name")
    return Drag(given["server"], given["name"], phase, _read_pose(given.get("pose")))


def _read_pose(given: Any) -> scene_state.Pose:
    wrong = ValueError("pose: must be x, y, z (m), and a quaternion x, y, z, w")
    if not isinstance(given, list) or len(given) != len(scene_state.AT_REST):
        raise wrong
    for value in given:
        if not isinstance(value, (int, float)) or isinstance(value, bool) or abs(value) > _MAX_COORDINATE:
            raise wrong
    norm = sum(value * value for value in given[3:]) ** 0.5
    if norm < 0.5:
        raise wrong
    return (*map(float, given[:3]), *(value / norm for value in given[3:]))


class _Hold(NamedTuple):
    browser: int
    sent_at: float  # s, of the last message to the simulation
    pose: scene_state.Pose


class DragControls:
    """The handles of one interactive marker server. Thread-safe."""

    def __init__(
        self,
        server: str,
        publish: Callable[[InteractiveMarkerFeedback], None],
        clock: Callable[[], float] = time.monotonic,
    ):
        """`publish` sends feedback to the simulation; `clock` must be monotonic (s)."""
        self._server = server
        self._publish, self._clock = publish, clock
        self._lock = threading.RLock()
        self._handles: dict[str, tuple[InteractiveMarker, Pose]] = {}
        self._changed: set[str] = set()
        self._taken: dict[str, set[Key]] = {}  # keys of the markers that `take` has returned, by handle
        self._holds: dict[str, _Hold] = {}

    def on_init(self, message: InteractiveMarkerInit) -> None:
        """Replace all handles."""
        with self._lock:
            self._changed |= self._handles.keys()
            self._handles = {marker.name: (marker, marker.pose) for marker in message.markers}
            self._changed |= self._handles.keys()

    def on_update(self, message: InteractiveMarkerUpdate) -> None:
        with self._lock:
            for marker in message.markers:
                self._handles[marker.name] = marker, marker.pose
                self._changed.add(marker.name)
            for pose in message.poses:
                if pose.name in self._handles:
                    self._handles[pose.name] = self._handles[pose.name][0], pose.pose
                    self._changed.add(pose.name)
            for name in message.erases:
                self._handles.pop(name, None)
                self._changed.add(name)

    def take(self) -> dict[Key, Entry | None]:
        """Return the handles' markers that have changed since the last call; None for a marker that is gone."""
        with self._lock:
            names, self._changed = self._changed, set()
            changed: dict[Key, Entry | None] = {}
            for name in names:
                entries = self._entries(*self._handles[name]) if name in self._handles else {}
                changed.update(dict.fromkeys(self._taken.pop(name, set()) - entries.keys()))
                changed.update(entries)
                if entries:
                    self._taken[name] = set(entries)
            return changed

    def _entries(self, handle: InteractiveMarker, pose: Pose) -> dict[Key, Entry | None]:
        properties: Properties = {"kind": "handle", "layer": self._server, "ns": handle.name, "frame": WORLD_FRAME}
        entries: dict[Key, Entry | None] = {(self._server, handle.name, ""): Entry(properties, {}, pose_of(pose))}
        markers = [marker for control in handle.controls if control.always_visible for marker in control.markers]
        visible = (marker for marker in markers if marker.type == Marker.SPHERE and marker.color.a > _MAX_INVISIBLE)
        for number, marker in enumerate(visible):
            entry = entry_of(marker, self._server, lambda _: None)
            if entry is not None:
                parent, child = pose_of(pose), entry.pose
                position = frames.transform(frames.from_quaternion(parent[:3], parent[3:]), child[:3])
                in_world = (*position, *frames.multiply_quaternions(parent[3:], child[3:]))
                properties = {**entry.properties, "ns": handle.name, "frame": WORLD_FRAME}
                entries[self._server, handle.name, str(number)] = Entry(properties, {}, in_world)
        return entries

    # ---- dragging

    def drag(self, browser: int, drag: Drag) -> None:
        """Send a browser's drag to the simulation. While one browser holds a handle, others are ignored."""
        with self._lock:
            hold = self._holds.get(drag.name)
            is_start = drag.phase == "start"
            is_allowed = hold is None if is_start else hold is not None and hold.browser == browser
            if is_allowed and drag.name in self._handles:
                self._send(drag.name, browser, PHASES[drag.phase], drag.pose)

    def keep(self, browsers: Collection[int]) -> None:
        """Keep held handles alive in the simulation; release those that are gone, or whose browser is not connected."""
        with self._lock:
            for name, hold in list(self._holds.items()):
                if hold.browser not in browsers or name not in self._handles:
                    self._send(name, hold.browser, InteractiveMarkerFeedback.MOUSE_UP, hold.pose)
                elif self._clock() - hold.sent_at > _KEEP_ALIVE_PERIOD:
                    self._send(name, hold.browser, InteractiveMarkerFeedback.KEEP_ALIVE, hold.pose)

    def _send(self, name: str, browser: int, kind: int, pose: scene_state.Pose) -> None:
        if kind == InteractiveMarkerFeedback.MOUSE_UP:
            self._holds.pop(name, None)
        else:
            self._holds[name] = _Hold(browser, self._clock(), pose)
        feedback = InteractiveMarkerFeedback(
            header=Header(frame_id=WORLD_FRAME),
            client_id=f"cockpit/{browser}",
            marker_name=name,
            event_type=kind,
            pose=Pose(Point(*pose[:3]), Quaternion(*pose[3:])),
        )
        with contextlib.suppress(rospy.ROSException):  # the view is being closed
            self._publish(feedback)
