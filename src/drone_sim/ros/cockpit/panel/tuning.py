"""What dynamic_reconfigure servers let change: the speed of the simulation, a vehicle's gains."""

from __future__ import annotations

import ast
import math
import re
import threading
from collections.abc import Mapping
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
_FASTEST = 1000.0  # times real time; as config/drone.yaml has it
_KINDS: dict[str, type] = {"double": float, "int": int, "bool": bool, "str": str}


class VehicleTuning:
    """The parameters of one vehicle, in groups. Messages are taken in any thread."""

    def __init__(self, board: Board):
        """Show on `board`."""
        self._board = board
        self._lock = threading.Lock()
        self._asking = threading.Lock()  # one change after the other
        self._groups: list[Any] = []
        self._fields: dict[str, dict[str, Any]] = {}
        self._vehicle = ""
        self._listening: list[rospy.Subscriber] = []

    def follow(self, vehicle: str) -> None:
        """Show the parameters of a vehicle, '' for none."""
        if vehicle == self._vehicle:
            return
        for one in self._listening:
            one.unregister()
        self._vehicle, self._listening = vehicle, []
        with self._lock:
            self._groups, self._fields = [], {}
        self._board.show("values", {})
        self._show()
        if vehicle:
            self._listening = [
                rospy.Subscriber(f"/{vehicle}/parameter_descriptions", ConfigDescription, self._on_description),
                rospy.Subscriber(f"/{vehicle}/parameter_updates", Config, self._on_values),
            ]

    def _on_description(self, message: ConfigDescription) -> None:
        groups = decode_description(message)["groups"].values()
        with self._lock:
            self._groups = [(one["name"], [_field(field) for field in one["parameters"]]) for one in groups]
            self._fields = {field["name"]: field for _, fields in self._groups for field in fields}
        self._show()

    def _on_values(self, message: Config) -> None:
        values = decode_config(message)
        values.pop("groups", None)
        self._board.show("values", values)

    def _show(self) -> None:
        with self._lock:
            groups = [
                {"group": _TITLES.get(name, name.capitalize()), "fields": fields} for name, fields in self._groups
            ]
        self._board.show("tuning", groups)

    def set(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Set what a browser asks for; return what holds then, and one line. Raises ValueError."""
        field = self._fields[one_of(message, "name", list(self._fields))]
        value, name = _checked(field, message.get("value")), field["name"]
        with self._asking:
            config = reconfigure(f"/{self._vehicle}", name, value)
        self._on_values(config)
        holds = self._board.get("values", {}).get(name)
        if holds != value:
            raise ValueError(f"{name} = {shown(value)}: refused (the log says why); {shown(holds)} stays")
        return {"said": f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}", "value": holds}


def _field(described: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a page needs to draw a field: kind, ends (None for none), words to choose from, unit and hint."""
    hint, choice = described["description"], described.get("edit_method")
    unit = _UNIT.match(hint)
    kind = str(described["type"])
    is_number = kind in ("double", "int")
    ends = [described[end] if is_number and math.isfinite(described[end]) else None for end in ("min", "max")]
    return {
        "name": described["name"],
        "kind": kind,
        "low": ends[0],
        "high": ends[1],
        "words": [str(one["value"]) for one in ast.literal_eval(choice)["enum"]] if choice else [],
        "unit": unit[1].strip() if unit and is_number else "",
        "hint": hint,
    }


def _checked(field: Mapping[str, Any], value: Any) -> Any:
    """Return a value as the field's kind has it. Raises ValueError."""
    name, kind = field["name"], _KINDS[field["kind"]]
    if field["words"]:
        return one_of({name: value}, name, field["words"])
    if kind in (float, int):
        found = number(name, value, field["low"], field["high"])
        if kind is int and found != int(found):
            raise ValueError(f"{name} = {shown(value)}: must be a whole number")
        return kind(found)
    if not isinstance(value, kind):
        raise ValueError(f"{name} = {shown(value)}: must be {'true or false' if kind is bool else 'a string'}")
    return value


class SpeedControl:
    """The real-time factor, whoever sets it."""

    def __init__(self, board: Board, node: str):
        """Show it on `board`; `node` is the simulation's."""
        self._board, self._node = board, node

    def on_set(self, message: Config) -> None:
        """Show the factor in force."""
        factor = decode_config(message).get(_FACTOR)
        if isinstance(factor, float):
            self._board.show("speed", factor)

    def set(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Set what a browser asks for: a factor, 0 for as fast as it can. Raises ValueError."""
        factor = number("speed", message.get("factor"), 0.0, _FASTEST)
        self.on_set(reconfigure(self._node, _FACTOR, factor))
        holds = self._board.get("speed")
        if holds != factor:
            raise ValueError(f"speed = {factor:g}: refused (the log says why); {holds:g} stays")
        return {"said": f"speed: {f'{factor:g} times real time' if factor else 'as fast as it can'}"}


def reconfigure(server: str, name: str, value: Any) -> Config:
    """Ask a server to set a parameter; return what holds then. Raises ValueError where it does not answer."""
    try:
        return rospy.ServiceProxy(f"{server}/set_parameters", Reconfigure)(encode_config({name: value})).config
    except FAILURES as error:
        raise ValueError(f"{name}: {' '.join(str(error).split())}") from None
