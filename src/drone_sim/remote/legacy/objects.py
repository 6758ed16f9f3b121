"""Object commands: handles, poses, velocities, parents, parameters, copying and removal."""

from __future__ import annotations

from drone_sim.remote.legacy.request import Handler, Request, Table, nothing
from drone_sim.remote.legacy.values import counted, floats, ints

_SCENE = -12  # sim.handle_scene


def _get_pose(function: str) -> Handler:
    return Handler(f"simxG{function[1:]}", lambda request: floats(*request.sim(function, *request.key)))


def _get_pose_3_1(function: str) -> Handler:
    """Return the older form of a command, whose data is the handle of the reference object."""
    return Handler(
        f"simxG{function[1:]}", lambda request: floats(*request.sim(function, *request.key, *request.take("i")))
    )


def _set_pose(function: str, count: int) -> Handler:
    def put(request: Request) -> bytes:
        relative_to, *place = request.take(f"i{count}f")
        return nothing(request.sim(function, *request.key, relative_to, place))

    return Handler(f"simxS{function[1:]}", put)


def _velocity(request: Request) -> bytes:
    linear, angular = request.sim("getObjectVelocity", *request.key)
    return floats(*linear, *angular)


def _set_parent(request: Request) -> bytes:
    parent, keep_in_place = request.take("iB")
    return nothing(request.sim("setObjectParent", *request.key, parent, bool(keep_in_place)))


def _parameter(function: str, layout: str) -> Handler:
    def read(request: Request) -> bytes:
        is_supported, value = request.sim(function, *request.key)
        if not is_supported:
            raise request.refused(f"the parameter {request.key[1]} is not supported")
        return floats(value) if layout == "f" else ints(value)

    return Handler(f"simxG{function[1:]}", read)


def _set_parameter(function: str, layout: str) -> Handler:
    return Handler(
        f"simxS{function[1:]}", lambda request: nothing(request.sim(function, *request.key, *request.take(layout)))
    )


def _copy(request: Request) -> bytes:
    return counted(request.sim("copyPasteObjects", request.handles()))


def _select(request: Request) -> bytes:
    request.context.selected[:] = request.handles()
    return b""


def _create_dummy(request: Request) -> bytes:
    size, *_ = request.take("f13B")
    return ints(request.sim("createDummy", size))


OBJECTS: Table = {
    0x3001: Handler("simxGetObjectHandle", lambda request: ints(request.sim("getObjectHandle", *request.key))),
    0x3019: Handler("simxGetCollectionHandle", lambda request: ints(request.sim("getCollectionHandle", *request.key))),
    0x102A: Handler("simxGetObjects", lambda request: counted(request.sim("getObjectsInTree", _SCENE, *request.key))),
    0x1012: Handler("simxGetObjectParent", lambda request: ints(request.sim("getObjectParent", *request.key))),
    0x101C: Handler("simxSetObjectParent", _set_parent),
    0x200B: Handler("simxGetObjectChild", lambda request: ints(request.sim("getObjectChild", *request.key))),
    0x200E: _get_pose("getObjectPosition"),
    0x200D: _get_pose("getObjectOrientation"),
    0x2801: _get_pose("getObjectQuaternion"),
    0x1019: _get_pose_3_1("getObjectPosition"),
    0x1018: _get_pose_3_1("getObjectOrientation"),
    0x101B: _set_pose("setObjectPosition", 3),
    0x101A: _set_pose("setObjectOrientation", 3),
    0x1801: _set_pose("setObjectQuaternion", 4),
    0x1036: Handler("simxGetObjectVelocity", _velocity),
    0x2007: _parameter("getObjectFloatParameter", "f"),
    0x2008: _parameter("getObjectIntParameter", "i"),
    0x2009: _set_parameter("setObjectFloatParameter", "f"),
    0x200A: _set_parameter("setObjectIntParameter", "i"),
    0x1034: Handler("simxGetModelProperty", lambda request: ints(request.sim("getModelProperty", *request.key))),
    0x1035: Handler(
        "simxSetModelProperty",
        lambda request: nothing(request.sim("setModelProperty", *request.key, *request.take("i"))),
    ),
    0x102E: Handler("simxCopyPasteObjects", _copy),
    0x1028: Handler("simxRemoveObject", lambda request: nothing(request.sim("removeObject", *request.key))),
    0x1037: Handler("simxRemoveModel", lambda request: nothing(request.sim("removeModel", *request.key))),
    0x0006: Handler("simxGetObjectSelection", lambda request: counted(request.context.selected)),
    0x102F: Handler("simxSetObjectSelection", _select),
    0x0009: Handler("simxCreateDummy", _create_dummy),
}
