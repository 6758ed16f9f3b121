"""Things to drag in the browser: the handles that the simulation offers to rviz, as viser's transform controls."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import Header
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerInit, InteractiveMarkerUpdate

from drone_sim.mechanics import frames
from drone_sim.ros.core.message_conversion import WORLD_FRAME, xyz

LARGE = {"scale": 0.25}  # m
ANYWHERE = {"scale": 90.0, "fixed": True}  # pixels, near or far
_STILL = 0.25  # s, after which the simulation is told once more that a handle is held
_KINDS = {
    "start": InteractiveMarkerFeedback.MOUSE_DOWN,
    "update": InteractiveMarkerFeedback.POSE_UPDATE,
    "end": InteractiveMarkerFeedback.MOUSE_UP,
}
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)  # wxyz


class _DragControl:
    """Arrows and planes along the axes, and a ring about the vertical, which turns by itself."""

    def __init__(self, scene: Any, name: str, visible: bool, size: Mapping[str, Any]):
        look = {"depth_test": False, **size}
        self.arrows = scene.add_transform_controls(name, disable_rotations=True, visible=visible, **look)
        alone = {"active_axes": (True, True, False), "disable_axes": True, "disable_sliders": True}
        self.ring = scene.add_transform_controls(f"{name}/turn", **alone, **look)

    def put(self, pose: Pose) -> None:
        turn = pose.orientation
        for control, name, value in (
            (self.arrows, "position", xyz(pose.position)),
            (self.arrows, "wxyz", (turn.w, turn.x, turn.y, turn.z)),
            (self.ring, "wxyz", _UPRIGHT),
        ):
            if tuple(getattr(control, name)) != value:
                setattr(control, name, value)

    @property
    def pose(self) -> Pose:
        (w, x, y, z), (rw, rx, ry, rz) = (map(float, one.wxyz) for one in (self.arrows, self.ring))
        turn = frames.multiply_quaternions((x, y, z, w), (rx, ry, rz, rw))
        return Pose(Point(*map(float, self.arrows.position)), Quaternion(*turn))

    def remove(self) -> None:
        self.ring.remove()
        self.arrows.remove()


class DragControls:
    """One control for each interactive marker of a server. Messages are taken in any thread, and shown in one."""

    def __init__(
        self,
        scene: Any,
        publish: Callable[[InteractiveMarkerFeedback], None],
        folder: str = "handles",
        is_offered: Callable[[str], bool] = lambda _: True,
        size: Mapping[str, Any] = LARGE,
        clock: Callable[[], float] = time.monotonic,
    ):
        """Show controls of `size` below `folder` in `scene`, for each marker that `is_offered`.

        `publish` sends what is dragged to the topic `…/feedback`; `clock` returns s.
        """
        self._scene, self._folder, self._size = scene, folder, size
        self._publish = publish
        self._is_offered = is_offered
        self._clock = clock
        self._lock = threading.Lock()
        self._known: dict[str, Pose] = {}
        self._shown: dict[str, _DragControl] = {}
        self._held: dict[str, tuple[int, float]] = {}  # by whom, and when that was said last
        self._visible = True

    @property
    def names(self) -> tuple[str, ...]:
        """All markers there are, with a control or without."""
        with self._lock:
            return tuple(sorted(self._known))

    @property
    def held(self) -> bool:
        """Whether somebody drags one."""
        return bool(self._held)

    def on_init(self, message: InteractiveMarkerInit) -> None:
        """Take all that there are."""
        with self._lock:
            self._known = {one.name: one.pose for one in message.markers}

    def on_update(self, message: InteractiveMarkerUpdate) -> None:
        """Take what has come, gone or moved."""
        with self._lock:
            self._known.update({one.name: one.pose for one in message.markers})
            self._known.update({one.name: one.pose for one in message.poses if one.name in self._known})
            for name in message.erases:
                self._known.pop(name, None)

    def show(self, browsers: Collection[int] = ()) -> None:
        """Put the handles where they are, but for those that somebody in one of the open browsers drags."""
        with self._lock:
            wanted = {name: pose for name, pose in self._known.items() if self._is_offered(name)}
            held = dict(self._held)
        for name in self._shown.keys() - wanted.keys():
            self._let_go(name)
            self._shown.pop(name).remove()
        for name, (browser, said) in held.items():
            if browser not in browsers:
                self._let_go(name)
            elif self._clock() - said > _STILL:
                self._tell(name, browser, InteractiveMarkerFeedback.KEEP_ALIVE)
        for name, pose in wanted.items():
            control = self._shown.get(name) or self._make(name)
            if name not in self._held:
                control.put(pose)

    def forget(self) -> None:
        """Have none."""
        with self._lock:
            self._known = {}
        self.show()

    def show_all(self, visible: bool) -> None:
        """Let the handles be seen, or not."""
        if visible == self._visible:
            return
        self._visible = visible
        for control in self._shown.values():
            control.arrows.visible = visible

    def _make(self, name: str) -> _DragControl:
        path = f"/{self._folder}/{name.replace('/', '_')}"
        control = self._shown[name] = _DragControl(self._scene, path, self._visible, self._size)

        async def drag(event: Any) -> None:  # so, and not in a thread, the events keep their order
            self._tell(name, event.client_id, _KINDS[event.phase])

        control.arrows.on_update(drag)
        control.ring.on_update(drag)
        return control

    def _let_go(self, name: str) -> None:
        """Tell for a browser that has gone, or has lost its handle."""
        if name in self._held:
            self._tell(name, self._held[name][0], InteractiveMarkerFeedback.MOUSE_UP)

    def _tell(self, name: str, browser: int, kind: int) -> None:
        control = self._shown.get(name)
        if control is None:
            return
        pose = control.pose
        with self._lock:
            if kind == InteractiveMarkerFeedback.MOUSE_UP:
                self._held.pop(name, None)
            else:
                self._held[name] = browser, self._clock()
            if name in self._known:
                self._known[name] = pose  # until the simulation says where it is
        who = {"header": Header(frame_id=WORLD_FRAME), "client_id": f"cockpit/{browser}", "marker_name": name}
        self._publish(InteractiveMarkerFeedback(**who, event_type=kind, pose=pose))


class Selection:
    """The same for all browsers."""

    def __init__(self) -> None:
        """Begin with none."""
        self.name = ""

    def toggle(self, name: str) -> None:
        """Take another one; let go of the one that has been taken."""
        self.name = "" if name == self.name else name
