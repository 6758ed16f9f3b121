"""`sim`: the simulation parameters of scripts, and the log."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Collection
from math import isfinite
from typing import Any

import numpy as np

from drone_sim.scripting.api.calls import WrongValue
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.names import Names
from drone_sim.scripting.api.registry import Attachment, ScriptParameters
from drone_sim.scripting.api.script_values import refuse_if_too_large
from drone_sim.scripting.api.types import Handle, Name
from drone_sim.scripting.script_log import say
from drone_sim.wording import near_names

_LOG = logging.getLogger(__name__)  # not the script's own words

_MOST = 1000  # parameters of one script
_NEAR = 0.8  # of difflib's ratio
_LONGEST = 80  # characters of a name that is looked at
_LEVELS = {
    **{CONSTANTS[name]: logging.WARNING for name in ("verbosity_warnings", "verbosity_scriptwarnings")},
    **{CONSTANTS[name]: logging.ERROR for name in ("verbosity_errors", "verbosity_scripterrors")},
}
_SELF, _TREE = CONSTANTS["handle_self"], CONSTANTS["handle_tree"]


class Scripts:
    """The functions on scripts."""

    def __init__(self, host: Host, names: Names):
        """Take the drone whose scripts they are, and how a name is understood."""
        self._objects = host.objects
        self._find = names.getObject
        self._scripts = host.scripts
        self._parameters = host.scripts.parameters
        self._own = host.scripts.attached_to(host.own_script)

    # ---- scripts

    def getScriptHandle(self, name: Name | None = None) -> int:
        """Return the handle of the script that is attached to an object; of this one without a name."""
        if name is None or name == _SELF:
            return self._own.handle
        try:
            found = self._objects[self._find(name)].name
        except ValueError:
            found = name
        return self._scripts.attached_to(found).handle

    def getObjectAssociatedWithScript(self, script: Handle) -> int:
        """Return the handle of the object that a script is attached to."""
        return self._objects.handle(self._script(script).name)

    def getScriptSimulationParameter(self, script: Handle, name: Name, _as_string: bool = False) -> Any:
        """Return a simulation parameter of a script."""
        parameters = self._script(script).parameters
        if name not in parameters:
            raise ValueError(f"no script parameter '{name}'; {near_names(name, parameters)}")
        value = parameters[name]
        return list(value) if isinstance(value, (list, tuple)) else value

    def setScriptSimulationParameter(self, script: Handle, name: Name, value: Any) -> None:
        """Set a simulation parameter of a script: `particleVelocity` (m/s) drives a propeller.

        With sim.handle_tree it is set in this script and those below. A name that a propeller's law does not have is
        refused where it comes near to one that it has; of any other the log says once that nothing reads it.
        """
        known = self._parameters.get(script)
        if known and name in known and type(value) is float and isfinite(value):  # four times a step, so at once
            known[name] = value
            return
        scripts = self._tree() if script == _TREE else [self._script(script)]
        if script == _TREE or name not in scripts[0].parameters:
            self._check_name(scripts, name)
        for one in scripts:
            _set(one.parameters, name, value)

    def getUserParameter(self, handle: Handle, name: Name, _options: Any = None) -> Any:
        """Return a simulation parameter of the script that is attached to an object (4.x)."""
        return self.getScriptSimulationParameter(self._script_of(handle).handle, name)

    def setUserParameter(self, handle: Handle, name: Name, value: Any) -> None:
        """Set a simulation parameter of the script that is attached to an object (4.x)."""
        self.setScriptSimulationParameter(self._script_of(handle).handle, name, value)

    def _script_of(self, handle: int) -> Attachment:
        return self._own if handle == _SELF else self._scripts.attached_to(self._objects[handle].name)

    def _tree(self) -> list[Attachment]:
        """Return this script and those below it."""
        whole = self._objects[self._objects.handle(self._own.name)]
        return [one for one in self._scripts if self._objects[self._objects.handle(one.name)].is_part_of(whole)]

    def _check_name(self, scripts: Collection[Attachment], name: Any) -> None:
        """Raise ValueError for a misspelt parameter of a propeller; say of one that nothing reads that it is so."""
        of_propellers = self._scripts.law_parameters()
        if list(scripts) == [self._own]:
            if name in of_propellers:
                said = "'%s' is a parameter of the propellers; in the script of %s nothing reads it"
                _LOG.warning(said, name, self._own.name)
            return
        if name in of_propellers or name in self._own.read or not any(one.is_law for one in scripts):
            return
        plain = {known.lower(): known for known in sorted(of_propellers)}
        near = difflib.get_close_matches(str(name)[:_LONGEST].replace("_", "").lower(), plain, cutoff=_NEAR)
        if near:
            known = ", ".join(plain[one] for one in near)
            raise ValueError(f"a propeller has no script parameter '{name}'; near names are {known}")
        _LOG.warning("nothing reads '%.80s' of a propeller; particleVelocity drives it", name)

    def _script(self, handle: int) -> Attachment:
        if handle == _SELF:
            return self._own
        if not isinstance(handle, (int, float)):
            raise WrongValue("the handle of a script is expected")
        return self._scripts[int(handle)]

    # ---- log

    def addStatusbarMessage(self, message: Any) -> None:
        """Write a line to the log."""
        say(message)

    def addLog(self, verbosity: int, message: Any) -> None:
        """Write a line to the log: an error, a warning, or a word, by its verbosity."""
        say(message, _LEVELS.get(verbosity, logging.INFO))


def _set(parameters: ScriptParameters, name: Any, value: Any) -> None:
    """Keep a value; raises WrongValue, ValueError."""
    value = _stored(value, parameters.get(name))
    refuse_if_too_large([name, value])
    if name not in parameters and len(parameters) >= _MOST:
        raise ValueError(f"a script has at most {_MOST} parameters")
    parameters[name] = value


def _stored(value: Any, before: Any) -> Any:
    """Return a value as V-REP keeps it, where '5.33' is a number and 'true' is true.

    Raises WrongValue where something else comes in the place of a number.
    """
    if isinstance(value, str):
        value = _from_text(value)
    elif isinstance(value, list):
        value = list(value)  # the script's own may change
    elif isinstance(value, np.number):
        value = value.item()
    if type(value) is float or type(value) is int:
        if not isfinite(value):
            raise WrongValue("a finite number is expected")
    elif type(before) is float or type(before) is int:
        raise WrongValue("a number is expected")
    return value


def _from_text(text: str) -> Any:
    words: dict[str, tuple[Any]] = {"true": (True,), "false": (False,)}
    if text in words:
        return words[text][0]
    try:
        return float(text)
    except ValueError:
        return text
