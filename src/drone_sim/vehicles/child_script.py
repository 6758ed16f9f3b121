"""Loads the child script of a vehicle, or of another object, with the API that it is written against."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol, TypeVar

import numpy as np

from drone_sim.mechanics.inertia import Inertia
from drone_sim.scripting import load
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros
from drone_sim.scripting.api.turns import Turns
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.vehicles.shared import Shared

_LOG = logging.getLogger(__name__)  # not the script's own words
_Value = TypeVar("_Value")
Pictures = Mapping[str, Callable[[], np.ndarray]]  # what a vision sensor sees now, by the name of its object


class Seen(Protocol):
    """A vehicle, of which a script sees cameras and masses."""

    @property
    def pictures(self) -> Pictures:
        """What its cameras see now, by the name of their object."""

    @property
    def planes(self) -> Mapping[str, tuple[float, float]]:
        """The near and far plane (m) of its cameras, by the name of their object."""

    def masses(self) -> Mapping[str, float]:
        """Return the mass (kg) of each of its shapes, by object name."""

    def inertias(self) -> Mapping[str, Inertia]:
        """Return how the mass of each of its shapes lies, by object name."""


def load_child_script(
    path: str,
    host: Host,
    bus: MessageBus,
    seen: Sequence[Seen],
    shared: Shared,
    guarded: Callable[[load.Script], load.Script] = lambda script: script,
) -> load.Script:
    """Load a script ('' for the pilot) on the object that `host` names; `guarded` wraps it. Raises ScriptError."""
    limit, turns = TimeLimit(shared.script_time_limit), Turns()
    around = surroundings(seen, shared, limit, turns)
    modules = {"sim": make_sim(host, around), "simROS": make_sim_ros(bus, shared.time), **make_plugins(host)}
    script = guarded(load.load(path, modules, limit, turns))
    host.scripts.attached_to(host.own_script).loaded(script, shared.time())
    return script


def surroundings(seen: Sequence[Seen], shared: Shared, limit: TimeLimit, turns: Turns) -> Surroundings:
    """Return what the API finds around a script that is called within a limit."""
    return Surroundings(
        clock=shared.time,
        time_step=shared.time_step,
        pictures=_together(one.pictures for one in seen),
        planes=_together(one.planes for one in seen),
        outside=limit.outside,
        inside=limit.inside,
        turns=turns,
        gravity=shared.gravity,
        masses=lambda: _together(one.masses() for one in seen),
        inertias=lambda: _together(one.inertias() for one in seen),
        control=shared.control,
        data=shared.data,
        tubes=shared.tubes,
        nearest=lambda *between: shared.nearest(*between),
    )


def _together(mappings: Iterable[Mapping[str, _Value]]) -> dict[str, _Value]:
    return {name: value for one in mappings for name, value in one.items()}


def refuse_if_idle(script: load.Script, path: str, bus: MessageBus) -> None:
    """Raise ScriptError for a script that nothing would ever call; say so of an empty one."""
    if script.idle and not bus.is_subscribed:
        if not script.is_empty:
            raise ScriptError("load", load.script_path(path), 0, script.idle)
        _LOG.warning("%s: %s", path, script.idle)


def call_init(script: load.Script, bus: MessageBus) -> None:
    """Call a script's init. Raises ScriptError, also for a callback that it has not."""
    script.call("init")
    check_callbacks(script, bus)


def check_callbacks(script: load.Script, bus: MessageBus) -> None:
    """Raise ScriptError where a script has subscribed with a function that it has not."""
    for callback in bus.new_callbacks():
        script.check(callback)
