"""Functions of a child script that were meant to be called, and would not be: their names are not those of a phase."""

from __future__ import annotations

import difflib
import functools
import logging
from collections.abc import Collection, Iterator

from drone_sim.scripting.api.constants import PHASES

_LOG = logging.getLogger(__name__)  # not the script's own words
_PREFIX = "sysCall_"
FUNCTIONS = {phase: f"{_PREFIX}{phase}" for phase in PHASES}
VISION = f"{_PREFIX}vision"  # of the script of a vision sensor, before its sensing
THREADS = (f"{_PREFIX}thread", f"{_PREFIX}threadmain")  # of 4.3 and newer; of 4.0 to 4.2
_PLAIN = {name.replace("_", "").lower(): name for name in (*FUNCTIONS.values(), *THREADS)}
_NEAR, _NEAR_WITHOUT_SYS = 0.75, 0.9  # of difflib's ratio
_LONGEST = 60  # characters of a name that is looked at

# What CoppeliaSim calls in one kind of script or another, and this simulator in none.
_OTHER_KINDS = """
    nonSimulation realTimeIdle info msg event data ext moduleEntry beforeMainScript beforeSimulation afterSimulation
    suspend suspended resume beforeInstanceSwitch afterInstanceSwitch beforeSave afterSave beforeCopy afterCopy
    beforeDelete afterDelete afterCreate selChange userConfig addOnScriptRun addOnScriptSuspend addOnScriptSuspended
    addOnScriptResume dyn dynCallback joint jointCallback contact contactCallback visionCallback trigger
"""
_ELSEWHERE = frozenset(_PREFIX + name for name in _OTHER_KINDS.split())


def misspelt(functions: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield name and phase function of what was probably meant to be that one, which is missing."""
    for name in functions:
        meant = _meant(name)
        if meant is not None and meant not in functions:
            yield name, meant


def never_called(name: str, meant: str) -> str:
    """Return what to say of a name that `misspelt` found."""
    return f"{name} would never be called; near names are {meant}"


def warn(path: str, functions: Collection[str]) -> None:
    """Say in the log which of a script's functions are not called here."""
    for name in sorted(functions):
        if name in _ELSEWHERE:
            _LOG.warning("%s: %s is never called here; these are: %s", path, name, _listed())
        elif _meant(name) is not None:
            _LOG.warning("%s: %s is never called; did you mean %s?", path, name, _meant(name))


def idle(functions: Collection[str]) -> str:
    """Return what to say of a script none of whose functions is called, '' for any other."""
    if any(name in functions for name in (*FUNCTIONS.values(), *THREADS, VISION)):
        return ""
    bare = [f"rename {name} to {FUNCTIONS[name]}" for name in PHASES if name in functions]
    return "; ".join([f"has none of the functions {_listed()}, {THREADS[0]}, so nothing flies the drone", *bare])


@functools.lru_cache(1000)
def _meant(name: str) -> str | None:
    """Return the phase function that a name comes near to, None for one that is known or is none of ours."""
    if name in (*FUNCTIONS.values(), *THREADS, VISION) or name in _ELSEWHERE or len(name) > _LONGEST:
        return None
    plain = name.replace("_", "").lower()
    cutoff = 0.0 if plain.startswith("syscall") else _NEAR if plain.startswith("sys") else _NEAR_WITHOUT_SYS
    near = difflib.get_close_matches(plain, _PLAIN, n=1, cutoff=cutoff)
    return _PLAIN[near[0]] if near else None


def _listed() -> str:
    return ", ".join(FUNCTIONS.values())
