"""`sim`: simulation parameters of scripts, the log, and calls between scripts.

Arguments and results of calls are copied: numbers, strings, and tables or lists of them. A script that waits for
another script's result cannot be called meanwhile.
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
from drone_sim.scripting.api.registry import CHILD, CUSTOMIZATION, Attachment, ScriptParameters
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.types import Handle, Name, WrongValue, refuse_if_too_large
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import say

_LOG = logging.getLogger(__name__)  # for messages about scripts, not from scripts

_MOST = 1000  # parameters of one script
_NEAR = 0.8  # least ratio of difflib
_LONGEST = 80  # characters of a name that is compared
_LEVELS = {
    **{CONSTANTS[name]: logging.WARNING for name in ("verbosity_warnings", "verbosity_scriptwarnings")},
    **{CONSTANTS[name]: logging.ERROR for name in ("verbosity_errors", "verbosity_scripterrors")},
}
_SELF, _TREE, _CHAIN, _ALL, _MAIN = (
    CONSTANTS[f"handle_{name}"] for name in ("self", "tree", "chain", "all", "main_script")
)
_TYPES = CHILD, CUSTOMIZATION
_MISSING_TYPES = tuple(CONSTANTS[f"scripttype_{name}"] for name in ("mainscript", "addonscript", "sandboxscript"))
_NONE = -1


class _OnScripts(Functions):
    """Base class of functions on scripts."""

    def __init__(self, names: NameFunctions, host: Host, services: SceneServices, ignored: Ignored):
        """`names` finds objects; the other arguments are those of Functions."""
        super().__init__(host, services, ignored)
        self._find = names.getObject
        self._scripts = host.context.scripts

    @functools.cached_property
    def _own(self) -> Attachment:
        """The script that calls. Raises ValueError for a remote client without a vehicle."""
        return self._scripts.attached_to(self._host.own_script, self._host.script_type)

    def _script(self, handle: int) -> Attachment:
        if handle == _SELF:
            return self._own
        if handle == _MAIN:
            raise ValueError("the simulation is its own main script, which has neither parameters nor functions")
        if not isinstance(handle, (int, float)):
            raise WrongValue("expected the handle of a script")
        number = int(handle)
        item = self._objects.by_handle.get(number)
        return self._script_of(number) if item is not None and item.kind == "script" else self._scripts[number]

    def _script_of(self, handle: int) -> Attachment:
        """Return the script of an object. Raises ValueError if it has none."""
        if handle == _SELF:
            return self._own
        return self._on_object(handle) or self._scripts.attached_to(self._objects[handle].name)

    def _on_object(self, handle: int, kind: int = CHILD) -> Attachment | None:
        """Return the script of an object, or of a script object's parent; None if there is none."""
        item = self._objects[handle]
        owners = (owner for owner in (item, item.parent if item.kind == "script" else None) if owner is not None)
        return next(filter(None, (self._scripts.find(owner.name, kind) for owner in owners)), None)


