"""`sim`: objects by their names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from drone_sim.mechanics.object_names import NO_SUFFIX, split
from drone_sim.scripting.api import object_paths
from drone_sim.scripting.api.calls import Function, numbers
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.handles import bare
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.types import Handle, Name

_SELF = CONSTANTS["handle_self"]


class Names:
    """The functions on names. A name without a suffix means the copy of the model that the script belongs to."""

    def __init__(self, host: Host):
        """Take the drone that the script flies."""
        self._objects = host.objects
        self._own = host.own_script
        self._suffix = split(self._own)[1]

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        find = (self.getObject, self.getObjectHandle)
        others = (self.getObjectName, self.getObjectAlias, self.getNameSuffix, self.setNameSuffix)
        return {one.__name__: one for one in (*find, *others)}

    def getObject(self, path: Name, options: Mapping[str, Any] | None = None) -> int:
        """Return the handle of an object by path or name; -1 for none with the option noError, or name@silentError.

        The option `index` takes the i-th of several of a path; sim.handle_self is what the script is on.
        """
        if path == _SELF:
            return self._objects.handle(self._own)
        name, options = path, options or {}
        if isinstance(path, str):
            name, _, flag = path.partition("@")  # @alt is for names of 4.x, which are found anyhow
            if options.get("index"):
                name += f"[{int(options['index'])}]"
            if flag == "silentError":
                options = {"noError": True}
        try:
            return object_paths.find(self._objects, name, self._own, self._suffix)
        except ValueError:
            if options.get("noError"):
                return -1
            raise

    def getObjectHandle(self, path: Name, options: Mapping[str, Any] | None = None) -> int:
        """Return the handle of an object by name (3.x) or path."""
        return self.getObject(path, options)

    def getObjectName(self, handle: Handle) -> str:
        """Return the 3.x name of an object, with its suffix; the path where sim.handleflag_altname is added (4.2)."""
        return self._objects.path(bare(handle)) if handle != bare(handle) else self._objects[handle].name

    def getObjectAlias(self, handle: Handle, options: int = -1) -> str:
        """Return the 4.x alias of an object.

        `options`: -1 the alias, 0 with its index ('propeller[1]'), 1, 2 and 5 the path from the root, 3 and 4 with
        its handle ('propeller__42__'; 3: where the alias is not unique).
        """
        alias = self._objects[handle].alias
        if options in (1, 2, 5):
            return self._objects.path(handle)
        if options == 0:
            last = self._objects.path(handle).rpartition("/")[2]
            return last if last.endswith("]") else f"{last}[0]"
        is_shared = sum(self._objects[one].alias == alias for one in self._objects) > 1
        return f"{alias}__{int(handle)}__" if options == 4 or (options == 3 and is_shared) else alias

    def getNameSuffix(self, name: Name | None = None) -> int | tuple[int, str]:
        """Return the suffix in a name such as 'Drone#0', -1 for none, and the name without it.

        Without a name, return the suffix of the script's own objects.
        """
        if name is None:
            return self._suffix
        bare, suffix = split(name)
        return suffix, bare.removesuffix("#")

    def setNameSuffix(self, suffix: int) -> None:
        """Let names without a suffix mean those with this one, -1 for none."""
        self._suffix = max(NO_SUFFIX, int(numbers((suffix,), 1)[0]))

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back the suffix that setNameSuffix has set."""
        kept = self._suffix

        def recall() -> None:
            self._suffix = kept

        return recall
