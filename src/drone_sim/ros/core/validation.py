"""Checks of messages: poses, frames, changes of weather and faults; and where a message comes from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import Pose as PoseMessage

from drone_sim.config.errors import changed
from drone_sim.config.types import Checked, ParameterError
from drone_sim.files import yaml_files
from drone_sim.mechanics.state import Pose
from drone_sim.message_text import shown
from drone_sim.ros.core.inbox import Intervention
from drone_sim.ros.core.message_conversion import WORLD_FRAME, xyz, xyzw
from drone_sim.vehicles import checks
from drone_sim.vehicles.checks import Refused
from drone_sim.vehicles.parameters import EquipmentParameters

_MAX_DEPTH, _MAX_LENGTH = 4, 1000  # of the keys; of key and value together, in characters


def read_changes(message: KeyValue, model: Checked) -> dict[str, Any]:
    """Return the changes in a message: key commands/loss and value 0.2 give {commands: {loss: 0.2}}.

    `model` holds current values; changes that it does not allow raise Refused, before they reach the simulation.
    """
    parts = message.key.strip("/").split("/")
    if len(parts) > _MAX_DEPTH or len(message.key) + len(message.value) > _MAX_LENGTH:
        raise Refused(f"key {shown(message.key)}: too long")
    try:
        value: Any = yaml_files.parse(message.value)
    except yaml_files.YamlError as error:
        raise Refused(f"value {shown(message.value)}: {error}") from None
    for part in reversed(parts):
        value = {part: value} if part else value
    if not isinstance(value, Mapping):
        raise Refused(f"key '': must be one of {', '.join(type(model).model_fields)}")
    check_changes(value, model)
    return dict(value)


def check_changes(changes: Mapping[str, Any], model: Checked) -> None:
    """Raise Refused for changes that the parameters do not allow."""
    try:
        changed(model, changes)
    except ParameterError as error:
        raise Refused(error.text) from None


def read_pose(frame: str, message: PoseMessage, parameters: EquipmentParameters, lowest: float = 0.0) -> Pose:
    """Return the pose of a message; its height must be at least `lowest` (m). Raises Refused."""
    check_frame(frame)
    return checks.pose(xyz(message.position), xyzw(message.orientation), parameters, lowest)


def check_frame(frame: str) -> None:
    """Raise Refused for any frame other than `world`."""
    if frame.lstrip("/") not in ("", WORLD_FRAME):
        raise Refused(f"frame_id {shown(frame)}: must be '{WORLD_FRAME}'")


# ---- where a message comes from


def sender(message: Any) -> str:
    """Return the name of the node that sent a message or a service request; "?" if rospy did not receive it."""
    header = getattr(message, "_connection_header", None) or {}
    return str(header.get("callerid", "?"))


def intervention(action: str, what: str, name: str, message: Any) -> Intervention:
    """Return the intervention of a message or request that was received on the topic or service `name`."""
    return Intervention(action, what, rospy.resolve_name(name), sender(message))
