"""`sim`: scripts: their simulation parameters, the log, and calls from one script to another.

What is handed over in a call is copied: numbers, strings, and tables or lists of them. A script that waits for another
one's answer cannot be called meanwhile.
"""

from __future__ import annotations

import difflib
import functools
import logging
from collections.abc import Callable, Collection
from math import isfinite
from typing import Any

import numpy as np

from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.message_text import near_names
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions, Host, SceneServices
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.names import NameFunctions
from drone_sim.scripting.api.registry import Attachment, ScriptParameters
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.script_values import refuse_if_too_large
from drone_sim.scripting.api.types import Handle, Name, WrongValue
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import say

_LOG = logging.getLogger(__name__)  # not the script's own words

_MOST = 1000  # parameters of one script
_NEAR = 0.8  # of difflib's ratio
_LONGEST = 80  # characters of a name that is looked at
_LEVELS = {
    **{CONSTANTS[name]: logging.WARNING for name in ("verbosity_warnings", "verbosity_scriptwarnings")},
    **{CONSTANTS[name]: logging.ERROR for name in ("verbosity_errors", "verbosity_scripterrors")},
}
_SELF, _TREE, _CHAIN, _ALL, _MAIN = (
    CONSTANTS[f"handle_{one}"] for one in ("self", "tree", "chain", "all", "main_script")
)
_TYPES = tuple(CONSTANTS[f"scripttype_{one}"] for one in ("childscript", "customizationscript"))
_TYPES_OF_NONE = tuple(CONSTANTS[f"scripttype_{one}"] for one in ("mainscript", "addonscript", "sandboxscript"))
_CHILD, _CUSTOMIZATION, _NONE = CONSTANTS["scripttype_childscript"], CONSTANTS["scripttype_customizationscript"], -1


class _OnScripts(Functions):
    """What functions on scripts share."""

    def __init__(self, names: NameFunctions, host: Host, services: SceneServices, ignored: Ignored):
        """`names` understands names; the others are what all functions take."""
        super().__init__(host, services, ignored)
        self._find = names.getObject
        self._scripts = host.context.scripts

    @functools.cached_property
    def _own(self) -> Attachment:
        """This script; a client outside has none where nobody flies. Raises ValueError."""
        return self._scripts.attached_to(self._host.own_script)

    def _script(self, handle: int) -> Attachment:
        if handle == _SELF:
            return self._own
        if handle == _MAIN:
            raise ValueError("the simulation is its own main script, which has neither parameters nor functions")
        if not isinstance(handle, (int, float)):
            raise WrongValue("expected the handle of a script")
        number = int(handle)
        one = self._objects.get(number)
        return self._script_of(number) if one is not None and one.kind == "script" else self._scripts[number]

    def _script_of(self, handle: int) -> Attachment:
        """Return the script of an object. Raises ValueError where it has none."""
        if handle == _SELF:
            return self._own
        return self._on_object(handle) or self._scripts.attached_to(self._objects[handle].name)

    def _on_object(self, handle: int) -> Attachment | None:
        """Return the script that is on an object, or that a script object is; None for none."""
        one = self._objects[handle]
        there = (each for each in (one, one.parent if one.kind == "script" else None) if each is not None)
        return next((self._scripts.attached_to(each.name) for each in there if each.name in self._scripts), None)


