"""Parameters of dynamic_reconfigure servers: the speed of the simulation, and a vehicle's gains."""

from __future__ import annotations

import ast
import math
import re
import threading
from collections.abc import Iterable, Mapping
from typing import Any

import rospy
from dynamic_reconfigure.encoding import decode_config, decode_description, encode_config
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure

from drone_sim.message_text import shown
from drone_sim.ros.cockpit.panel.board import Board, number, one_of
from drone_sim.ros.core.simulator import FAILURES

_TITLES = {"control": "Gains", "script_parameters": "Script parameters"}
_UNIT = re.compile(r"(\(?(?:m|s|rad|N|kg|T|Pa|degrees|Hz|1 per|1)\b[^,;:.]*?)(?:[,;:.]| of | from | after | at |$)")
_FACTOR = "real_time_factor"
_MAX_FACTOR = 1000.0  # as in config/drone.yaml
_KINDS: dict[str, type] = {"double": float, "int": int, "bool": bool, "str": str}


class VehicleTuning:
    """The parameters of one vehicle, in groups. Thread-safe."""

    def __init__(self, board: Board):
        self._board = board
        self._lock = threading.Lock()  # serializes changes
        self._fields: dict[str, dict[str, Any]] = {}
        self._vehicle = ""
        self._subscribers: list[rospy.Subscriber] = []

    def follow(self, vehicle: str) -> None:
        """Show the parameters of a vehicle, '' for none."""
        if vehicle == self._vehicle:
            return
        for subscriber in self._subscribers:
            subscriber.unregister()
        self._vehicle, self._subscribers = vehicle, []
        self._board.show("values", {})
        self._show([])
        if vehicle:
            self._subscribers = [
                rospy.Subscriber(f"/{vehicle}/parameter_descriptions", ConfigDescription, self._on_description),
                rospy.Subscriber(f"/{vehicle}/parameter_updates", Config, self._on_values),
            ]

    def _on_description(self, message: ConfigDescription) -> None:
        self._show(decode_description(message)["groups"].values())

    def _on_values(self, message: Config) -> None:
        values = decode_config(message)
        values.pop("groups", None)
        self._board.show("values", values)

    def _show(self, groups: Iterable[Mapping[str, Any]]) -> None:
        titled = [
            {
                "group": _TITLES.get(group["name"], group["name"].capitalize()),
                "fields": [_field(parameter) for parameter in group["parameters"]],
            }
            for group in groups
        ]
        self._fields = {field["name"]: field for group in titled for field in group["fields"]}
        self._board.show("tuning", titled)

    def set(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Set a parameter as a browser requests; return its new value, and one line. Raises ValueError."""
        field = self._fields[one_of(message, "name", list(self._fields))]
        value, name = _convert(field, message.get("value")), field["name"]
        with self._lock:
            config = reconfigure(f"/{self._vehicle}", name, value)
        self._on_values(config)
        current = self._board.get("values", {}).get(name)
        if current != value:
            raise ValueError(f"{name} = {shown(value)}: refused (the log says why); {shown(current)} stays")
        return {"said": f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}", "value": current}


def _field(description: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the page needs to draw a field: kind, limits (None for none), choices, unit and hint."""
    hint, choice = description["description"], description.get("edit_method")
    unit = _UNIT.match(hint)
    kind = str(description["type"])
    is_number = kind in ("double", "int")
    limits = [description[key] if is_number and math.isfinite(description[key]) else None for key in ("min", "max")]
    return {
        "name": description["name"],
        "kind": kind,
        "low": limits[0],
        "high": limits[1],
        "words": [str(item["value"]) for item in ast.literal_eval(choice)["enum"]] if choice else [],
        "unit": unit[1].strip() if unit and is_number else "",
        "hint": hint,
    }


def _convert(field: Mapping[str, Any], value: Any) -> Any:
    """Return a value with the type of the field. Raises ValueError."""
    name, kind = field["name"], _KINDS[field["kind"]]
    if field["words"]:
        return one_of({name: value}, name, field["words"])
    if kind in (float, int):
        converted = number(name, value, field["low"], field["high"])
        if kind is int and converted != int(converted):
            raise ValueError(f"{name} = {shown(value)}: must be a whole number")
        return kind(converted)
    if not isinstance(value, kind):
        raise ValueError(f"{name} = {shown(value)}: must be {'true or false' if kind is bool else 'a string'}")
    return value


class SpeedControl:
    """The real-time factor of the simulation node."""

    def __init__(self, board: Board, node: str):
        self._board, self._node = board, node

    def on_set(self, message: Config) -> None:
        """Show the present factor."""
        factor = decode_config(message).get(_FACTOR)
        if isinstance(factor, float):
            self._board.show("speed", factor)

    def set(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Set the factor as a browser requests; 0 means as fast as possible. Raises ValueError."""
        factor = number("speed", message.get("factor"), 0.0, _MAX_FACTOR)
        self.on_set(reconfigure(self._node, _FACTOR, factor))
        current = self._board.get("speed")
        if current != factor:
            raise ValueError(f"speed = {factor:g}: refused (the log says why); {current:g} stays")
        return {"said": f"speed: {f'{factor:g} times real time' if factor else 'as fast as it can'}"}


def reconfigure(server: str, name: str, value: Any) -> Config:
    """Set a parameter of a server; return its new parameters. Raises ValueError if the server does not answer."""
    try:
        return rospy.ServiceProxy(f"{server}/set_parameters", Reconfigure)(encode_config({name: value})).config
    except FAILURES as error:
        raise ValueError(f"{name}: {' '.join(str(error).split())}") from None
