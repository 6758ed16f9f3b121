"""All commands of clients by code, and the reasons why some are refused."""

from __future__ import annotations

from drone_sim.remote.legacy.groups import GROUPS
from drone_sim.remote.legacy.objects import JOINTS, OBJECTS
from drone_sim.remote.legacy.request import Handler, Request, Table
from drone_sim.remote.legacy.scripts import SCRIPTS, SIGNALS
from drone_sim.remote.legacy.sensors import SENSORS
from drone_sim.remote.legacy.simulator import SIMULATOR
from drone_sim.remote.legacy.windows import WINDOWS

_FILES = (
    "files are not transferred: put it into the folder of the scene, and do not set the option for a client-side file"
)
_PAIRS = "collision and distance objects are not supported; pass two objects to simxCheckCollision or simxCheckDistance"
_UNSUPPORTED = {
    0x3004: ("simxTransferFile", _FILES),
    0x3006: ("simxEraseFile", _FILES),
    0x300A: ("simxGetCollisionHandle", _PAIRS),
    0x300B: ("simxGetDistanceHandle", _PAIRS),
    0x1026: ("simxReadCollision", _PAIRS),
    0x1027: ("simxReadDistance", _PAIRS),
    0x3005: ("simxLoadUI", "user interfaces of V-REP 3.x are not supported"),
    0x0005: ("simxCloseScene", "there is always exactly one scene: simxLoadScene replaces it"),
}


def _refused(name: str, why: str) -> Handler:
    def refuse(request: Request) -> bytes:
        raise request.refused(why)

    return Handler(name, refuse)


FUNCTIONS: Table = {
    **OBJECTS,
    **JOINTS,
    **SIGNALS,
    **SENSORS,
    **SIMULATOR,
    **WINDOWS,
    **SCRIPTS,
    **GROUPS,
    **{code: _refused(*why) for code, why in _UNSUPPORTED.items()},
}


def served(code: int) -> Handler:
    """Return the handler of a command; for an unknown one, a handler that refuses it."""
    return FUNCTIONS.get(code) or _refused(f"command {code:#06x}", "there is no such command")
