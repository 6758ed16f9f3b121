"""Messages of any installed type from plain values: mappings, lists, numbers, texts."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Mapping
from typing import Any

import genpy
import roslib.message
import rospkg

from drone_sim.ros.vehicle.messages import ros_time
from drone_sim.wording import encodable


def message_class(kind: str) -> type[genpy.Message]:
    """Return the class of a message type such as sensor_msgs/Imu; raises ValueError where it is not installed."""
    try:
        found = roslib.message.get_message_class(kind)
    except (ImportError, ValueError):
        found = None
    if found is None:
        raise ValueError(f"message type '{kind}' is not installed{_near_types(kind)}")
    return found


def _near_types(kind: str) -> str:
    package, _, name = kind.partition("/")
    try:
        known = [one for one in dir(importlib.import_module(f"{package}.msg")) if one[0] != "_"]
        near = [f"{package}/{one}" for one in difflib.get_close_matches(name, known)]
    except (ImportError, ValueError):
        near = [f"{one}/{name}" for one in difflib.get_close_matches(package, rospkg.RosPack().list())]
    return f"; near names are {', '.join(near)}" if near else ""


def fill(message: genpy.Message, given: Any, path: str) -> genpy.Message:
    """Set the fields of a message from a mapping, or an object with attributes; what is left out keeps its default.

    `path` names the message where something is wrong. Raises ValueError.
    """
    if isinstance(given, type(message)):
        return given
    types = dict(zip(message.__slots__, message._slot_types))
    if not isinstance(given, Mapping):
        given = {name: getattr(given, name) for name in types if hasattr(given, name)}
    for name, value in given.items():
        if name not in types:
            raise ValueError(f"{path} has no field '{name}'; it has {', '.join(types)}")
        setattr(message, name, _value(types[name], value, f"{path}.{name}"))
    try:
        message._check_types()
    except (genpy.MessageException, genpy.SerializationError) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None
    return message


def _value(kind: str, value: Any, path: str) -> Any:
    if kind in ("time", "duration"):
        made = genpy.Time if kind == "time" else genpy.Duration
        return ros_time(value, made) if isinstance(value, (int, float)) else value
    if "[" in kind:
        element = kind.partition("[")[0]
        if element in ("uint8", "char") and isinstance(value, (bytes, str)):
            return value.encode() if isinstance(value, str) else value
        return [_value(element, one, f"{path}[{index}]") for index, one in enumerate(value)]
    if "/" in kind:
        return fill(message_class(kind)(), value, path)
    if kind.startswith(("int", "uint")) and isinstance(value, float) and value.is_integer():
        return int(value)  # Lua 5.1 has no integers
    return encodable(value) if kind == "string" and isinstance(value, str) else value
