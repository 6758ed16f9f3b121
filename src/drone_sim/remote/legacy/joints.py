"""Joint commands: positions, targets and forces."""

from __future__ import annotations

from drone_sim.remote.legacy.request import Handler, Request, Table, nothing
from drone_sim.remote.legacy.values import floats


def _number(function: str) -> Handler:
    return Handler(f"simxG{function[1:]}", lambda request: floats(request.sim(function, *request.key)))


def _set_number(function: str) -> Handler:
    return Handler(
        f"simxS{function[1:]}", lambda request: nothing(request.sim(function, *request.key, *request.take("f")))
    )


def _set_spherical_matrix(request: Request) -> bytes:
    return nothing(request.sim("setSphericalJointMatrix", *request.key, list(request.take("12f"))))


JOINTS: Table = {
    0x1001: _number("getJointPosition"),
    0x1002: _set_number("setJointPosition"),
    0x1008: _set_number("setJointTargetVelocity"),
    0x100C: _set_number("setJointTargetPosition"),
    0x100D: _number("getJointForce"),
    0x100E: _set_number("setJointForce"),
    0x1038: _number("getJointMaxForce"),
    0x100A: Handler("simxGetJointMatrix", lambda request: floats(*request.sim("getJointMatrix", *request.key))),
    0x100B: Handler("simxSetSphericalJointMatrix", _set_spherical_matrix),
}
