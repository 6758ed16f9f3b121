"""Handles that slide level, rise and turn, as rviz knows them: interactive markers; and who holds which of them."""

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

PATIENCE = 1.0  # s; while a handle is held, rviz says so every 0.25 s
_UPRIGHT = Quaternion(0, 2**-0.5, 0, 2**-0.5)  # a control acts along, about, or across its x axis: turned to z


class MarkerServer(InteractiveMarkerServer):
    """An interactive marker server whose timer may still publish while rospy closes the topic at the node's end."""

    @property
    def watched(self) -> bool:
        """Whether somebody listens."""
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


def new_handle(name: str, looks: Sequence[Marker], scale: float = 0.5, arrows: bool = True) -> InteractiveMarker:
    """Return a handle that slides level when its looks are dragged; with `arrows`, of `scale` m, it rises and turns."""
    handle = InteractiveMarker(name=name, scale=scale)
    handle.header.frame_id = WORLD_FRAME
    handle.pose.orientation.w = 1.0
    slide = InteractiveMarkerControl(name="slide", orientation=_UPRIGHT, always_visible=True)
    slide.interaction_mode = InteractiveMarkerControl.MOVE_PLANE
    slide.markers = list(looks)
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
    """The handles that clients hold; a client that has been silent for PATIENCE has released its handle, or has died.

    Any thread may call all of it.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """Begin with none; take a monotonic clock."""
        self._clock = clock
        self._lock = threading.Lock()
        self._heard: dict[tuple[str, str], float] = {}  # by handle and client, s

    def on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Take a client's feedback on a handle; only a client that has pressed the mouse on it can hold it."""
        held = feedback.marker_name, feedback.client_id
        with self._lock:
            if feedback.event_type == InteractiveMarkerFeedback.MOUSE_UP:
                self._heard.pop(held, None)
            elif feedback.event_type == InteractiveMarkerFeedback.MOUSE_DOWN or held in self._heard:
                self._heard[held] = self._clock()

    def names(self) -> set[str]:
        """Return the handles that are held."""
        with self._lock:
            since = self._clock() - PATIENCE
            self._heard = {one: heard for one, heard in self._heard.items() if heard > since}
            return {name for name, _ in self._heard}
