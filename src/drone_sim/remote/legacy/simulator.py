"""Simulator commands: start, pause and stop, scenes and models, simulator parameters."""

from __future__ import annotations

from drone_sim.remote.legacy.request import Handler, Request, Table, direct, floats, ints, nothing, text

_TOOLBAR = ("startSimulation", "pauseSimulation", "stopSimulation")  # by key


def _press_button(request: Request) -> bytes:
    (which,) = request.key
    if not 0 <= which < len(_TOOLBAR):
        raise request.refused(f"{which}: must be 0 (start), 1 (pause) or 2 (stop)")
    return nothing(request.sim(_TOOLBAR[which]))


def _set_array(request: Request) -> bytes:
    return nothing(request.sim("setArrayParameter", *request.key, list(request.take("3f"))))


SIMULATOR: Table = {
    0x1007: Handler("simxStartSimulation", _press_button),
    0x3002: direct("loadScene", nothing),
    0x3003: direct("loadModel", ints),
    0x101D: direct("getArrayParameter", lambda values: floats(*values[:3])),
    0x101E: Handler("simxSetArrayParameter", _set_array),
    0x101F: direct("getBoolParameter", ints, name="simxGetBooleanParameter"),
    0x1020: direct("setBooleanParameter", nothing, "i"),
    0x1021: direct("getIntegerParameter", ints),
    0x1022: direct("setIntegerParameter", nothing, "i"),
    0x1023: direct("getFloatingParameter", floats),
    0x1024: direct("setFloatingParameter", nothing, "f"),
    0x1025: direct("getStringParameter", text),
}
