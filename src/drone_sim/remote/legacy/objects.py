"""Commands for objects and joints: poses, parents, parameters, positions, targets and forces."""

from __future__ import annotations

from drone_sim.remote.legacy.request import Handler, Request, Table, counted, direct, floats, ints, nothing, vector

_SCENE = -12  # sim.handle_scene


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


def _copy(request: Request) -> bytes:
    return counted(request.sim("copyPasteObjects", request.handles()))


def _select(request: Request) -> bytes:
    request.context.selected[:] = request.handles()
    return b""


def _create_dummy(request: Request) -> bytes:
    size, *_ = request.take("f13B")
    return ints(request.sim("createDummy", size))


OBJECTS: Table = {
    0x3001: direct("getObjectHandle", ints),
    0x3019: direct("getCollectionHandle", ints),
    0x102A: Handler("simxGetObjects", lambda request: counted(request.sim("getObjectsInTree", _SCENE, *request.key))),
    0x1012: direct("getObjectParent", ints),
    0x101C: Handler("simxSetObjectParent", _set_parent),
    0x200B: direct("getObjectChild", ints),
    0x200E: direct("getObjectPosition", vector),
    0x200D: direct("getObjectOrientation", vector),
    0x2801: direct("getObjectQuaternion", vector),
    0x1019: direct("getObjectPosition", vector, "i"),  # older: the handle of the reference object is in the data
    0x1018: direct("getObjectOrientation", vector, "i"),
    0x101B: _set_pose("setObjectPosition", 3),
    0x101A: _set_pose("setObjectOrientation", 3),
    0x1801: _set_pose("setObjectQuaternion", 4),
    0x1036: Handler("simxGetObjectVelocity", _velocity),
    0x2007: _parameter("getObjectFloatParameter", "f"),
    0x2008: _parameter("getObjectIntParameter", "i"),
    0x2009: direct("setObjectFloatParameter", nothing, "f"),
    0x200A: direct("setObjectIntParameter", nothing, "i"),
    0x1034: direct("getModelProperty", ints),
    0x1035: direct("setModelProperty", nothing, "i"),
    0x102E: Handler("simxCopyPasteObjects", _copy),
    0x1028: direct("removeObject", nothing),
    0x1037: direct("removeModel", nothing),
    0x0006: Handler("simxGetObjectSelection", lambda request: counted(request.context.selected)),
    0x102F: Handler("simxSetObjectSelection", _select),
    0x0009: Handler("simxCreateDummy", _create_dummy),
}


def _set_spherical_matrix(request: Request) -> bytes:
    return nothing(request.sim("setSphericalJointMatrix", *request.key, list(request.take("12f"))))


JOINTS: Table = {
    0x1001: direct("getJointPosition", floats),
    0x1002: direct("setJointPosition", nothing, "f"),
    0x1008: direct("setJointTargetVelocity", nothing, "f"),
    0x100C: direct("setJointTargetPosition", nothing, "f"),
    0x100D: direct("getJointForce", floats),
    0x100E: direct("setJointForce", nothing, "f"),
    0x1038: direct("getJointMaxForce", floats),
    0x100A: direct("getJointMatrix", vector),
    0x100B: Handler("simxSetSphericalJointMatrix", _set_spherical_matrix),
}