class ScriptFunctions(_OnScripts):
    """The simulation parameters of scripts, and the log."""

    # ---- scripts

    @sim("345")
    def getScriptHandle(self, name: Name | None = None) -> int:
        """Return the handle of an object's script; without a name, of this script."""
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
        """Return a simulation parameter of a script; for sim.handle_tree, _chain or _all, of the first that has it."""
        several = self._several(script)
        found = next((script for script in several if name in script.parameters), None)
        found = found or (several or [self._script(script)])[0]
        if name not in found.parameters:
            raise ValueError(f"there is no script parameter '{name}'; {near_names(name, found.parameters)}")
        self._scripts.ask(found, name)
        value = found.parameters[name]
        return list(value) if isinstance(value, (list, tuple)) else value

    @sim("345")
    def setScriptSimulationParameter(self, script: Handle, name: Name, value: Any) -> None:
        """Set a simulation parameter of a script: `particleVelocity` (m/s) drives a propeller.

        With sim.handle_tree, it is set in this script and those of descendants; with sim.handle_chain, in this script
        and those of ancestors; with sim.handle_all, in every script. An unknown parameter of a propeller raises an
        error if its name is similar to a known one; otherwise the log says that nothing reads it.
        """
        found = self._scripts.by_handle.get(script)
        if found and found is not self._own and name in found.parameters and type(value) is float and isfinite(value):
            found.parameters[name] = value  # fast, because it is called for each propeller in every step
            return
        several = self._several(script)
        scripts = several or [self._script(script)]
        if several or name not in scripts[0].parameters:
            self._check_name(scripts, name)
        for attachment in scripts:
            _set(attachment.parameters, name, value)
            if attachment is self._own:  # a default value
                self._scripts.ask(attachment, name)

    @sim("45")
    def getUserParameter(self, handle: Handle, name: Name, _options: Any = None) -> Any:
        """Return a simulation parameter of an object's script (4.x)."""
        return self.getScriptSimulationParameter(self._script_of(handle).handle, name)

    @sim("45")
    def setUserParameter(self, handle: Handle, name: Name, value: Any) -> None:
        """Set a simulation parameter of an object's script (4.x)."""
        self.setScriptSimulationParameter(self._script_of(handle).handle, name, value)

    def _several(self, handle: int) -> list[Attachment]:
        """Return the scripts that a special handle means, this script first; none for other handles."""
        own = self._object(self._own)
        belongs: dict[int, Callable[[SceneObject], bool]] = {
            _TREE: lambda item: item.is_part_of(own),
            _CHAIN: own.is_part_of,
            _ALL: lambda _: True,
        }
        is_included = belongs.get(handle)
        found = [script for script in self._scripts if is_included is not None and is_included(self._object(script))]
        return sorted(found, key=lambda script: script is not self._own)

    def _object(self, script: Attachment) -> SceneObject:
        return self._objects[self._objects.handle(script.name)]

    def _check_name(self, scripts: Collection[Attachment], name: Any) -> None:
        """Raise ValueError for a misspelt parameter of a propeller; log any other parameter that nothing reads."""
        of_propellers = self._scripts.law_parameters()
        if list(scripts) == [self._own]:
            if name in of_propellers:
                message = "'%s' is a parameter of the propellers; in the script of %s nothing reads it"
                _LOG.warning(message, name, self._own.name)
            return
        if name in of_propellers or name in self._own.read or not any(script.is_law for script in scripts):
            return
        plain = {known.lower(): known for known in sorted(of_propellers)}
        near = difflib.get_close_matches(str(name)[:_LONGEST].replace("_", "").lower(), plain, cutoff=_NEAR)
        if near:
            known = ", ".join(plain[match] for match in near)
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
    """Store a parameter. Raises WrongValue, ValueError."""
    value = _stored(value, parameters.get(name))
    refuse_if_too_large([name, value])
    if name not in parameters and len(parameters) >= _MOST:
        raise ValueError(f"a script may have at most {_MOST} parameters")
    parameters[name] = value


