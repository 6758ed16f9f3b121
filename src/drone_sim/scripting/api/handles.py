"""Handles, and the flags that scripts add to them."""

from __future__ import annotations

from drone_sim.scripting.api.constants import CONSTANTS

AXIS = GREYSCALE = CODED = CONSTANTS["handleflag_axis"]  # the same bit, which each function understands in its own way
METRES = CONSTANTS["handleflag_depthbuffermeters"]
_FIRST_FLAG = 1 << 20


def bare(handle: int) -> int:
    """Return a handle without its flags."""
    return int(handle) % _FIRST_FLAG if handle >= _FIRST_FLAG else handle


def has(handle: int, flag: int) -> bool:
    """Tell whether a flag was added to a handle."""
    return handle >= _FIRST_FLAG and bool(int(handle) & flag)
