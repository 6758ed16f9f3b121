"""`sim`: from one script to another.

What is handed over is copied: numbers, strings, and tables or lists of them. A script that waits for another one's
answer cannot be called meanwhile.
"""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.calls import WrongValue
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.names import Names
from drone_sim.scripting.api.registry import Attachment
from drone_sim.scripting.api.script_values import refuse_if_too_large
from drone_sim.scripting.api.types import Handle, Name
from drone_sim.scripting.errors import ScriptError

_SELF, _CHILD, _NONE = CONSTANTS["handle_self"], CONSTANTS["scripttype_childscript"], -1


class ScriptCalls:
    """The functions that find other scripts, and call them."""

    def __init__(self, host: Host, surroundings: Surroundings, names: Names):
        """Take the script's object, the clock, and how a name is understood."""
        self._objects = host.objects
        self._find = names.getObject
        self._scripts = host.scripts
        self._own = host.scripts.attached_to(host.own_script)
        self._inside = surroundings.inside
        self._clock, self._time_step = surroundings.clock, surroundings.time_step

    def getScript(self, scriptType: int, object: Handle | Name = _SELF, _name: Name = "") -> int:
        """Return the handle of the script that is attached to an object, by its handle or path; -1 for none (4.x)."""
        found = self._attached(object) if scriptType == _CHILD else None
        return _NONE if found is None else found.handle

    def getScriptAssociatedWithObject(self, object: Handle) -> int:
        """Return the handle of the script that is attached to an object, -1 for none (3.x)."""
        return self.getScript(_CHILD, object)

    def getCustomizationScriptAssociatedWithObject(self, object: Handle) -> int:
        """Return -1: no object has a customization script."""
        self._objects[object]
        return _NONE

    def getScriptName(self, script: Handle) -> str:
        """Return the name of the object that a script is attached to."""
        return self._script(script).name

    def getScriptExecutionCount(self) -> int:
        """Return in how many steps this script has been called before: 0 in the first one (3.0)."""
        return round((self._clock() - self._own.began) / self._time_step)

    def callScriptFunction(self, function: Name, script: Handle, *arguments: Any) -> Any:
        """Call 'function@object', or 'function' of the script with a handle; return what it returns.

        Behind 'function@object' stands the type of the script, such as sim.scripttype_childscript.
        """
        if not isinstance(function, str):
            raise WrongValue("the name of a function is expected")
        name, at, of = function.partition("@")
        callee = self._script(script) if not at else self._scripts.attached_to(self._objects[self._find(of)].name)
        values = list(arguments)
        refuse_if_too_large(values)
        try:
            return self._inside(
                lambda: self._scripts.call(self._own, callee, lambda one: one.call_function(name, values))
            )
        except ScriptError as error:
            raise ValueError(str(error)) from None

    def getScriptFunctions(self, script: Handle) -> Any:
        """Return what calls a script's functions as its own: `functions:name(...)` in Lua, `functions.name(...)`."""
        return _Functions(self, self._script(script).handle)

    def _script(self, handle: int) -> Attachment:
        return self._own if handle == _SELF else self._scripts[handle]

    def _attached(self, object: Handle | Name) -> Attachment | None:
        if object == _SELF:
            return self._own
        name = self._objects[self._find(object) if isinstance(object, str) else object].name
        return self._scripts.attached_to(name) if name in self._scripts else None


class _Functions:
    """The functions of a script, as attributes."""

    def __init__(self, calls: ScriptCalls, script: int):
        self._calls, self._script = calls, script

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments: self._calls.callScriptFunction(name, self._script, *arguments)
