"""Simulator commands: start, pause and stop, scenes and models, simulator parameters."""

from __future__ import annotations

from drone_sim.remote.legacy.asked import Asked, Served, Table, nothing
from drone_sim.remote.legacy.values import floats, ints, text

_TOOLBAR = ("startSimulation", "pauseSimulation", "stopSimulation")  # by key


def _press_button(ask: Asked) -> bytes:
    (which,) = ask.key
    if not 0 <= which < len(_TOOLBAR):
        raise ask.refused(f"{which}: must be 0 (start), 1 (pause) or 2 (stop)")
    return nothing(ask.sim(_TOOLBAR[which]))


def _array(ask: Asked) -> bytes:
    return floats(*ask.sim("getArrayParameter", *ask.key)[:3])


def _set(function: str, layout: str) -> Served:
    return Served(f"simxS{function[1:]}", lambda ask: nothing(ask.sim(function, *ask.key, *ask.take(layout))))


def _set_array(ask: Asked) -> bytes:
    return nothing(ask.sim("setArrayParameter", *ask.key, list(ask.take("3f"))))


SIMULATOR: Table = {
    0x1007: Served("simxStartSimulation", _press_button),
    0x3002: Served("simxLoadScene", lambda ask: nothing(ask.sim("loadScene", *ask.key))),
    0x3003: Served("simxLoadModel", lambda ask: ints(ask.sim("loadModel", *ask.key))),
    0x101D: Served("simxGetArrayParameter", _array),
    0x101E: Served("simxSetArrayParameter", _set_array),
    0x101F: Served("simxGetBooleanParameter", lambda ask: ints(ask.sim("getBoolParameter", *ask.key))),
    0x1020: _set("setBooleanParameter", "i"),
    0x1021: Served("simxGetIntegerParameter", lambda ask: ints(ask.sim("getIntegerParameter", *ask.key))),
    0x1022: _set("setIntegerParameter", "i"),
    0x1023: Served("simxGetFloatingParameter", lambda ask: floats(ask.sim("getFloatingParameter", *ask.key))),
    0x1024: _set("setFloatingParameter", "f"),
    0x1025: Served("simxGetStringParameter", lambda ask: text(ask.sim("getStringParameter", *ask.key))),
}
