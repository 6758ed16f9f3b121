"""Things to drag in the browser: the handles that the simulation offers to rviz, and who holds which of them.

A handle is sent to the browsers as a marker of the kind `handle`: its name is `ns`, its server is `layer`. If it is
always visible, such as the green sphere, its looks are sent as markers of their own, in the same layer.
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
from drone_sim.ros.cockpit.scene.scene_state import Entry, Key
from drone_sim.ros.core.message_conversion import WORLD_FRAME

_STILL = 0.25  # s, after which the simulation is told once more that a handle is held
_UNSEEN = 0.05  # opacity of what is there for the mouse alone
_FARTHEST = 1e6  # m, of what a browser may ask for
PHASES = {
    "start": InteractiveMarkerFeedback.MOUSE_DOWN,
    "move": InteractiveMarkerFeedback.POSE_UPDATE,
    "end": InteractiveMarkerFeedback.MOUSE_UP,
}


class Drag(NamedTuple):
    """What a browser says of a handle: start, move or end, and where it is now in the world."""

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
    if any(not isinstance(one, (int, float)) or isinstance(one, bool) or abs(one) > _FARTHEST for one in given):
        raise wrong
    length = sum(one * one for one in given[3:]) ** 0.5
    if length < 0.5:
        raise wrong
    return (*map(float, given[:3]), *(one / length for one in given[3:]))


class _Held(NamedTuple):
    browser: int
    said: float  # s, when the simulation was told last
    pose: scene_state.Pose


class DragControls:
    """The handles of one interactive marker server. Any thread may call."""

    def __init__(
        self,
        server: str,
        publish: Callable[[InteractiveMarkerFeedback], None],
        clock: Callable[[], float] = time.monotonic,
    ):
        """Begin without handles.

        `publish` sends what is dragged to the topic `…/feedback`; `clock` returns s.
        """
        self._server = server
        self._publish, self._clock = publish, clock
        self._lock = threading.RLock()
        self._there: dict[str, tuple[InteractiveMarker, Pose]] = {}
        self._changed: set[str] = set()
        self._told: dict[str, set[Key]] = {}
        self._held: dict[str, _Held] = {}

    def on_init(self, message: InteractiveMarkerInit) -> None:
        """Take all that there are."""
        with self._lock:
            self._changed |= self._there.keys()
            self._there = {one.name: (one, one.pose) for one in message.markers}
            self._changed |= self._there.keys()

    def on_update(self, message: InteractiveMarkerUpdate) -> None:
        """Take what has come, gone or moved."""
        with self._lock:
            for one in message.markers:
                self._there[one.name] = one, one.pose
                self._changed.add(one.name)
            for pose in message.poses:
                if pose.name in self._there:
                    self._there[pose.name] = self._there[pose.name][0], pose.pose
                    self._changed.add(pose.name)
            for name in message.erases:
                self._there.pop(name, None)
                self._changed.add(name)

    def take(self) -> dict[Key, Entry | None]:
        """Return what has changed of the handles since the last call, None for what is gone."""
        with self._lock:
            names, self._changed = self._changed, set()
            changed: dict[Key, Entry | None] = {}
            for name in names:
                told = self._entries(*self._there[name]) if name in self._there else {}
                changed.update(dict.fromkeys(self._told.pop(name, set()) - told.keys()))
                changed.update(told)
                if told:
                    self._told[name] = set(told)
            return changed

    def _entries(self, handle: InteractiveMarker, pose: Pose) -> dict[Key, Entry | None]:
        said = {"kind": "handle", "layer": self._server, "ns": handle.name, "frame": WORLD_FRAME}
        entries: dict[Key, Entry | None] = {(self._server, handle.name, ""): Entry(said, {}, pose_of(pose))}
        looks = [one for control in handle.controls if control.always_visible for one in control.markers]
        for number, look in enumerate(one for one in looks if one.type == Marker.SPHERE and one.color.a > _UNSEEN):
            entry = entry_of(look, self._server, lambda _: None)
            if entry is not None:
                place = _multiply(pose_of(pose), pose_of(look.pose))
                told = {**entry.said, "ns": handle.name, "frame": WORLD_FRAME}
                entries[self._server, handle.name, str(number)] = Entry(told, {}, place)
        return entries

    # ---- dragging

    def drag(self, browser: int, given: Drag) -> None:
        """Tell the simulation what a browser drags. A second browser is ignored until the first one lets go."""
        with self._lock:
            held = self._held.get(given.name)
            is_ours = held is not None and held.browser == browser
            if given.name not in self._there or (is_ours if given.phase == "start" else not is_ours):
                return
            if given.phase == "start" and held is not None:
                return
            self._tell(given.name, browser, PHASES[given.phase], given.pose)

    def keep(self, browsers: Collection[int]) -> None:
        """Tell the simulation which handles are still held; release those that have gone, or whose browser has gone."""
        with self._lock:
            for name, held in list(self._held.items()):
                if held.browser not in browsers or name not in self._there:
                    self._tell(name, held.browser, InteractiveMarkerFeedback.MOUSE_UP, held.pose)
                elif self._clock() - held.said > _STILL:
                    self._tell(name, held.browser, InteractiveMarkerFeedback.KEEP_ALIVE, held.pose)

    def _tell(self, name: str, browser: int, kind: int, pose: scene_state.Pose) -> None:
        if kind == InteractiveMarkerFeedback.MOUSE_UP:
            self._held.pop(name, None)
        else:
            self._held[name] = _Held(browser, self._clock(), pose)
        who = {"header": Header(frame_id=WORLD_FRAME), "client_id": f"cockpit/{browser}", "marker_name": name}
        place = Pose(Point(*pose[:3]), Quaternion(*pose[3:]))
        with contextlib.suppress(rospy.ROSException):  # the view is being closed
            self._publish(InteractiveMarkerFeedback(**who, event_type=kind, pose=place))


def _multiply(above: scene_state.Pose, below: scene_state.Pose) -> scene_state.Pose:
    """Return `below`, a pose in the frame of `above`, as a pose in the frame in which `above` is given."""
    x, y, z = frames.transform(frames.from_quaternion(above[:3], above[3:]), below[:3])
    return (x, y, z, *frames.multiply_quaternions(above[3:], below[3:]))
