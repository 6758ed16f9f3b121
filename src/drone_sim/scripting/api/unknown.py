"""Functions and plugins of CoppeliaSim that do not exist here, and messages for scripts that use them."""

from __future__ import annotations

import re
from collections.abc import Iterable

from drone_sim.message_text import near_names
from drone_sim.scripting.api.planning_problem import IS_INSTALLED

_LONGEST = 80  # characters of a name that is shown

# Plugins whose names a script may look up: they are nil in Lua, as in a CoppeliaSim without them.
PLUGINS = {
    "simROS2": "this is ROS 1: simROS has the same functions",
    "simB0": "the ZeroMQ remote API does what B0 did",
    "simIK": "inverse kinematics is not supported",
    "simGeom": "there is no geometry plugin",
    "simOctomap": "octrees are not supported",
    "simIM": "these image filters are not supported: publish the picture to a node that uses OpenCV",
    "simZMQ": "sockets are not for child scripts: use topics",
    "simWS": "sockets are not for child scripts: use topics",
    "simMTB": "there is no such plugin here",
    "simIGL": "there is no geometry plugin",
    "simURDF": "the parameter `urdf` of a vehicle names a URDF file",
    "simSDF": "there is no importer for scripts",
    "simAssimp": "meshes come from the scene file",
    "simQHull": "there is no geometry plugin",
    "simRRS1": "industrial robots are not supported",
    "simSkeleton": "there is no such plugin here",
}
_NO_PLANNER = "plan with simOMPL, or outside, and send waypoints"
if not IS_INSTALLED:
    PLUGINS["simOMPL"] = "./dev.sh setup --all, or pip install ompl, installs the path planner"

# Patterns for the names of CoppeliaSim's functions that do not exist here, with the reasons. Flat names are converted
# to names in modules: simCreateIkGroup is sim.createIkGroup.
ABSENT: dict[str, str] = {
    r"simExtROS_\w+": "the plugin of V-REP 3.0 to 3.2; use simROS.advertise, simROS.publish and simROS.subscribe",
    r"simros_\w+": "the plugin of V-REP 3.0 to 3.2; use simROS.advertise, simROS.publish and simROS.subscribe",
    **({} if IS_INSTALLED else {r"simExtOMPL_\w+": PLUGINS["simOMPL"]}),
    r"simExtVision_\w+|simVision\.\w+": "this filter is not supported: read the picture in the script, or use a node",
    r"simExtOctomap_\w+": PLUGINS["simOctomap"],
    r"simExt(?!RosInterface_|OMPL_)\w+": "this plugin of V-REP is not supported",
    r"sim_ext_\w+": "this constant's plugin is not supported",
    r"sim\.\w*(?:Ik|IK)(?:Group|Element|Path|\b)\w*|sim\.(?:getConfigForTipPose|computeJacobian)": PLUGINS["simIK"],
    r"sim\.(?:load|save|close)Scene": ("only a client of the remote API can do this, while the simulation is stopped"),
    r"sim\.(?:load|save|close|export|import)\w*": "`scene_file` names the scene; loadModel adds objects of a file",
    r"sim\.(?:create|copyPaste|remove|group|ungroup|convert|scale)(?!DrawingObject|Particle|Dialog)\w*": (
        "such objects come from the scene file"
    ),
    r"sim\.(?:set|compute)Shape(?:Mass|Inertia|Material|BB)\w*": "use setShapeMassAndInertia",
    r"sim\.(?:generateShapeFromPath|convexDecompose)": "such objects come from the scene file",
    r"sim\.(?:\w*PathSearch\w*|getPathPlanningHandle|searchPath|(?:find|get|simplify)Mp\w+)": _NO_PLANNER,
    r"sim\.setScriptVariable": "executeScriptString('name = 1', script) sets a variable of another script",
    r"sim\.\w+JointDependency": "joints cannot depend on each other: set each joint",
    r"sim\.\w*(?:Collision|Distance)\w*": (
        "collision and distance objects are not supported: use checkCollision and checkDistance"
    ),
    r"sim\.\w*(?:Mill|Mechanism)\w*": "mills are not supported",
    r"sim\.\w*(?:WorkThread|Plugin)\w*": "scripts cannot load plugins",
    r"simROS\.imageTransport(?:Subscribe|ShutdownSubscriber)": "subscribe to sensor_msgs/Image",
    r"sim\.\w*PathTarget\w*": "a path has no target of its own: followPath moves an object along it",
    r"sim\.\w+ObjectCustomData": "use writeCustomDataBlock and readCustomDataBlock",
    r"sim\.executeLuaCode": "use executeScriptString",
    r"sim\.launchExecutable": "a child script cannot start programs: use a launch file",
}
_FLAT = re.compile(r"sim([A-Z]\w*)")


def not_there(prefix: str, name: str, known: Iterable[str]) -> str:
    """Return a one-line message for a name that the API does not have: the reason, or similar names.

    `prefix` is 'sim.' for a name in this module, '' for a global.
    """
    name = name[:_LONGEST]
    if not prefix and name in PLUGINS:
        return f"there is no plugin {name} here: {PLUGINS[name]}"
    reason = why_absent(f"{prefix}{name}")
    if reason:
        return f"there is no {prefix}{name} here: {reason}"
    module = prefix.removesuffix(".")
    return f"{f'{module} has' if module else 'there is'} no '{name}'; {near_names(name, known)}"


def why_absent(name: str) -> str:
    """Return why a function of CoppeliaSim does not exist here, '' for other names."""
    flat = _FLAT.fullmatch(name)
    in_module = f"sim.{flat.group(1)[0].lower()}{flat.group(1)[1:]}" if flat else name
    for pattern, reason in ABSENT.items():
        if re.fullmatch(pattern, name) or re.fullmatch(pattern, in_module):
            return reason
    return ""
