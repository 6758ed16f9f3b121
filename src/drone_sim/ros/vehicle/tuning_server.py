"""dynamic_reconfigure for a vehicle, or the node: `rosrun dynamic_reconfigure dynparam set /drone Kzref 2`.

Only the library's messages and their encoding are used. Its Server silently clips values to the limits, takes values
that an earlier node has left on the parameter server, cannot change its description when a script declares a parameter,
and asks the master twice for each parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import rospy
from dynamic_reconfigure.encoding import encode_config, encode_description
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest, ReconfigureResponse

from drone_sim.config.fields import ParameterField
from drone_sim.config.types import ParameterError
from drone_sim.grading.permissions import CHANGE
from drone_sim.hosting.tuning import TOPIC, Tuning
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.validation import intervention
from drone_sim.run.pacing import Pace

_GROUPS = ("control", "weather", "faults", "cameras", "sensors", "script_parameters")
_TYPES = {float: "double", int: "int", bool: "bool", str: "str"}


class TuningServer:
    """`set_parameters`, `parameter_descriptions` and `parameter_updates` in a namespace."""

    def __init__(
        self,
        namespace: str,
        tuning: Tuning | Pace,
        inbox: Inbox,
        rest: str = "limits",
        tuned: Callable[[], None] = lambda: None,
    ):
        """Advertise the parameters of `tuning` in `namespace`; the simulation's thread runs the jobs in `inbox`.

        `rest` is the group of parameters that have no group; `tuned` is called in that thread after a change, before
        the request is answered.
        """
        self._tuning, self._inbox, self._rest, self._tuned = tuning, inbox, rest, tuned
        name = self._name = rospy.resolve_name(namespace)
        self._description, self._updates = (
            rospy.Publisher(f"{name}/{topic}", kind, queue_size=1, latch=True)
            for topic, kind in (("parameter_descriptions", ConfigDescription), (TOPIC, Config))
        )
        self._known: dict[str, ParameterField] = {}
        self._published_values: dict[str, Any] = {}
        self._config = Config()
        self.follow(tuning)
        self._service = rospy.Service(f"{name}/set_parameters", Reconfigure, self._set)

    def follow(self, tuning: Tuning | Pace) -> None:
        """Use this tuning from now on; publish changed values."""
        self._tuning = tuning
        known, values = dict(tuning.known), tuning.values()
        if known != self._known:
            self._known = known
            self._description.publish(encode_description(described(known, values, self._rest)))
        if values != self._published_values:
            self._publish(values)

    def _publish(self, values: Mapping[str, Any]) -> None:
        self._published_values = dict(values)
        self._config = encode_config(values)
        self._updates.publish(self._config)

    def close(self) -> None:
        for publisher in (self._description, self._updates):
            publisher.unregister()
        self._service.shutdown()

    # ---- requests

    def _set(self, request: ReconfigureRequest) -> ReconfigureResponse:
        """Return the values after the change. A refusal is only logged, because the response has no field for it."""
        given = request.config
        lists = given.bools, given.ints, given.strs, given.doubles
        changes = {each.name: each.value for values in lists for each in values}
        change = None
        if changes and isinstance(self._tuning, Tuning):  # the pace changes nothing in the world
            change = intervention(CHANGE, self._name.rpartition("/")[2], f"{self._name}/set_parameters", request)
        try:
            self._inbox.ask(lambda: self._change(changes), change)
        except (ValueError, TimeoutError) as error:
            why = error.text if isinstance(error, ParameterError) else error
            rospy.logwarn(f"{self._name} refused, and nothing was changed: {why}")
        return ReconfigureResponse(self._config)

    def _change(self, changes: Mapping[str, Any]) -> str:
        try:
            self._tuning.change(changes)
        finally:
            self._publish(self._tuning.values())  # also after a refusal, so that a slider goes back
            self._tuned()
        return ""


def described(known: Mapping[str, ParameterField], values: Mapping[str, Any], rest: str = "") -> SimpleNamespace:
    """Return the attributes of a module generated from a .cfg file that the encoding and the library read.

    They are made at run time, because with a .cfg file the package would need a build. `rest` is the group of
    parameters that have no group, '' for none.
    """
    groups: dict[str, list[dict[str, Any]]] = {"": []}
    for name, field in known.items():
        kind, first = _TYPES[field.kind], str(field.location[0])
        words = [{"name": choice, "type": kind, "value": choice, "description": ""} for choice in field.choices]
        edit_method = str({"enum": words, "enum_description": field.description}) if words else ""
        parameter = {"name": name, "type": kind, "level": 0, "description": field.description}
        group = groups.setdefault(first if first in _GROUPS else rest, [])
        group.append({**parameter, "edit_method": edit_method})
    whole = {"name": "Default", "type": "", "id": 0, "parent": 0, "parameters": groups.pop("")}
    parts = [
        {"name": group, "type": "", "id": number, "parent": 0, "parameters": parameters, "groups": []}
        for number, (group, parameters) in enumerate(groups.items(), start=1)
    ]
    return SimpleNamespace(
        config_description={**whole, "groups": parts},
        min={name: "" if field.kind is str else field.low for name, field in known.items()},
        max={name: "" if field.kind is str else field.high for name, field in known.items()},
        defaults=dict(values),
    )