class ScriptFunctions(_OnScripts):
    """The simulation parameters of scripts, and the log."""

    # ---- scripts

    @sim("345")
    def getScriptHandle(self, name: Name | None = None) -> int:
        """Return the handle of the script that is attached to an object; without a name, of this script."""
        if name is None or name == _SELF:
            return self._own.handle
        try:
            handle = self._find(name)
        except ValueError:
            return self._scripts.attached_to(name).handle
        return self._script_of(handle).handle

    @sim("345")
    def getObjectAssociatedWithScript(self, script: Handle) -> int:
        """Return the handle of the object that a script is attached to."""
        return self._objects.handle(self._script(script).name)

    @sim("345")
    def getScriptSimulationParameter(self, script: Handle, name: Name, _as_string: bool = False) -> Any:
        """Return a simulation parameter of a script; for sim.handle_tree, _chain or _all, of the first with it."""
        several = self._several(script)
        found = next((one for one in several if name in one.parameters), None)
        found = found or (several or [self._script(script)])[0]
        if name not in found.parameters:
            raise ValueError(f"there is no script parameter '{name}'; {near_names(name, found.parameters)}")
        self._scripts.ask(found, name)
        value = found.parameters[name]
        return list(value) if isinstance(value, (list, tuple)) else value

    @sim("345")
    def setScriptSimulationParameter(self, script: Handle, name: Name, value: Any) -> None:
        """Set a simulation parameter of a script: `particleVelocity` (m/s) drives a propeller.

        With sim.handle_tree it is set in this script and those below, with sim.handle_chain in this one and those
        above, with sim.handle_all in every one. A name that a propeller's law does not have is refused where it comes
        near to one that it has; of any other the log says once that nothing reads it.
        """
        found = self._scripts.get(script)
        if found and found is not self._own and name in found.parameters and type(value) is float and isfinite(value):
            found.parameters[name] = value  # of a propeller: often, so at once
            return
        several = self._several(script)
        scripts = several or [self._script(script)]
        if several or name not in scripts[0].parameters:
            self._check_name(scripts, name)
        for one in scripts:
            _set(one.parameters, name, value)
            if one is self._own:  # a default
                self._scripts.ask(one, name)

    @sim("45")
    def getUserParameter(self, handle: Handle, name: Name, _options: Any = None) -> Any:
        """Return a simulation parameter of the script that is attached to an object (4.x)."""
        return self.getScriptSimulationParameter(self._script_of(handle).handle, name)

    @sim("45")
    def setUserParameter(self, handle: Handle, name: Name, value: Any) -> None:
        """Set a simulation parameter of the script that is attached to an object (4.x)."""
        self.setScriptSimulationParameter(self._script_of(handle).handle, name, value)

    def _several(self, handle: int) -> list[Attachment]:
        """Return the scripts that a special handle stands for, this one first, as there are; none for any other."""
        own = self._object(self._own)
        belongs: dict[int, Callable[[SceneObject], bool]] = {
            _TREE: lambda one: one.is_part_of(own),
            _CHAIN: own.is_part_of,
            _ALL: lambda _: True,
        }
        meant = belongs.get(handle)
        found = [one for one in self._scripts if meant is not None and meant(self._object(one))]
        return sorted(found, key=lambda one: one is not self._own)

    def _object(self, script: Attachment) -> SceneObject:
        return self._objects[self._objects.handle(script.name)]

    def _check_name(self, scripts: Collection[Attachment], name: Any) -> None:
        """Raise ValueError for a misspelt parameter of a propeller; log a parameter that nothing reads."""
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

    # ---- log

    @sim("345")
    def addStatusbarMessage(self, message: Any) -> None:
        """Write a line to the log."""
        say(message)

    @sim("45")
    def addLog(self, verbosity: int, message: Any) -> None:
        """Write a line to the log: an error, a warning or information, by its verbosity."""
        say(message, _LEVELS.get(verbosity, logging.INFO))


def _set(parameters: ScriptParameters, name: Any, value: Any) -> None:
    """Keep a value; raises WrongValue, ValueError."""
    value = _stored(value, parameters.get(name))
    refuse_if_too_large([name, value])
    if name not in parameters and len(parameters) >= _MOST:
        raise ValueError(f"a script may have at most {_MOST} parameters")
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
            raise WrongValue("expected a finite number")
    elif type(before) is float or type(before) is int:
        raise WrongValue("expected a number")
    return value


def _from_text(text: str) -> Any:
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text


