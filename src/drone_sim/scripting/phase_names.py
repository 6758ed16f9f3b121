"""Checks for functions of a child script whose names are almost, but not exactly, those of phases."""

from __future__ import annotations

import difflib
import functools
import logging
from collections.abc import Collection, Iterator

from drone_sim.scripting.api.constants import CALL_TYPES, CUSTOMIZATION_PHASES, PHASES

_LOG = logging.getLogger(__name__)  # for messages about scripts, not from scripts
_PREFIX = "sysCall_"
FUNCTIONS = {phase: f"{_PREFIX}{phase}" for phase in CALL_TYPES}
VISION = f"{_PREFIX}vision"  # called in the script of a vision sensor, before its sensing
THREADS = (f"{_PREFIX}thread", f"{_PREFIX}threadmain")  # in 4.3 and newer; in 4.0 to 4.2
_NORMALIZED = {name.replace("_", "").lower(): name for name in (*FUNCTIONS.values(), *THREADS)}
_NEAR, _NEAR_WITHOUT_SYS = 0.75, 0.9  # least ratio of difflib
_LONGEST = 60  # characters of a name that is checked

# Functions that CoppeliaSim calls in some kind of script, but this simulator never calls.
_OTHER_KINDS = """
    realTimeIdle info msg event data ext moduleEntry beforeMainScript suspend suspended resume beforeInstanceSwitch
    afterInstanceSwitch beforeSave afterSave beforeCopy afterCopy beforeDelete afterDelete afterCreate selChange
    userConfig addOnScriptRun addOnScriptSuspend addOnScriptSuspended addOnScriptResume dyn dynCallback joint
    jointCallback contact contactCallback visionCallback trigger
"""
_ELSEWHERE = frozenset(_PREFIX + name for name in _OTHER_KINDS.split())
_IN_CUSTOMIZATION = frozenset(FUNCTIONS[phase] for phase in CUSTOMIZATION_PHASES)


def misspelt(functions: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield each function that is probably a misspelt phase function, with the name of the phase function."""
    for name in functions:
        meant = _intended_phase(name)
        if meant is not None and meant not in functions:
            yield name, meant


def never_called(name: str, meant: str) -> str:
    """Return the message for a function found by `misspelt`."""
    return f"{name} would never be called; near names are {meant}"


def warn(path: str, functions: Collection[str], customizes: bool = False) -> None:
    """Log which of a script's functions look like callbacks but are not called here.

    `customizes`: whether it is a customization script.
    """
    never = _ELSEWHERE if customizes else _ELSEWHERE | _IN_CUSTOMIZATION
    found = sorted(never.intersection(functions))
    if found:
        are = "is" if len(found) == 1 else "are"
        _LOG.warning("%s: %s %s never called here; these are: %s", path, ", ".join(found), are, _list_phases())
    for name in sorted(functions):
        if name not in never and _intended_phase(name) is not None:
            _LOG.warning("%s: %s is never called; did you mean %s?", path, name, _intended_phase(name))


def idle(functions: Collection[str], customizes: bool = False) -> str:
    """Return the message for a script of which no function is called; '' for any other script."""
    called = {*FUNCTIONS.values(), *THREADS, VISION} - (frozenset() if customizes else _IN_CUSTOMIZATION)
    if not called.isdisjoint(functions):
        return ""
    bare = [f"rename {name} to {FUNCTIONS[name]}" for name in PHASES if name in functions]
    return "; ".join([f"has none of the functions {_list_phases()}, {THREADS[0]}, so nothing flies the drone", *bare])


@functools.lru_cache(1000)
def _intended_phase(name: str) -> str | None:
    """Return the phase function with a similar name; None for a known or an unrelated name."""
    if name in (*FUNCTIONS.values(), *THREADS, VISION) or name in _ELSEWHERE or len(name) > _LONGEST:
        return None
    normalized = name.replace("_", "").lower()
    cutoff = 0.0 if normalized.startswith("syscall") else _NEAR if normalized.startswith("sys") else _NEAR_WITHOUT_SYS
    near = difflib.get_close_matches(normalized, _NORMALIZED, n=1, cutoff=cutoff)
    return _NORMALIZED[near[0]] if near else None


def _list_phases() -> str:
    return ", ".join(FUNCTIONS[phase] for phase in PHASES)
