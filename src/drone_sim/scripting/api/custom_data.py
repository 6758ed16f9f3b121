"""`sim`: custom data, that is, strings and tables that scripts store in objects by name, and properties (4.7)."""

from __future__ import annotations

import copy
import struct
from collections.abc import Mapping
from typing import Any

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.path import Path
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.message_text import near_names
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.types import MOST_BYTES, Handle, Name, WrongValue, check_name, refuse_if_too_large, written

_MOST = 10_000  # values of all objects
_SCENE, _APP = CONSTANTS["handle_scene"], CONSTANTS["handle_app"]
_CUSTOM = "customData."
_PATHS = ("PATH", "PATHCTRLPTS")  # tags that CoppeliaSim itself uses
_PROPERTIES = (_CUSTOM, "signal.")
_PROPERTY_KINDS = "Bool Int Float String Buffer Table Vector2 Vector3 Quaternion Pose Color FloatArray IntArray Long"
_GETTERS, _SETTERS = ({f"{verb}{kind}Property": "5" for kind in _PROPERTY_KINDS.split()} for verb in ("get", "set"))


class CustomData:
    """Values by object and name, shared by all scripts."""

    def __init__(self) -> None:
        self.values: dict[tuple[int, str], Any] = {}

    def clear(self) -> None:
        self.values.clear()

    def save_state(self) -> Restore:
        return saved(self, "values", deep=True)

    def set(self, handle: int, name: str, value: Any) -> None:
        """Store a value, or remove it if `value` is None or ''. Raises WrongValue, ValueError."""
        check_name(name, "a value")
        refuse_if_too_large(value)
        if value is None or (isinstance(value, (str, bytes)) and not value):
            self.values.pop((handle, name), None)
            return
        if (handle, name) not in self.values and len(self.values) >= _MOST:
            raise ValueError(f"at most {_MOST} values are allowed: remove some")
        size = sum(len(stored) for stored in self.values.values() if isinstance(stored, (str, bytes)))
        if isinstance(value, (str, bytes)) and size + len(value) > MOST_BYTES:
            raise ValueError(f"all custom data together may have at most {MOST_BYTES} bytes")
        self.values[handle, name] = copy.deepcopy(value)

    def names(self, handle: int) -> list[str]:
        return [name for owner, name in self.values if owner == handle]


class CustomDataFunctions:
    """Custom data: named strings and tables of objects, and properties (4.7)."""

    def __init__(self, objects: ObjectTree, data: CustomData):
        self._objects = objects
        self._data = data

    @sim("345", writeCustomBufferData="5", writeCustomStringData="5")
    def writeCustomDataBlock(self, handle: Handle, tag: Name, data: Any) -> None:
        """Store a string, or a number as text, under a tag of an object, or sim.handle_scene; '' removes it."""
        data = written(data)
        if not isinstance(data, (str, bytes, type(None))):
            raise WrongValue("expected a string")
        self._data.set(self._target(handle), _CUSTOM + tag, data)

    @sim("345", readCustomBufferData="5", readCustomStringData="5")
    def readCustomDataBlock(self, handle: Handle, tag: Name) -> Any:
        """Return the string under a tag; nothing if there is none.

        A path of the scene has its points under PATH, and under PATHCTRLPTS: 7 doubles each.
        """
        value = self._data.values.get((self._target(handle), _CUSTOM + tag))
        if value is not None or tag not in _PATHS:
            return value
        path = self._objects[handle] if handle >= 0 else None
        return struct.pack(f"<{len(path.table)}d", *path.table) if isinstance(path, Path) else None

    @sim("345", readCustomDataTags="5")
    def readCustomDataBlockTags(self, handle: Handle) -> list[str]:
        """Return the tags of an object."""
        names = self._data.names(self._target(handle))
        return [name.removeprefix(_CUSTOM) for name in names if name.startswith(_CUSTOM)]

    @sim("5")
    def writeCustomTableData(self, handle: Handle, tag: Name, data: Any, _options: Any = None) -> None:
        """Store a table under a tag of an object; {} removes it."""
        self._data.set(self._target(handle), _CUSTOM + tag, data or None)

    @sim("5")
    def readCustomTableData(self, handle: Handle, tag: Name, _options: Any = None) -> Any:
        """Return the table under a tag; an empty table if there is none."""
        return copy.deepcopy(self._data.values.get((self._target(handle), _CUSTOM + tag), {}))

    @sim("345")
    def persistentDataWrite(self, tag: Name, data: Any, _options: int = 0) -> None:
        """Store a string under a tag until the simulation stops; '' removes it."""
        self.writeCustomDataBlock(_APP, tag, data)

    @sim("345")
    def persistentDataRead(self, tag: Name) -> Any:
        """Return a string of persistentDataWrite; nothing if there is none."""
        return self.readCustomDataBlock(_APP, tag)

    @sim("345")
    def getPersistentDataTags(self) -> list[str]:
        """Return the tags that persistentDataWrite has used."""
        return self.readCustomDataBlockTags(_APP)

    @sim("5", **_SETTERS)
    def setProperty(self, handle: Handle, name: Name, value: Any, _options: Any = None) -> None:
        """Set a property customData.… or signal.… of an object, or of sim.handle_scene."""
        self._data.set(self._target(handle), _checked_name(name), value)

    @sim("5", **_GETTERS)
    def getProperty(self, handle: Handle, name: Name, options: Mapping[str, Any] | None = None) -> Any:
        """Return a property customData.… or signal.…; nothing for none with the option noError."""
        target = self._target(handle)
        if (target, _checked_name(name)) in self._data.values:
            return copy.deepcopy(self._data.values[target, name])
        if options and options.get("noError"):
            return None
        raise ValueError(f"there is no property '{name}'; {near_names(name, self._data.names(target))}")

    @sim("5")
    def removeProperty(self, handle: Handle, name: Name, _options: Any = None) -> None:
        """Remove a property customData.… or signal.…."""
        self._data.set(self._target(handle), _checked_name(name), None)

    def _target(self, handle: int) -> int:
        if handle not in (_SCENE, _APP):
            self._objects[handle]
        return int(handle)


def _checked_name(name: str) -> str:
    """Return the name of a property. Raises ValueError for a property of CoppeliaSim itself."""
    if not isinstance(name, str):
        raise WrongValue("the name of a property must be a string")
    if not name.startswith(_PROPERTIES):
        raise ValueError(
            f"property '{name:.80}' is not supported: only names that begin with customData. or signal. are"
        )
    return name