class ScriptCalls(_OnScripts):
    """Calls from one script to another."""

    @sim("5")
    def getScript(self, scriptType: int, object: Handle | Name = _SELF, _name: Name = "") -> int:
        """Return the handle of the script that is attached to an object, by its handle or path; -1 for none (4.x)."""
        found = self._attached(object) if scriptType == _CHILD else None
        return _NONE if found is None else found.handle

    @sim("345")
    def getScriptAssociatedWithObject(self, object: Handle) -> int:
        """Return the handle of the script that is attached to an object, -1 for none (3.x)."""
        return self.getScript(_CHILD, object)

    @sim("345")
    def getCustomizationScriptAssociatedWithObject(self, object: Handle) -> int:
        """Return -1: no object has a customization script."""
        self._objects[object]
        return _NONE

    @sim("345")
    def getScriptName(self, script: Handle) -> str:
        """Return the name of the object that a script is attached to."""
        return self._script(script).name

    @sim("345")
    def getScriptExecutionCount(self) -> int:
        """Return the number of steps in which this script was called before: 0 in the first step (3.0)."""
        return round((self._context.clock.script_time - self._own.began) / self._context.clock.time_step)

    @sim("345")
    def callScriptFunction(self, function: Name, script: Handle, *arguments: Any) -> Any:
        """Call 'function@object', or 'function' of the script with a handle; return what it returns.

        Behind 'function@object' stands the type of the script, such as sim.scripttype_childscript.
        """
        if not isinstance(function, str):
            raise WrongValue("expected the name of a function")
        name, at, of = function.partition("@")
        callee = self._of_type(self._find(of), script) if at else self._script(script)
        values = list(arguments)
        refuse_if_too_large(values)
        self._scripts.permit(self._own, callee, name)
        return self._call(callee, lambda one: one.call_function(name, values), lambda one: one.call_own(name, values))

    @sim("345")
    def executeScriptString(self, stringToExecute: Any, scriptHandle: Any = _SELF) -> tuple[Any, ...]:
        """Run a text in another script, in its language and with its globals; return 0 and the text's value.

        That is its value where it is an expression, and an empty table where nothing is returned. In 3.x and 4.2 it is
        'text@object' and a sim.scripttype_...; since 4.9 the script's handle comes first. A text is run in a Python
        script for Python scripts alone.
        """
        text, script = (stringToExecute, scriptHandle)
        if not isinstance(text, str):
            text, script = script, text
        if not isinstance(text, str):
            raise WrongValue("expected a string and the handle of a script")
        refuse_if_too_large([text])
        callee, text = self._executing(text, script)
        self._scripts.permit(self._own, callee, "")
        found = self._call(callee, lambda one: one.execute(text), lambda one: one.execute_own(text))
        if found is None:
            return 0, []
        return (0, *found) if isinstance(found, tuple) else (0, found)

    def _executing(self, text: str, script: Any) -> tuple[Attachment, str]:
        """Return the script in which a text is to be run, and the text alone."""
        code, at, of = text.rpartition("@")
        language = of if at and of in ("lua", "python") else ""
        if language:
            callee, text = self._script(script), code
        elif at and script in _TYPES:
            callee, text = self._of_type(self._find(of), script), code
        elif script in _TYPES_OF_NONE:
            raise ValueError("every script belongs to an object: name one, as 'text@object', or by its handle")
        else:
            callee, text = self._script(script), text if of else code or text
        known = callee.script.language if callee.script is not None else ""
        if language and known and language != known:
            raise ValueError(f"the script of '{callee.name}' is in {known.capitalize()}, not {language.capitalize()}")
        if known == "python" and not self._is_python:
            raise ValueError(
                f"the script of '{callee.name}' is in Python: only Python scripts may execute a string in it"
            )
        return callee, text

    @property
    def _is_python(self) -> bool:
        """Whether who asks is a Python script, which may do in Python what it likes in any case."""
        own = self._own.script if self._scripts.are_own else None
        return own is not None and own.language == "python"

    def _call(self, callee: Attachment, call: Callable[[Script], Any], call_own: Callable[[Script], Any]) -> Any:
        """Call another script, or on its own time this one. Raises ValueError."""
        try:
            if self._scripts.is_own(self._own, callee):
                return self._scripts.call(self._own, callee, call_own)
            return self._surroundings.inside(lambda: self._scripts.call(self._own, callee, call))
        except ScriptError as error:
            raise ValueError(str(error)) from None

    def _of_type(self, handle: int, kind: int) -> Attachment:
        """Return the script of a type on an object. Raises ValueError."""
        if kind == _CUSTOMIZATION:
            name = self._objects[handle].name
            raise ValueError(f"no customization script is attached to '{name}': V-REP's are not imported")
        return self._script_of(handle)

    @sim("5")
    def getScriptFunctions(self, script: Handle) -> Any:
        """Return an object that calls a script's functions: `it:name(...)` in Lua, `it.name(...)` in Python."""
        return FunctionsOfScript(self.callScriptFunction, self._script(script).handle)

    def _attached(self, object: Handle | Name) -> Attachment | None:
        if object == _SELF:
            return self._own
        return self._on_object(self._find(object) if isinstance(object, str) else object)


class FunctionsOfScript:
    """The functions of a script, as attributes."""

    def __init__(self, call: Callable[..., Any], script: int):
        """`call` is callScriptFunction, `script` a handle."""
        self._call, self._script = call, script

    def __getattr__(self, name: str) -> Any:
        """Return what calls a function of the script."""
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments: self._call(name, self._script, *arguments)


def handle_of(functions: FunctionsOfScript) -> int:
    """Return the handle of the script; it is no attribute, because the script's functions may have any name."""
    handle: int = vars(functions)["_script"]
    return handle
