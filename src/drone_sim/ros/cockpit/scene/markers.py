"""MarkerArrays, which the simulation makes for rviz, in the browser's scene."""

from __future__ import annotations

import copy
import io
import threading
from collections.abc import Callable, Collection
from typing import Any, NamedTuple

from geometry_msgs.msg import Pose, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.ros.cockpit.scene import looks
from drone_sim.ros.cockpit.scene.frames import FrameTree

_Key = tuple[str, int]
_DIGITS = 2  # of a size in m
_SHADES = 1  # digits of a colour


class _Look(NamedTuple):
    kind: bytes
    form: bytes  # points and words, which may change in place


class _ShownMarker(NamedTuple):
    handle: Any  # None where there is nothing to see
    look: _Look
    marker: Marker


class MarkerNodes:
    """The markers of one topic. Messages are taken in any thread, and shown in the one that calls `show`."""

    def __init__(
        self,
        scene: Any,
        topic: str,
        frames: FrameTree,
        on_new: Callable[[Marker, Any], None] = lambda *_: None,
        *,
        hidden: Collection[str] = (),
        casts: bool = False,
    ):
        """Show those of `topic` in `scene`, each at its frame in `frames`; begin with none.

        `on_new` is called with every marker that is made anew, and its handle. `hidden` are namespaces that the browser
        has in another way; with `casts` the markers throw shadows.
        """
        self._scene = scene
        self._name = topic.replace("/", "_")
        self._frames = frames
        self._on_new = on_new
        self._hidden, self._casts = hidden, casts
        self._wanted: dict[_Key, Marker] = {}
        self._lock = threading.Lock()
        self._changed = False
        self._shown: dict[_Key, _ShownMarker] = {}

    def on_markers(self, message: MarkerArray) -> None:
        """Take a message."""
        with self._lock:
            for marker in message.markers:
                key = marker.ns, marker.id
                if marker.action == Marker.DELETEALL:
                    self._wanted.clear()
                elif marker.action == Marker.DELETE:
                    self._wanted.pop(key, None)
                elif marker.ns not in self._hidden:
                    if self._casts:
                        marker.colors = []  # light that was painted on for rviz; here is a sun
                    self._wanted[key] = marker
            self._changed = True

    def forget(self) -> None:
        """Show nothing."""
        with self._lock:
            self._wanted.clear()
        self._changed = True
        self.show()

    def show(self, frames_changed: bool = False) -> None:
        """Put into the scene what has changed; what hangs on a frame that is not known yet waits for it."""
        if not (self._changed or frames_changed):
            return
        with self._lock:
            wanted, self._changed = dict(self._wanted), False
        for key in self._shown.keys() - wanted.keys():
            self._remove(key)
        for key, marker in wanted.items():
            self._put(key, marker)

    def _put(self, key: _Key, marker: Marker) -> None:
        before, look = self._shown.get(key), _look(marker)
        if before is not None and self._change(before, look, marker):
            self._shown[key] = before._replace(look=look, marker=marker)
            return
        parent = self._frames.name(marker.header.frame_id)
        if parent is None:
            return
        namespace = marker.ns.replace("/", "_")
        name = f"{parent}/{self._name}/{namespace}/{marker.id}"
        if before is not None and before.handle is not None and before.handle.name != name:
            self._remove(key)
        handle = looks.show(self._scene, name, marker, self._casts)
        if handle is None:
            self._remove(key)
        else:
            self._on_new(marker, handle)
        self._shown[key] = _ShownMarker(handle, look, marker)

    @staticmethod
    def _change(before: _ShownMarker, look: _Look, marker: Marker) -> bool:
        """Show a marker by what is there already; tell whether that was possible."""
        same = before.look == look
        if before.handle is None or before.look.kind != look.kind:
            return same
        if not (same or looks.change(before.handle, marker)):
            return False
        if before.marker.pose != marker.pose:
            place = looks.place(marker)
            before.handle.position, before.handle.wxyz = place["position"], place["wxyz"]
        return True

    def _remove(self, key: _Key) -> None:
        gone = self._shown.pop(key, None)
        if gone is not None and gone.handle is not None:
            gone.handle.remove()


def _look(marker: Marker) -> _Look:
    """Return what differs between two markers that look different; their poses, times and ids do not.

    Colours and sizes that nobody could tell apart are the same: what is made anew is gone for a moment.
    """
    bare = copy.copy(marker)
    bare.header, bare.pose, bare.points, bare.text = Header(frame_id=marker.header.frame_id), Pose(), [], ""
    bare.scale = Vector3(*(round(value, _DIGITS) for value in (marker.scale.x, marker.scale.y, marker.scale.z)))
    bare.colors = [ColorRGBA(*(round(value, _SHADES) for value in (c.r, c.g, c.b, c.a))) for c in marker.colors]
    form = Marker(points=marker.points, text=marker.text)
    return _Look(_bytes(bare), _bytes(form))


def _bytes(marker: Marker) -> bytes:
    data = io.BytesIO()
    marker.serialize(data)
    return data.getvalue()
