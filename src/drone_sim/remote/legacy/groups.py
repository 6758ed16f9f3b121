"""simxGetObjectGroupData: one kind of data about all objects of a type, or of a collection."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from drone_sim.remote.legacy.request import Handler, Request, Table, floats, ints, text

_SCENE, _ALL, _PARENT, _WORLD = -12, -2, -11, -1  # sim.handle_...
_ANY, _OBJECT_TYPES = 109, 20  # sim_appobj_object_type; object types are below 20
_CYCLIC = -1.0  # sent as the range of a cyclic joint


class _Data(NamedTuple):
    """The data of an object: integers, floats and strings."""

    whole: Sequence[float] = ()
    real: Sequence[float] = ()
    texts: Sequence[str] = ()


def _pose(frame: int, *functions: str) -> Callable[[Request, int], _Data]:
    return lambda request, handle: _Data(
        real=[value for name in functions for value in request.sim(name, handle, frame)]
    )


def _velocity(*which: int) -> Callable[[Request, int], _Data]:
    def read(request: Request, handle: int) -> _Data:
        linear_and_angular = request.sim("getObjectVelocity", handle)
        return _Data(real=[number for index in which for number in linear_and_angular[index]])

    return read


def _proximity(request: Request, handle: int) -> _Data:
    state, _, point, detected, normal = request.sim("readProximitySensor", handle)
    return _Data([max(0, state), detected], [*point, *normal])


def _force(request: Request, handle: int) -> _Data:
    state, force, torque = request.sim("readForceSensor", handle)
    return _Data([state], [*force, *torque])


def _joint(request: Request, handle: int) -> _Data:
    return _Data(real=[request.sim("getJointPosition", handle), request.sim("getJointForce", handle)])


def _joint_kind(request: Request, handle: int) -> _Data:
    cyclic, (low, extent) = request.sim("getJointInterval", handle)
    whole = request.sim("getJointType", handle), request.sim("getJointMode", handle)[0]
    return _Data(whole, [low, _CYCLIC if cyclic else extent])


_POSITION, _EULER, _QUATERNION = "getObjectPosition", "getObjectOrientation", "getObjectQuaternion"
_KINDS: Sequence[Callable[[Request, int], _Data]] = (
    lambda request, handle: _Data(texts=[request.sim("getObjectName", handle)]),
    lambda request, handle: _Data([request.sim("getObjectType", handle)]),
    lambda request, handle: _Data([request.sim("getObjectParent", handle)]),
    _pose(_WORLD, _POSITION),
    _pose(_PARENT, _POSITION),
    _pose(_WORLD, _EULER),
    _pose(_PARENT, _EULER),
    _pose(_WORLD, _QUATERNION),
    _pose(_PARENT, _QUATERNION),
    _pose(_WORLD, _POSITION, _EULER),
    _pose(_PARENT, _POSITION, _EULER),
    _pose(_WORLD, _POSITION, _QUATERNION),
    _pose(_PARENT, _POSITION, _QUATERNION),
    _proximity,
    _force,
    _joint,
    _joint_kind,
    _velocity(0),
    _velocity(1),
    _velocity(0, 1),
)


def _objects(request: Request, kind: int) -> Any:
    if kind == _ANY or 0 <= kind < _OBJECT_TYPES:
        return request.sim("getObjectsInTree", _SCENE, _ALL if kind == _ANY else kind)
    return request.sim("getCollectionObjects", kind)


def _group(request: Request) -> bytes:
    kind, what = request.key
    if not 0 <= what < len(_KINDS):
        raise request.refused(f"kind of data {what}: must be from 0 to {len(_KINDS) - 1}")
    handles = _objects(request, kind)
    data = [_KINDS[what](request, handle) for handle in handles]
    whole, real, texts = ([value for item in data for value in item[part]] for part in range(3))
    counts = ints(len(handles), len(whole), len(real), len(texts))
    return counts + ints(*handles, *whole) + floats(*real) + b"".join(map(text, texts))


GROUPS: Table = {0x200C: Handler("simxGetObjectGroupData", _group)}
