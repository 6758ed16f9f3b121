"""Messages to the callbacks of the node without a ROS master: rospy's subscribers only store their callbacks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, WrenchStamped
from visualization_msgs.msg import InteractiveMarkerFeedback

from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.rviz.handles import VehicleHandles
from drone_sim.ros.vehicle.inputs import VehicleInputs
from drone_sim.run.simulation import Simulation

_CALLBACKS: dict[str, Callable[[Any], None]] = {}
_KINDS = {
    "cmd_vel": Twist,
    "set_pose": PoseStamped,
    "target_pose": PoseStamped,
    "initialpose": PoseWithCovarianceStamped,
    "push": WrenchStamped,
    "markers/feedback": InteractiveMarkerFeedback,
}


class _Stub:
    """Stub for rospy's Subscriber, Publisher and Timer."""

    def __init__(self, name: Any, _kind: Any = None, callback: Any = None, **_: Any) -> None:
        if callable(callback):
            _CALLBACKS[str(name)] = callback

    def __getattr__(self, _: str) -> Callable[..., int]:
        return lambda *_arguments, **_named: 0


rospy.Subscriber = rospy.Publisher = rospy.Timer = _Stub
rospy.rostime.set_rostime_initialized(True)


def send(simulation: Simulation, messages: list[tuple[str, dict[str, Any]]]) -> None:
    """Call the node's callbacks with the messages, and run the jobs that they queue."""
    inbox = Inbox()
    VehicleInputs(simulation, simulation.drone.parameters, inbox)
    VehicleHandles(simulation, inbox)
    for topic, fields in messages:
        message = _KINDS[topic]()
        _fill(message, fields)
        _CALLBACKS[f"{simulation.drone.name}/{topic}"](message)
    inbox.run_jobs()


def _fill(message: Any, fields: dict[str, Any]) -> None:
    if "frame" in fields:
        message.header.frame_id = fields["frame"]
    if "event" in fields:
        message.client_id, message.marker_name = fields["client"], fields["marker"]
        message.event_type = fields["event"]
    pose = message.pose if "position" in fields else None
    if isinstance(message, PoseWithCovarianceStamped):
        pose = message.pose.pose
    parts = {
        "position": lambda: pose.position,
        "orientation": lambda: pose.orientation,
        "linear": lambda: message.linear,
        "angular": lambda: message.angular,
        "force": lambda: message.wrench.force,
        "torque": lambda: message.wrench.torque,
    }
    for name in parts.keys() & fields.keys():
        for axis, value in zip("xyzw", fields[name]):
            setattr(parts[name](), axis, value)
