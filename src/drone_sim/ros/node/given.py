"""The parameters that a simulator is given by ROS, checked."""

from __future__ import annotations

from typing import Any

import rospy

from drone_sim.ros.node.paths import from_shell
from drone_sim.run import parameters as parameters_module
from drone_sim.run.parameters import ParameterError, Parameters
from drone_sim.scripting.load import script_path


def read_parameters() -> Parameters:
    """Return the node's private parameters. Raises ParameterError, and ScriptError for a script that is not there."""
    parameters = parameters_of(rospy.get_name())
    script_path(parameters.script)  # a file that is not there ends the node; an error in one that is stops the flight
    return parameters


def parameters_of(name: str, **others: Any) -> Parameters:
    """Return the private parameters of the simulator that has this name, `others` in place of some.

    Raises ParameterError.
    """
    given: dict[str, Any] = rospy.get_param(name, {})
    if not isinstance(given, dict):
        raise ParameterError(f"parameter {name} = {str(given)[:80]}: must hold parameters, such as {name}/script")
    for key in ("config", "script", "scene_file"):
        if isinstance(given.get(key), str):
            names = given[key].split(",") if key == "config" else [given[key]]
            given[key] = ",".join(map(from_shell, names))
    return parameters_module.load({**given, **others})


def use_sim_time() -> bool:
    """Return ROS's parameter /use_sim_time. Raises ParameterError."""
    given = rospy.get_param("/use_sim_time", False)
    if not isinstance(given, bool):
        raise ParameterError(f"parameter /use_sim_time = {str(given)[:80]}: must be true or false")
    return given
