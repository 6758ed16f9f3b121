"""dynamic_reconfigure for a vehicle, or the node: `rosrun dynamic_reconfigure dynparam set /drone Kzref 2`.

Of the library only its messages and their encoding are used. Its Server brings what is not allowed silently within the
limits, takes what an earlier node has left on the parameter server, cannot change its description when a script
declares a parameter, and asks the master twice for each of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, Protocol

import rospy
from dynamic_reconfigure.encoding import encode_config, encode_description
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest, ReconfigureResponse

from drone_sim.config.leaves import Leaf
from drone_sim.ros.node.inbox import Inbox
from drone_sim.vehicles.tuning_message import TOPIC

_GROUPS = ("control", "weather", "faults", "cameras", "sensors", "script_parameters")
_TYPES = {float: "double", int: "int", bool: "bool", str: "str"}


class Tunable(Protocol):
    """Something of which values may be changed while it runs."""

    @property
    def known(self) -> Mapping[str, Leaf]:
        """What may be changed now, by name."""

    def values(self) -> dict[str, Any]:
        """Return what holds now, by name."""

    def change(self, changes: Mapping[str, Any]) -> None:
        """Let other values hold, by name: all, or none. Raises ParameterError."""


class TuningServer:
    """`set_parameters`, `parameter_descriptions` and `parameter_updates` in a namespace."""

    def __init__(self, namespace: str, tuning: Tunable, inbox: Inbox, rest: str = "limits"):
        """Advertise, and say what there is; `rest` is the group of what has none of its own."""
        self._tuning, self._inbox, self._rest = tuning, inbox, rest
        name = self._name = rospy.resolve_name(namespace)
        self._description, self._updates = (
            rospy.Publisher(f"{name}/{topic}", kind, queue_size=1, latch=True)
            for topic, kind in (("parameter_descriptions", ConfigDescription), (TOPIC, Config))
        )
        self._known: dict[str, Leaf] = {}
        self._said: dict[str, Any] = {}
        self._config = Config()
        self.follow(tuning)
        self._service = rospy.Service(f"{name}/set_parameters", Reconfigure, self._set)

    def follow(self, tuning: Tunable) -> None:
        """Be the server of this from now on; say what has changed since."""
        self._tuning = tuning
        known, values = dict(tuning.known), tuning.values()
        if known != self._known:
            self._known = known
            self._description.publish(encode_description(_described(known, values, self._rest)))
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
            self._tuning.change(changes)
        finally:
            self._say(self._tuning.values())  # also what was refused: a slider goes back
        return ""


def _described(known: Mapping[str, Leaf], values: Mapping[str, Any], rest: str) -> SimpleNamespace:
    """Return what a module that is generated of a .cfg file holds, as far as the encoding reads it."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for name, one in known.items():
        groups.setdefault(_group(one) or rest, []).append(_parameter(name, one))
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
    return first if first in _GROUPS else ""


def _bound(leaf: Leaf, bound: Any) -> Any:
    return "" if leaf.kind is str else bound


def _parameter(name: str, leaf: Leaf) -> dict[str, Any]:
    kind = _TYPES[leaf.kind]
    words = [{"name": one, "type": kind, "value": one, "description": ""} for one in leaf.choices]
    choice = str({"enum": words, "enum_description": leaf.said}) if words else ""
    return {"name": name, "type": kind, "level": 0, "description": leaf.said, "edit_method": choice}
