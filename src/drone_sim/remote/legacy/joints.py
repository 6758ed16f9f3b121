"""Joint commands: positions, targets and forces."""

from __future__ import annotations

from drone_sim.remote.legacy.asked import Asked, Served, Table, nothing
from drone_sim.remote.legacy.values import floats


def _number(function: str) -> Served:
    return Served(f"simxG{function[1:]}", lambda ask: floats(ask.sim(function, *ask.key)))


def _set_number(function: str) -> Served:
    return Served(f"simxS{function[1:]}", lambda ask: nothing(ask.sim(function, *ask.key, *ask.take("f"))))


def _set_spherical_matrix(ask: Asked) -> bytes:
    return nothing(ask.sim("setSphericalJointMatrix", *ask.key, list(ask.take("12f"))))


JOINTS: Table = {
    0x1001: _number("getJointPosition"),
    0x1002: _set_number("setJointPosition"),
    0x1008: _set_number("setJointTargetVelocity"),
    0x100C: _set_number("setJointTargetPosition"),
    0x100D: _number("getJointForce"),
    0x100E: _set_number("setJointForce"),
    0x1038: _number("getJointMaxForce"),
    0x100A: Served("simxGetJointMatrix", lambda ask: floats(*ask.sim("getJointMatrix", *ask.key))),
    0x100B: Served("simxSetSphericalJointMatrix", _set_spherical_matrix),
}
