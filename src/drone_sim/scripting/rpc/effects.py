"""Effects of the API's functions: the kinds of data that they read or change.

A read may be made in advance, and its result is valid until a call may have changed data of its kind. A call without a
return value may be sent with the next message. Any other function is called at once, and may change everything.
"""

from __future__ import annotations

from drone_sim.scripting.api.matrices import Matrices, Poses
from drone_sim.scripting.api.packing import Bits, Packing, Tables

PLACES, MOTION, PARAMETERS, SIGNALS, TIME, NAMES = "places", "motion", "parameters", "signals", "time", "names"
KINDS = (PLACES, MOTION, PARAMETERS, SIGNALS, TIME, NAMES)

# Pure functions of their arguments, which are called in the script's process.
OWN_CLASSES: tuple[type, ...] = (Matrices, Poses, Bits, Packing, Tables)
OWN_THREADS = (
    *("setThreadSwitchTiming", "setThreadAutomaticSwitch", "getThreadAutomaticSwitch", "setStepping", "acquireLock"),
    *("releaseLock", "getThreadId", "setThreadResumeLocation", "delegateChildScriptExecution"),
)
MAX_FUNCTIONS = 100_000  # that a script may pass to the simulation
MAX_READS = 200  # reads of a segment, handles of a segment, and segments, that a script may announce
OWN_LOG = ("addLog", "addStatusbarMessage")

# Reads of known poses, and changes of marks' poses, which the script's process may do by itself (`places`).
PLACED = ["getObjectPosition", "getObjectOrientation", "getObjectQuaternion", "getObjectPose", "getObjectMatrix"]
PUT = ["setObjectPosition", "setObjectOrientation", "setObjectQuaternion", "setObjectPose", "setObjectMatrix"]

_READS = {
    PLACES: "getObjectParent getJointPosition",
    MOTION: "getObjectVelocity getVelocity",
    PARAMETERS: "getScriptSimulationParameter getUserParameter",
    SIGNALS: "getInt32Signal getFloatSignal getStringSignal",
    TIME: "getSimulationTime getSimulationTimeStep getSimulationState getThreadExitRequest",
    NAMES: "getObjectHandle getObject getScriptHandle",
}
_CHANGES: dict[tuple[str, ...], str] = {
    (PLACES, MOTION): " ".join(PUT),
    (PARAMETERS,): "setScriptSimulationParameter setUserParameter",
    (SIGNALS,): "setInt32Signal setFloatSignal setStringSignal clearInt32Signal clearFloatSignal clearStringSignal",
    (): "addDrawingObjectItem addForce addForceAndTorque",
}
READS = {f"sim.{name}": kind for kind, names in _READS.items() for name in names.split()}
CHANGES = {f"sim.{name}": kinds for kinds, names in _CHANGES.items() for name in names.split()}
READS["simROS.getTime"] = TIME
CHANGES["simROS.publish"] = ()
