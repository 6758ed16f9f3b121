"""`sim`: custom data, strings and tables under a name that scripts leave on objects, and properties (4.7)."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from drone_sim.scripting.api.calls import Function, WrongValue
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.custom_values import CustomData
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.types import Handle, Name
from drone_sim.wording import near_names

_SCENE, _APP = CONSTANTS["handle_scene"], CONSTANTS["handle_app"]
_CUSTOM = "customData."
_PROPERTIES = (_CUSTOM, "signal.")
_PROPERTY_KINDS = (
    *("Bool", "Int", "Float", "String", "Buffer", "Table", "Vector2", "Vector3", "Quaternion", "Pose", "Color"),
    *("FloatArray", "IntArray", "Long"),
)


class CustomDataFunctions:
    """The functions on custom data, and the properties customData.… and signal.…."""

    def __init__(self, host: Host, data: CustomData):
        """Take the drone whose objects they are, and where the values are kept."""
        self._objects = host.objects
        self._data = data

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        found = {name: getattr(self, name) for name in dir(self) if not name.startswith("_") and name != "functions"}
        for kind in _PROPERTY_KINDS:
            found[f"set{kind}Property"] = self.setProperty
            found[f"get{kind}Property"] = self.getProperty
        return found

    def writeCustomDataBlock(self, handle: Handle, tag: Name, data: Any) -> None:
        """Leave a string under a tag on an object, or on sim.handle_scene; '' forgets it."""
        if not isinstance(data, (str, bytes, type(None))):
            raise WrongValue("a string is expected")
        self._data.set(self._target(handle), _CUSTOM + tag, data)

    writeCustomStringData = writeCustomBufferData = writeCustomDataBlock

    def readCustomDataBlock(self, handle: Handle, tag: Name) -> Any:
        """Return the string under a tag; nothing where there is none."""
        return self._data.values.get((self._target(handle), _CUSTOM + tag))

    readCustomStringData = readCustomBufferData = readCustomDataBlock

    def readCustomDataBlockTags(self, handle: Handle) -> list[str]:
        """Return the tags of an object."""
        names = self._data.names(self._target(handle))
        return [name.removeprefix(_CUSTOM) for name in names if name.startswith(_CUSTOM)]

    readCustomDataTags = readCustomDataBlockTags

    def writeCustomTableData(self, handle: Handle, tag: Name, data: Any, _options: Any = None) -> None:
        """Leave a table under a tag on an object; {} forgets it."""
        self._data.set(self._target(handle), _CUSTOM + tag, data or None)

    def readCustomTableData(self, handle: Handle, tag: Name, _options: Any = None) -> Any:
        """Return the table under a tag; an empty one where there is none."""
        return copy.deepcopy(self._data.values.get((self._target(handle), _CUSTOM + tag), {}))

    def persistentDataWrite(self, tag: Name, data: Any, _options: int = 0) -> None:
        """Leave a string under a tag until the simulation stops; '' forgets it."""
        self.writeCustomDataBlock(_APP, tag, data)

    def persistentDataRead(self, tag: Name) -> Any:
        """Return a string that persistentDataWrite left; nothing where there is none."""
        return self.readCustomDataBlock(_APP, tag)

    def getPersistentDataTags(self) -> list[str]:
        """Return the tags that persistentDataWrite left something under."""
        return self.readCustomDataBlockTags(_APP)

    def setProperty(self, handle: Handle, name: Name, value: Any, _options: Any = None) -> None:
        """Set a property customData.… or signal.… of an object, or of sim.handle_scene."""
        self._data.set(self._target(handle), _known(name), value)

    def getProperty(self, handle: Handle, name: Name, options: Mapping[str, Any] | None = None) -> Any:
        """Return a property customData.… or signal.…; nothing for none with the option noError."""
        target = self._target(handle)
        if (target, _known(name)) in self._data.values:
            return copy.deepcopy(self._data.values[target, name])
        if options and options.get("noError"):
            return None
        raise ValueError(f"no property '{name}'; {near_names(name, self._data.names(target))}")

    def removeProperty(self, handle: Handle, name: Name, _options: Any = None) -> None:
        """Forget a property customData.… or signal.…."""
        self._data.set(self._target(handle), _known(name), None)

    def _target(self, handle: int) -> int:
        if handle not in (_SCENE, _APP):
            self._objects[handle]
        return int(handle)


def _known(name: str) -> str:
    """Return the name of a property; raises ValueError for one that CoppeliaSim itself has."""
    if not isinstance(name, str):
        raise WrongValue("the name of a property is a string")
    if not name.startswith(_PROPERTIES):
        raise ValueError(f"no property '{name:.80}' here: those here begin with customData. or signal.")
    return name
