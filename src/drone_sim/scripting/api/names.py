"""`sim`: objects by their names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from drone_sim.mechanics.object_names import NO_SUFFIX, split
from drone_sim.scripting.api import object_paths
from drone_sim.scripting.api.calls import Function, numbers
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.types import Handle, Name


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
        """Return the handle of an object by path or name; -1 for none with the option noError."""
        try:
            return object_paths.find(self._objects, path, self._own, self._suffix)
        except ValueError:
            if options and options.get("noError"):
                return -1
            raise

    def getObjectHandle(self, path: Name, options: Mapping[str, Any] | None = None) -> int:
        """Return the handle of an object by name (3.x) or path."""
        return self.getObject(path, options)

    def getObjectName(self, handle: Handle) -> str:
        """Return the 3.x name of an object, with its suffix."""
        return self._objects[handle].name

    def getObjectAlias(self, handle: Handle, options: int = -1) -> str:
        """Return the 4.x alias of an object; its path from the root where options is 1 or more."""
        return self._objects.path(handle) if options > 0 else self._objects[handle].alias

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
