"""~set_object_pose: puts an object of the scene elsewhere, as the timeline of a flight does."""

from __future__ import annotations

from collections.abc import Callable

import rospy
from geometry_msgs.msg import TransformStamped

from drone_sim.grading.permissions import MOVE
from drone_sim.mechanics.frames import to_rpy
from drone_sim.offline.timeline import ObjectMove
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.message_conversion import xyz, xyzw
from drone_sim.ros.core.validation import check_frame, intervention
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import checks

_NOT_TURNED = (0.0,) * 4  # a message's own quaternion, which nobody has set


class ObjectPoses:
    """Subscribes. `child_frame_id` is the object's name; without a rotation in the message, it keeps its own."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Subscribe for `simulation`, whose thread empties `inbox`."""
        self._simulation, self._inbox = simulation, inbox
        rospy.Subscriber("~set_object_pose", TransformStamped, self._take, queue_size=100, tcp_nodelay=True)

    def _take(self, message: TransformStamped) -> None:
        """Check a message, and have it carried out before the next step."""
        name = message.child_frame_id
        try:
            check_frame(message.header.frame_id)
            place, turn = xyz(message.transform.translation), xyzw(message.transform.rotation)
            parameters = self._simulation.parameters
            is_turned = turn != _NOT_TURNED
            pose = checks.pose(place, turn if is_turned else (0, 0, 0, 1), parameters, -parameters.position_limit)
        except checks.Refused as refused:
            rospy.logwarn_throttle(1, f"set_object_pose of '{name}' refused: {refused}")
            return
        move = ObjectMove(name, pose.position, to_rpy(pose.matrix) if is_turned else None)
        self._inbox.put(self._putting(move), intervention(MOVE, name, "~set_object_pose", message))

    def _putting(self, move: ObjectMove) -> Callable[[], None]:
        def put() -> None:
            try:
                move.apply(self._simulation.context.objects)
            except ValueError as error:
                rospy.logwarn_throttle(1, f"set_object_pose of '{move.name}' refused: {error}")

        return put
