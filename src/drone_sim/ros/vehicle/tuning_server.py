"""dynamic_reconfigure for a vehicle: `rosrun dynamic_reconfigure dynparam set /drone Kzref 2`, and rqt_reconfigure.

Of the library only its messages and their encoding are used. Its Server brings what is not allowed silently within the
limits, takes what an earlier node has left on the parameter server, cannot change its description when a script
declares a parameter, and asks the master twice for each of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import rospy
from dynamic_reconfigure.encoding import encode_config, encode_description
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest, ReconfigureResponse

from drone_sim.config.leaves import Leaf
from drone_sim.ros.node.inbox import Inbox
from drone_sim.vehicles.tuning_message import TOPIC
from drone_sim.vehicles.vehicle import Vehicle

_GROUPS, _REST = ("control", "weather", "faults", "cameras", "sensors", "script_parameters"), "limits"
_TYPES = {float: "double", int: "int", bool: "bool", str: "str"}


class TuningServer:
    """`set_parameters`, `parameter_descriptions` and `parameter_updates` in the namespace of a vehicle."""

    def __init__(self, vehicle: Vehicle, inbox: Inbox):
        """Advertise, and say what there is."""
        self._vehicle, self._inbox = vehicle, inbox
        name = self._name = rospy.resolve_name(vehicle.name)
        self._description, self._updates = (
            rospy.Publisher(f"{name}/{topic}", kind, queue_size=1, latch=True)
            for topic, kind in (("parameter_descriptions", ConfigDescription), (TOPIC, Config))
        )
        self._known: dict[str, Leaf] = {}
        self._said: dict[str, Any] = {}
        self._config = Config()
        self.follow(vehicle)
        self._service = rospy.Service(f"{name}/set_parameters", Reconfigure, self._set)

    def follow(self, vehicle: Vehicle) -> None:
        """Be the server of this vehicle from now on; say what has changed since."""
        self._vehicle = vehicle
        known, values = vehicle.tuning.known, vehicle.tuning.values()
        if known != self._known:
            self._known = known
            self._description.publish(encode_description(_described(known, values)))
        if values != self._said:
            self._say(values)

    def _say(self, values: Mapping[str, Any]) -> None:
        self._said = dict(values)
        self._config = encode_config(values)
        self._updates.publish(self._config)

    def close(self) -> None:
        """Advertise no more."""
        for publisher in (self._description, self._updates):
            publisher.unregister()
        self._service.shutdown()

    # ---- changing

    def _set(self, request: ReconfigureRequest) -> ReconfigureResponse:
        """Answer with what holds afterwards: a refusal is in the log, and has no place in the answer."""
        given = request.config
        changes = {one.name: one.value for kind in (given.bools, given.ints, given.strs, given.doubles) for one in kind}
        try:
            self._inbox.ask(lambda: self._change(changes))
        except (ValueError, TimeoutError) as error:
            rospy.logwarn(f"{self._name} refused, nothing is changed: {str(error).removeprefix('parameter ')}")
        return ReconfigureResponse(self._config)

    def _change(self, changes: Mapping[str, Any]) -> str:
        try:
            self._vehicle.tuning.change(changes)
        finally:
            self._say(self._vehicle.tuning.values())  # also what was refused: a slider goes back
        return ""


def _described(known: Mapping[str, Leaf], values: Mapping[str, Any]) -> SimpleNamespace:
    """Return what a module that is generated of a .cfg file holds, as far as the encoding reads it."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for name, one in known.items():
        groups.setdefault(_group(one), []).append(_parameter(name, one))
    whole = {"name": "Default", "type": "", "id": 0, "parent": 0, "parameters": []}
    parts = [
        {"name": group, "type": "", "id": number, "parent": 0, "parameters": parameters, "groups": []}
        for number, (group, parameters) in enumerate(groups.items(), start=1)
    ]
    return SimpleNamespace(
        config_description={**whole, "groups": parts},
        min={name: _bound(one, one.low) for name, one in known.items()},
        max={name: _bound(one, one.high) for name, one in known.items()},
        defaults=dict(values),
    )


def _group(leaf: Leaf) -> str:
    first = str(leaf.location[0])
    return first if first in _GROUPS else _REST


def _bound(leaf: Leaf, bound: Any) -> Any:
    return "" if leaf.kind is str else bound


def _parameter(name: str, leaf: Leaf) -> dict[str, Any]:
    kind = _TYPES[leaf.kind]
    words = [{"name": one, "type": kind, "value": one, "description": ""} for one in leaf.choices]
    choice = str({"enum": words, "enum_description": leaf.said}) if words else ""
    return {"name": name, "type": kind, "level": 0, "description": leaf.said, "edit_method": choice}
