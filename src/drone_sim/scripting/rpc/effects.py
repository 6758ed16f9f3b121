"""Effects of the API's functions: the kinds of data that they read or change.

The result of a read stays valid until a call may have changed data of its kind. A call of CHANGES may be sent with the
next message, because it returns nothing. Any other function is called at once, and may change everything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from drone_sim.scripting.api.matrices import Matrices, Poses
from drone_sim.scripting.api.packing import Bits, Packing, Tables
from drone_sim.scripting.api.scripts import ScriptFunctions
from drone_sim.scripting.api.threads import Threads

POSES, PARAMETERS, SIGNALS, CONSTANT = "poses", "parameters", "signals", ""  # nothing in CHANGES changes a CONSTANT

_PURE_CLASSES: tuple[type, ...] = (Matrices, Poses, Bits, Packing, Tables)
OWN: dict[type, str] = {  # functions of other classes that are called in the script's process
    Threads: "setThreadSwitchTiming setThreadAutomaticSwitch getThreadAutomaticSwitch setStepping acquireLock"
    " releaseLock getThreadId setThreadResumeLocation delegateChildScriptExecution",
    ScriptFunctions: "addLog addStatusbarMessage",
}
MAX_FUNCTIONS = 100_000  # that a script may pass to the simulation
MAX_READS = 200  # in a snapshot

# Reads that depend on nothing but the poses of their arguments.
POSE_READS = [f"sim.getObject{name}" for name in ("Position", "Orientation", "Quaternion", "Pose", "Matrix")]
_READS = {
    POSES: "getJointPosition getObjectVelocity getVelocity",
    PARAMETERS: "getScriptSimulationParameter getUserParameter",
    SIGNALS: "getInt32Signal getFloatSignal getStringSignal",
    CONSTANT: "getSimulationTime getSimulationTimeStep getSimulationState getThreadExitRequest"
    " getObjectHandle getObject getScriptHandle getObjectParent",
}
_CHANGES = {
    POSES: "setObjectPosition setObjectOrientation setObjectQuaternion setObjectPose setObjectMatrix",
    PARAMETERS: "setScriptSimulationParameter setUserParameter",
    SIGNALS: "setInt32Signal setFloatSignal setStringSignal clearInt32Signal clearFloatSignal clearStringSignal",
    CONSTANT: "addDrawingObjectItem",
}
READS = {f"sim.{name}": kind for kind, names in _READS.items() for name in names.split()}
READS["simROS.getTime"] = CONSTANT
CHANGES = {f"sim.{name}": kind for kind, names in _CHANGES.items() for name in names.split()}


def is_own(function: Callable[..., Any]) -> bool:
    """Return whether a function is called in the script's process, because it needs nothing of the simulation."""
    kind = type(getattr(function, "__self__", None))
    return kind in _PURE_CLASSES or function.__name__ in OWN.get(kind, "").split()


def phase_of(command: str, arguments: list[Any]) -> str:
    """Return the name of a phase: the command that the simulation sends, or for a call what it calls."""
    return str(arguments[0]) if command == "call" else command
