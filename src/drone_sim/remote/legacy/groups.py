"""simxGetObjectGroupData: one thing about all objects of a kind, or of a collection."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from drone_sim.remote.legacy.asked import Asked, Served, Table
from drone_sim.remote.legacy.values import floats, ints, text

_SCENE, _ALL, _PARENT, _WORLD = -12, -2, -11, -1  # sim.handle_...
_ANY, _MOST_KINDS = 109, 20  # sim_appobj_object_type; numbers below are kinds of objects
_CYCLIC = -1.0  # what stands for the range of a joint without an end


class _Said(NamedTuple):
    """What is said of one object."""

    whole: Sequence[float] = ()
    real: Sequence[float] = ()
    texts: Sequence[str] = ()


def _place(frame: int, *functions: str) -> Callable[[Asked, int], _Said]:
    return lambda ask, handle: _Said(real=[number for one in functions for number in ask.sim(one, handle, frame)])


def _velocity(*which: int) -> Callable[[Asked, int], _Said]:
    def said(ask: Asked, handle: int) -> _Said:
        both = ask.sim("getObjectVelocity", handle)
        return _Said(real=[number for one in which for number in both[one]])

    return said


def _proximity(ask: Asked, handle: int) -> _Said:
    state, _, point, found, normal = ask.sim("readProximitySensor", handle)
    return _Said([max(0, state), found], [*point, *normal])


def _force(ask: Asked, handle: int) -> _Said:
    state, force, torque = ask.sim("readForceSensor", handle)
    return _Said([state], [*force, *torque])


def _joint(ask: Asked, handle: int) -> _Said:
    return _Said(real=[ask.sim("getJointPosition", handle), ask.sim("getJointForce", handle)])


def _joint_kind(ask: Asked, handle: int) -> _Said:
    cyclic, (low, extent) = ask.sim("getJointInterval", handle)
    whole = ask.sim("getJointType", handle), ask.sim("getJointMode", handle)[0]
    return _Said(whole, [low, _CYCLIC if cyclic else extent])


_POSITION, _EULER, _QUATERNION = "getObjectPosition", "getObjectOrientation", "getObjectQuaternion"
_KINDS: Sequence[Callable[[Asked, int], _Said]] = (
    lambda ask, handle: _Said(texts=[ask.sim("getObjectName", handle)]),
    lambda ask, handle: _Said([ask.sim("getObjectType", handle)]),
    lambda ask, handle: _Said([ask.sim("getObjectParent", handle)]),
    _place(_WORLD, _POSITION),
    _place(_PARENT, _POSITION),
    _place(_WORLD, _EULER),
    _place(_PARENT, _EULER),
    _place(_WORLD, _QUATERNION),
    _place(_PARENT, _QUATERNION),
    _place(_WORLD, _POSITION, _EULER),
    _place(_PARENT, _POSITION, _EULER),
    _place(_WORLD, _POSITION, _QUATERNION),
    _place(_PARENT, _POSITION, _QUATERNION),
    _proximity,
    _force,
    _joint,
    _joint_kind,
    _velocity(0),
    _velocity(1),
    _velocity(0, 1),
)


def _objects(ask: Asked, kind: int) -> Any:
    if kind == _ANY or 0 <= kind < _MOST_KINDS:
        return ask.sim("getObjectsInTree", _SCENE, _ALL if kind == _ANY else kind)
    return ask.sim("getCollectionObjects", kind)


def _group(ask: Asked) -> bytes:
    kind, what = ask.key
    if not 0 <= what < len(_KINDS):
        raise ask.refused(f"kind of data {what}: must be from 0 to {len(_KINDS) - 1}")
    handles = _objects(ask, kind)
    said = [_KINDS[what](ask, one) for one in handles]
    whole, real, texts = ([value for one in said for value in one[part]] for part in range(3))
    counts = ints(len(handles), len(whole), len(real), len(texts))
    return counts + ints(*handles, *whole) + floats(*real) + b"".join(map(text, texts))


GROUPS: Table = {0x200C: Served("simxGetObjectGroupData", _group)}
