"""Parameters of the simulator that a launch file sets."""

from __future__ import annotations

from typing import Any

import rospy

from drone_sim.config.types import ParameterError
from drone_sim.ros.core.shell_files import NOT_GIVEN, from_shell, script_from_shell
from drone_sim.run import parameters as parameters_module
from drone_sim.run.parameters import Parameters

# Values of parameters whose launch arguments the user did not give.
_DEFAULTS = {**dict.fromkeys(("script", "start", "gui", "real_time_factor"), NOT_GIVEN), "scene_file": "none"}


def parameters_of(name: str, **others: Any) -> Parameters:
    """Return the private parameters of the simulator node `name`; `others` replace some of them.

    A default of the launch file does not override a config or a scene. Raises ParameterError.
    """
    values: dict[str, Any] = rospy.get_param(name, {})
    if not isinstance(values, dict):
        raise ParameterError(f"must be a namespace with parameters such as {name}/script", (name,), str(values)[:80])
    values = {key: value for key, value in values.items() if value != _DEFAULTS.get(key, ...)}
    for group, argument in (("remote_api", "serve"), ("lockstep", "wait_for")):
        inner = values.get(group)
        if isinstance(inner, dict) and inner.get(argument) == NOT_GIVEN:
            values[group] = {key: value for key, value in inner.items() if key != argument}
    readers = {
        "profile": from_shell,
        "config": from_shell,
        "script": script_from_shell,
        "scene_file": from_shell,
        "timeline_file": from_shell,
    }
    for key, read in readers.items():
        if isinstance(values.get(key), str):
            names = values[key].split(",") if key == "config" else [values[key]]
            values[key] = ",".join(map(read, names))
    return parameters_module.load({**values, **others})


def use_sim_time() -> bool:
    """Return ROS's parameter /use_sim_time. Raises ParameterError."""
    value = rospy.get_param("/use_sim_time", False)
    if not isinstance(value, bool):
        raise ParameterError("must be true or false", ("/use_sim_time",), str(value)[:80])
    return value
