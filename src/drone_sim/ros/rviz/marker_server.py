"""Interactive markers: a server, handles that slide level, rise and turn, and the handles that clients hold."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import rospy
from geometry_msgs.msg import Quaternion
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, InteractiveMarkerFeedback, Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.ros.core.message_conversion import WORLD_FRAME

TIMEOUT = 1.0  # s; while a handle is held, rviz sends feedback every 0.25 s
_UPRIGHT = Quaternion(0, 2**-0.5, 0, 2**-0.5)  # turns a control's x axis, along or about which it acts, to z


class MarkerServer(InteractiveMarkerServer):
    """An interactive marker server whose timer may still publish while rospy closes the topic at the node's end."""

    @property
    def has_subscribers(self) -> bool:
        return bool(self.update_pub.get_num_connections())

    def publish(self, update: Any) -> None:
        """Publish; do nothing if rospy has closed the topic at the node's end."""
        try:
            super().publish(update)
        except rospy.ROSException:
            if not rospy.is_shutdown():
                raise

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Accept a new handle's first client at once: interactive_markers ignores clients in the first second."""
        context = self.marker_contexts.get(feedback.marker_name)
        if context is not None and not context.last_client_id:
            context.last_client_id = feedback.client_id
        super().processFeedback(feedback)


def new_handle(name: str, markers: Sequence[Marker], scale: float = 0.5, arrows: bool = True) -> InteractiveMarker:
    """Return a handle that slides level if its markers are dragged.

    With `arrows`, it also has arrows and a ring of size `scale` (m), by which it rises and turns.
    """
    handle = InteractiveMarker(name=name, scale=scale)
    handle.header.frame_id = WORLD_FRAME
    handle.pose.orientation.w = 1.0
    slide = InteractiveMarkerControl(name="slide", orientation=_UPRIGHT, always_visible=True)
    slide.interaction_mode = InteractiveMarkerControl.MOVE_PLANE
    slide.markers = list(markers)
    handle.controls = [slide]
    if arrows:
        lift = InteractiveMarkerControl(name="lift", orientation=_UPRIGHT)
        lift.interaction_mode = InteractiveMarkerControl.MOVE_AXIS
        turn = InteractiveMarkerControl(name="turn", orientation=_UPRIGHT)
        turn.interaction_mode = InteractiveMarkerControl.ROTATE_AXIS
        handle.controls += [lift, turn]
    return handle


def level(matrix: Matrix) -> Matrix:
    """Return the pose of a handle for an object at `matrix`: upright, with the object's yaw."""
    return frames.from_rpy(frames.position(matrix), (0, 0, frames.to_rpy(matrix)[2]))


class HeldHandles:
    """Handles that clients hold. A client without feedback for TIMEOUT no longer holds its handle. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """`clock` must be monotonic (s)."""
        self._clock = clock
        self._lock = threading.Lock()
        self._received_at: dict[tuple[str, str], float] = {}  # by handle and client, s

    def on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Process a client's feedback on a handle. The client holds the handle from MOUSE_DOWN on."""
        key = feedback.marker_name, feedback.client_id
        with self._lock:
            if feedback.event_type == InteractiveMarkerFeedback.MOUSE_UP:
                self._received_at.pop(key, None)
            elif feedback.event_type == InteractiveMarkerFeedback.MOUSE_DOWN or key in self._received_at:
                self._received_at[key] = self._clock()

    def names(self) -> set[str]:
        with self._lock:
            since = self._clock() - TIMEOUT
            self._received_at = {key: time for key, time in self._received_at.items() if time > since}
            return {name for name, _ in self._received_at}
