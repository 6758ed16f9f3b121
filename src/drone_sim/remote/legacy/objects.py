"""Object commands: handles, poses, velocities, parents, parameters, copying and removal."""

from __future__ import annotations

from drone_sim.remote.legacy.asked import Asked, Served, Table, nothing
from drone_sim.remote.legacy.values import counted, floats, ints

_SCENE = -12  # sim.handle_scene


def _get_pose(function: str) -> Served:
    return Served(f"simxG{function[1:]}", lambda ask: floats(*ask.sim(function, *ask.key)))


def _get_pose_3_1(function: str) -> Served:
    """Return the older form of a command, whose data is the handle of the reference object."""
    return Served(f"simxG{function[1:]}", lambda ask: floats(*ask.sim(function, *ask.key, *ask.take("i"))))


def _set_pose(function: str, count: int) -> Served:
    def put(ask: Asked) -> bytes:
        relative_to, *place = ask.take(f"i{count}f")
        return nothing(ask.sim(function, *ask.key, relative_to, place))

    return Served(f"simxS{function[1:]}", put)


def _velocity(ask: Asked) -> bytes:
    linear, angular = ask.sim("getObjectVelocity", *ask.key)
    return floats(*linear, *angular)


def _set_parent(ask: Asked) -> bytes:
    parent, keep_in_place = ask.take("iB")
    return nothing(ask.sim("setObjectParent", *ask.key, parent, bool(keep_in_place)))


def _parameter(function: str, layout: str) -> Served:
    def read(ask: Asked) -> bytes:
        is_supported, value = ask.sim(function, *ask.key)
        if not is_supported:
            raise ask.refused(f"the parameter {ask.key[1]} is not supported")
        return floats(value) if layout == "f" else ints(value)

    return Served(f"simxG{function[1:]}", read)


def _set_parameter(function: str, layout: str) -> Served:
    return Served(f"simxS{function[1:]}", lambda ask: nothing(ask.sim(function, *ask.key, *ask.take(layout))))


def _copy(ask: Asked) -> bytes:
    return counted(ask.sim("copyPasteObjects", ask.handles()))


def _select(ask: Asked) -> bytes:
    ask.reach.selected[:] = ask.handles()
    return b""


def _create_dummy(ask: Asked) -> bytes:
    size, *_ = ask.take("f13B")
    return ints(ask.sim("createDummy", size))


OBJECTS: Table = {
    0x3001: Served("simxGetObjectHandle", lambda ask: ints(ask.sim("getObjectHandle", *ask.key))),
    0x3019: Served("simxGetCollectionHandle", lambda ask: ints(ask.sim("getCollectionHandle", *ask.key))),
    0x102A: Served("simxGetObjects", lambda ask: counted(ask.sim("getObjectsInTree", _SCENE, *ask.key))),
    0x1012: Served("simxGetObjectParent", lambda ask: ints(ask.sim("getObjectParent", *ask.key))),
    0x101C: Served("simxSetObjectParent", _set_parent),
    0x200B: Served("simxGetObjectChild", lambda ask: ints(ask.sim("getObjectChild", *ask.key))),
    0x200E: _get_pose("getObjectPosition"),
    0x200D: _get_pose("getObjectOrientation"),
    0x2801: _get_pose("getObjectQuaternion"),
    0x1019: _get_pose_3_1("getObjectPosition"),
    0x1018: _get_pose_3_1("getObjectOrientation"),
    0x101B: _set_pose("setObjectPosition", 3),
    0x101A: _set_pose("setObjectOrientation", 3),
    0x1801: _set_pose("setObjectQuaternion", 4),
    0x1036: Served("simxGetObjectVelocity", _velocity),
    0x2007: _parameter("getObjectFloatParameter", "f"),
    0x2008: _parameter("getObjectIntParameter", "i"),
    0x2009: _set_parameter("setObjectFloatParameter", "f"),
    0x200A: _set_parameter("setObjectIntParameter", "i"),
    0x1034: Served("simxGetModelProperty", lambda ask: ints(ask.sim("getModelProperty", *ask.key))),
    0x1035: Served("simxSetModelProperty", lambda ask: nothing(ask.sim("setModelProperty", *ask.key, *ask.take("i")))),
    0x102E: Served("simxCopyPasteObjects", _copy),
    0x1028: Served("simxRemoveObject", lambda ask: nothing(ask.sim("removeObject", *ask.key))),
    0x1037: Served("simxRemoveModel", lambda ask: nothing(ask.sim("removeModel", *ask.key))),
    0x0006: Served("simxGetObjectSelection", lambda ask: counted(ask.reach.selected)),
    0x102F: Served("simxSetObjectSelection", _select),
    0x0009: Served("simxCreateDummy", _create_dummy),
}
