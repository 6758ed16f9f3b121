"""Simulator commands: start, pause and stop, scenes and models, simulator parameters."""

from __future__ import annotations

from drone_sim.remote.legacy.request import Handler, Request, Table, nothing
from drone_sim.remote.legacy.values import floats, ints, text

_TOOLBAR = ("startSimulation", "pauseSimulation", "stopSimulation")  # by key


def _press_button(request: Request) -> bytes:
    (which,) = request.key
    if not 0 <= which < len(_TOOLBAR):
        raise request.refused(f"{which}: must be 0 (start), 1 (pause) or 2 (stop)")
    return nothing(request.sim(_TOOLBAR[which]))


def _array(request: Request) -> bytes:
    return floats(*request.sim("getArrayParameter", *request.key)[:3])


def _set(function: str, layout: str) -> Handler:
    return Handler(
        f"simxS{function[1:]}", lambda request: nothing(request.sim(function, *request.key, *request.take(layout)))
    )


def _set_array(request: Request) -> bytes:
    return nothing(request.sim("setArrayParameter", *request.key, list(request.take("3f"))))


SIMULATOR: Table = {
    0x1007: Handler("simxStartSimulation", _press_button),
    0x3002: Handler("simxLoadScene", lambda request: nothing(request.sim("loadScene", *request.key))),
    0x3003: Handler("simxLoadModel", lambda request: ints(request.sim("loadModel", *request.key))),
    0x101D: Handler("simxGetArrayParameter", _array),
    0x101E: Handler("simxSetArrayParameter", _set_array),
    0x101F: Handler("simxGetBooleanParameter", lambda request: ints(request.sim("getBoolParameter", *request.key))),
    0x1020: _set("setBooleanParameter", "i"),
    0x1021: Handler("simxGetIntegerParameter", lambda request: ints(request.sim("getIntegerParameter", *request.key))),
    0x1022: _set("setIntegerParameter", "i"),
    0x1023: Handler(
        "simxGetFloatingParameter", lambda request: floats(request.sim("getFloatingParameter", *request.key))
    ),
    0x1024: _set("setFloatingParameter", "f"),
    0x1025: Handler("simxGetStringParameter", lambda request: text(request.sim("getStringParameter", *request.key))),
}
