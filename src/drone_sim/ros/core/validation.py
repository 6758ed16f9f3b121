"""What comes in by ROS, checked: parameters; poses; changes of weather and faults, which are keys of the YAML files."""

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
from drone_sim.ros.core.message_conversion import WORLD_FRAME, xyz, xyzw
from drone_sim.ros.core.startup import NOT_GIVEN, from_shell, script_from_shell
from drone_sim.run import parameters as parameters_module
from drone_sim.run.parameters import Parameters
from drone_sim.vehicles import checks
from drone_sim.vehicles.checks import Refused
from drone_sim.vehicles.parameters import EquipmentParameters

_DEEPEST, _LONGEST = 4, 1000  # keys, characters
# What a launch file's defaults leave in the parameters if the user gives no such argument.
_DEFAULTS = {**dict.fromkeys(("script", "start", "gui", "real_time_factor"), NOT_GIVEN), "scene_file": "none"}


def read_changes(message: KeyValue, model: Checked) -> dict[str, Any]:
    """Return what a message asks for, such as {commands: {loss: 0.2}} of commands/loss and 0.2; raises Refused.

    `model` holds values as there may be: others are refused before they reach the simulation.
    """
    parts = message.key.strip("/").split("/")
    if len(parts) > _DEEPEST or len(message.key) + len(message.value) > _LONGEST:
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
    """Raise Refused for what the parameters do not allow."""
    try:
        changed(model, changes)
    except ParameterError as error:
        raise Refused(error.text) from None


def checked_pose(frame: str, message: PoseMessage, parameters: EquipmentParameters, lowest: float = 0.0) -> Pose:
    """Return a pose that came in a frame, at `lowest` or above (m); raises Refused."""
    check_frame(frame)
    return checks.pose(xyz(message.position), xyzw(message.orientation), parameters, lowest)


def check_frame(frame: str) -> None:
    """Raise Refused for any other frame than `world`."""
    if frame.lstrip("/") not in ("", WORLD_FRAME):
        raise Refused(f"frame_id {shown(frame)}: must be '{WORLD_FRAME}'")


def parameters_of(name: str, **others: Any) -> Parameters:
    """Return the private parameters of the simulator that has this name, `others` in place of some.

    A default of the launch file does not override a config or a scene. Raises ParameterError.
    """
    given: dict[str, Any] = rospy.get_param(name, {})
    if not isinstance(given, dict):
        raise ParameterError(f"must be a namespace with parameters such as {name}/script", (name,), str(given)[:80])
    given = {key: value for key, value in given.items() if value != _DEFAULTS.get(key, ...)}
    for group, argument in (("remote_api", "serve"), ("lockstep", "wait_for")):
        values = given.get(group)
        if isinstance(values, dict) and values.get(argument) == NOT_GIVEN:
            given[group] = {key: value for key, value in values.items() if key != argument}
    for key, read in (
        ("config", from_shell),
        ("script", script_from_shell),
        ("scene_file", from_shell),
        ("timeline_file", from_shell),
    ):
        if isinstance(given.get(key), str):
            names = given[key].split(",") if key == "config" else [given[key]]
            given[key] = ",".join(map(read, names))
    return parameters_module.load({**given, **others})


def use_sim_time() -> bool:
    """Return ROS's parameter /use_sim_time. Raises ParameterError."""
    given = rospy.get_param("/use_sim_time", False)
    if not isinstance(given, bool):
        raise ParameterError("must be true or false", ("/use_sim_time",), str(given)[:80])
    return given
