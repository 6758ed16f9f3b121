"""Loads the child script of a vehicle, or of another object, with the API that it is written against."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping

import numpy as np

from drone_sim.scripting import load
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_sim, make_sim_ros
from drone_sim.scripting.api.turns import Turns
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.vehicles.shared import Shared

_LOG = logging.getLogger(__name__)  # not the script's own words
Pictures = Mapping[str, Callable[[], np.ndarray]]  # what a vision sensor sees now, by the name of its object


def load_child_script(path: str, host: Host, bus: MessageBus, pictures: Pictures, shared: Shared) -> load.Script:
    """Load a script ('' for the tutorial's) on the object that `host` names. Raises ScriptError."""
    limit, turns = TimeLimit(shared.script_time_limit), Turns()
    surroundings = Surroundings(
        shared.time,
        shared.time_step,
        pictures,
        limit.outside,
        limit.inside,
        turns,
        lambda: shared.state,
    )
    modules = {"sim": make_sim(host, surroundings), "simROS": make_sim_ros(bus)}
    script = load.load(path, modules, limit, turns)
    host.scripts.attached_to(host.own_script).loaded(script, shared.time())
    return script


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
