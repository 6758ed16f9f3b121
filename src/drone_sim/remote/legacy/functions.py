"""What clients may ask for: every command by its code, and why some are refused."""

from __future__ import annotations

from drone_sim.remote.legacy.asked import Asked, Served, Table
from drone_sim.remote.legacy.groups import GROUPS
from drone_sim.remote.legacy.joints import JOINTS
from drone_sim.remote.legacy.objects import OBJECTS
from drone_sim.remote.legacy.scripts import SCRIPTS
from drone_sim.remote.legacy.sensors import SENSORS
from drone_sim.remote.legacy.signals import SIGNALS
from drone_sim.remote.legacy.simulator import SIMULATOR
from drone_sim.remote.legacy.windows import WINDOWS

_FILES = "no files are taken over: put it into the folder of the scene, and leave out the option for the client's side"
_PAIRS = "there are no collision and distance objects; simxCheckCollision and simxCheckDistance take two objects"
_WHY = {
    0x3004: ("simxTransferFile", _FILES),
    0x3006: ("simxEraseFile", _FILES),
    0x300A: ("simxGetCollisionHandle", _PAIRS),
    0x300B: ("simxGetDistanceHandle", _PAIRS),
    0x1026: ("simxReadCollision", _PAIRS),
    0x1027: ("simxReadDistance", _PAIRS),
    0x3005: ("simxLoadUI", "there are no user interfaces of V-REP 3.x"),
    0x0005: ("simxCloseScene", "there is always one scene: simxLoadScene lets another take its place"),
}


def _refused(name: str, why: str) -> Served:
    def refuse(ask: Asked) -> bytes:
        raise ask.refused(why)

    return Served(name, refuse)


FUNCTIONS: Table = {
    **OBJECTS,
    **JOINTS,
    **SIGNALS,
    **SENSORS,
    **SIMULATOR,
    **WINDOWS,
    **SCRIPTS,
    **GROUPS,
    **{code: _refused(*why) for code, why in _WHY.items()},
}


def served(code: int) -> Served:
    """Return the function that carries out a command; for an unknown one, a function that refuses it."""
    return FUNCTIONS.get(code) or _refused(f"command {code:#06x}", "there is no such command")