def _stored(value: Any, before: Any) -> Any:
    """Return a value as V-REP stores it: '5.33' becomes a number, and 'true' becomes True.

    Raises WrongValue if another type would replace a number.
    """
    if isinstance(value, str):
        value = _from_text(value)
    elif isinstance(value, list):
        value = list(value)  # a copy, because the script may change its list
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
    """Calls between scripts."""

    @sim("5")
    def getScript(self, scriptType: int, object: Handle | Name = _SELF, _name: Name = "") -> int:
        """Return the handle of an object's script, by the object's handle or path; -1 for none (4.x)."""
        found = self._attached(object, scriptType) if scriptType in _TYPES else None
        return _NONE if found is None else found.handle

    @sim("345")
    def getScriptAssociatedWithObject(self, object: Handle) -> int:
        """Return the handle of an object's script, -1 for none (3.x)."""
        return self.getScript(CHILD, object)

    @sim("345")
    def getCustomizationScriptAssociatedWithObject(self, object: Handle) -> int:
        """Return the handle of an object's customization script, -1 for none (3.x)."""
        return self.getScript(CUSTOMIZATION, object)

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
        """Call 'function@object', or 'function' of the script with a handle; return its results.

        After 'function@object', the second argument is the type of the script, such as sim.scripttype_childscript.
        """
        if not isinstance(function, str):
            raise WrongValue("expected the name of a function")
        name, at, of = function.partition("@")
        callee = self._of_type(self._find(of), script) if at else self._script(script)
        values = list(arguments)
        refuse_if_too_large(values)
        self._scripts.permit(self._own, callee, name)
        return self._call(
            callee, lambda script: script.call_function(name, values), lambda script: script.call_own(name, values)
        )

    @sim("345")
    def executeScriptString(self, stringToExecute: Any, scriptHandle: Any = _SELF) -> tuple[Any, ...]:
        """Run a text as code of another script, with its globals; return 0 and the text's value.

        This is the value of an expression, or an empty table if nothing is returned. In 3.x and 4.2, the arguments are
        'text@object' and a sim.scripttype_...; since 4.9, the script's handle comes first. Only Python scripts may run
        a text in a Python script.
        """
        text, script = (stringToExecute, scriptHandle)
        if not isinstance(text, str):
            text, script = script, text
        if not isinstance(text, str):
            raise WrongValue("expected a string and the handle of a script")
        refuse_if_too_large([text])
        callee, text = self._executing(text, script)
        self._scripts.permit(self._own, callee, "")
        value = self._call(callee, lambda script: script.execute(text), lambda script: script.execute_own(text))
        if value is None:
            return 0, []
        return (0, *value) if isinstance(value, tuple) else (0, value)

    def _executing(self, text: str, script: Any) -> tuple[Attachment, str]:
        """Return the script that runs the text, and the text without `@object` or `@language`."""
        code, at, of = text.rpartition("@")
        language = of if at and of in ("lua", "python") else ""
        if language:
            callee, text = self._script(script), code
        elif at and script in _TYPES:
            callee, text = self._of_type(self._find(of), script), code
        elif script in _MISSING_TYPES:
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
        """Whether the caller is a Python script, which can run any Python code anyway."""
        own = self._own.script if self._scripts.are_own else None
        return own is not None and own.language == "python"

    def _call(self, callee: Attachment, call: Callable[[Script], Any], call_own: Callable[[Script], Any]) -> Any:
        """Call another script, or this script within its own time limit. Raises ValueError."""
        try:
            if self._scripts.is_own(self._own, callee):
                return self._scripts.call(self._own, callee, call_own)
            return self._services.inside(lambda: self._scripts.call(self._own, callee, call))
        except ScriptError as error:
            raise ValueError(str(error)) from None

    def _of_type(self, handle: int, kind: int) -> Attachment:
        """Return an object's script of a type. Raises ValueError."""
        if kind == CUSTOMIZATION:
            found = self._on_object(handle, kind)
            return found or self._scripts.attached_to(self._objects[handle].name, kind)
        return self._script_of(handle)

    @sim("5")
    def getScriptFunctions(self, script: Handle) -> Any:
        """Return an object for calls of a script's functions: `it:name(...)` in Lua, `it.name(...)` in Python."""
        return FunctionsOfScript(self.callScriptFunction, self._script(script).handle)

    def _attached(self, object: Handle | Name, kind: int) -> Attachment | None:
        if object == _SELF:
            object = self._objects.handle(self._host.own_script)
        return self._on_object(self._find(object) if isinstance(object, str) else object, kind)


class FunctionsOfScript:
    """The functions of a script as attributes."""

    def __init__(self, call: Callable[..., Any], script: int):
        """`call` is callScriptFunction, `script` is a handle."""
        self._call, self._script = call, script

    def __getattr__(self, name: str) -> Any:
        """Return a function that calls the script's function with this name."""
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments: self._call(name, self._script, *arguments)


def handle_of(functions: FunctionsOfScript) -> int:
    """Return the handle of the script; not a method, because the script's functions may have any name."""
    handle: int = vars(functions)["_script"]
    return handle
