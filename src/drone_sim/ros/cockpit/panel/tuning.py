"""What may be tuned in flight, as fields in the browser: a vehicle's dynamic_reconfigure server, from outside."""

from __future__ import annotations

import ast
import math
import threading
from collections.abc import Callable
from typing import Any

import rospy
from dynamic_reconfigure.encoding import decode_config, decode_description, encode_config
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure

from drone_sim.ros.cockpit.simulator import FAILURES

_FIRST = "control"  # the group that is shown unfolded
_FINEST = 1e-3  # step of a field whose range is wide
_SLIDER = 20.0  # a wider range than so many times the value is no slider's, but a field's


class Tuning:
    """A folder for each group of parameters. Messages are taken in any thread, and shown in the one of `show`."""

    def __init__(self, gui: Any, say: Callable[[str], None]):
        """Begin without a vehicle; `say` shows a line to the user."""
        self._gui = gui
        self._say = say
        self._place = gui.add_folder("of the vehicle")
        self._lock = threading.Lock()
        self._described: list[Any] | None = None  # what is new: groups of parameters
        self._values: dict[str, Any] = {}
        self._is_news = False  # whether the fields do not show them yet
        self._fields: dict[str, Any] = {}
        self._folders: list[Any] = []
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
            self._described, self._values = [], {}
        if vehicle:
            self._listening = [
                rospy.Subscriber(f"/{vehicle}/parameter_descriptions", ConfigDescription, self._on_description),
                rospy.Subscriber(f"/{vehicle}/parameter_updates", Config, self._on_values),
            ]

    def _on_description(self, message: ConfigDescription) -> None:
        described = decode_description(message)
        with self._lock:
            self._described = list(described["groups"].values())

    def _on_values(self, message: Config) -> None:
        with self._lock:
            self._values, self._is_news = decode_config(message), True

    def show(self) -> None:
        """Show what is new."""
        with self._lock:
            described, self._described = self._described, None
            is_news, self._is_news = self._is_news, False
            values = dict(self._values)
        if described is not None:
            self._build(described, values)
        if not is_news:  # what somebody has just changed is not to be overwritten before it is read
            return
        for name, field in self._fields.items():
            if name in values and field.value != values[name]:
                field.value = values[name]

    def _build(self, groups: list[Any], values: dict[str, Any]) -> None:
        for folder in self._folders:
            folder.remove()
        self._folders, self._fields = [], {}
        with self._place:
            for group in groups:
                folder = self._gui.add_folder(group["name"], expand_by_default=group["name"] == _FIRST)
                self._folders.append(folder)
                with folder:
                    for one in group["parameters"]:
                        self._fields[one["name"]] = self._field(one, values.get(one["name"], one["default"]))

    def _field(self, described: Any, value: Any) -> Any:
        """Return a field for a parameter: a slider where its range is one that a hand can choose from."""
        name, low, high = described["name"], described["min"], described["max"]
        label, hint = name.rpartition("/")[2] if len(name) > 24 else name, described["description"] or name
        words = _choices(described)
        if words:
            field = self._gui.add_dropdown(label, words, initial_value=value, hint=hint)
        elif isinstance(value, bool):
            field = self._gui.add_checkbox(label, value, hint=hint)
        elif isinstance(value, str):
            field = self._gui.add_text(label, value, hint=hint)
        elif high - low <= _SLIDER * max(abs(value), 1.0) and isinstance(value, float):
            step = _step(low, high)
            field = self._gui.add_slider(label, min=low, max=high, step=step, initial_value=value, hint=hint)
        elif isinstance(value, float):
            field = self._gui.add_number(label, value, min=low, max=high, step=_step(low, high), hint=hint)
        else:
            field = self._gui.add_number(label, value, min=low, max=high, hint=hint)
        field.on_update(lambda event: self._on_field(name, event))
        return field

    def _on_field(self, name: str, event: Any) -> None:
        """Set what a browser has changed; the answer brings back what holds."""
        if event.client is None:  # this node has shown what holds
            return
        vehicle, value = self._vehicle, event.target.value
        threading.Thread(target=lambda: self._set(vehicle, name, value), daemon=True).start()

    def _set(self, vehicle: str, name: str, value: Any) -> None:
        try:
            answer = rospy.ServiceProxy(f"/{vehicle}/set_parameters", Reconfigure)(encode_config({name: value}))
        except FAILURES as error:
            self._say(f"{name}: {' '.join(str(error).split())}")
            return
        with self._lock:
            self._values, self._is_news = decode_config(answer.config), True
        holds = self._values.get(name)
        self._say(
            f"{name} = {holds}" if holds == value else f"{name} = {value}: refused (the log says why); {holds} stays"
        )


def _step(low: float, high: float) -> float:
    """Return the power of ten that is fine enough for a range: nobody can type what lies between two steps."""
    return float(min(_FINEST, 10.0 ** math.floor(math.log10((high - low) / 1000))))


def _choices(described: Any) -> list[str]:
    """Return the words that a parameter may be, none where it is free."""
    if not described.get("edit_method"):
        return []
    return [str(one["value"]) for one in ast.literal_eval(described["edit_method"])["enum"]]
