"""Fields for what dynamic_reconfigure servers let change: the speed of the simulation, a vehicle's gains."""

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

from drone_sim.ros.core.simulator import FAILURES

_FIRST = "control"  # the group that is shown unfolded
_FINEST = 1e-3  # step of a field whose range is wide
_SLIDER = 20.0  # a wider range than so many times the value is no slider's, but a field's
_FACTOR = "real_time_factor"
_FACTORS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)


class VehicleTuning:
    """A folder for each group of parameters. Messages are taken in any thread, and shown in the one of `show`."""

    def __init__(self, gui: Any, say: Callable[[str], None]):
        """Draw into `gui`, without a vehicle; `say` shows a line to the user."""
        self._gui = gui
        self._say = say
        self._place = gui.add_folder("of the vehicle")
        self._lock = threading.Lock()
        self._described: list[Any] | None = None  # what is new: groups of parameters
        self._values: dict[str, Any] = {}
        self._wanted: dict[str, Any] = {}  # values that a browser has asked for, and that are not answered yet
        self._asking = threading.Lock()
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
            values = {name: value for name, value in self._values.items() if name not in self._wanted}
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
        choice = described.get("edit_method")  # none where it is free
        words = [str(one["value"]) for one in ast.literal_eval(choice)["enum"]] if choice else []
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
        with self._lock:
            self._wanted[name] = event.target.value
        threading.Thread(target=self._set, args=(self._vehicle, name), daemon=True).start()

    def _set(self, vehicle: str, name: str) -> None:
        """Set a parameter to what a browser wants, one after the other: of values that came meanwhile the latest."""
        with self._asking:
            with self._lock:
                if name not in self._wanted:
                    return
                value = self._wanted[name]
            config = _reconfigure(f"/{vehicle}", name, value, self._say)
            with self._lock:
                if self._wanted[name] == value:
                    del self._wanted[name]
        if config is None:
            return
        self._on_values(config)
        holds = self._values.get(name)
        refused = f"{name} = {value}: refused (the log says why); {holds} stays"
        self._say(f"{name} = {holds}" if holds == value else refused)


def _reconfigure(server: str, name: str, value: Any, say: Callable[[str], None]) -> Config | None:
    """Ask a server to set a parameter; return what holds then, None where it does not answer, which is said."""
    try:
        return rospy.ServiceProxy(f"{server}/set_parameters", Reconfigure)(encode_config({name: value})).config
    except FAILURES as error:
        say(f"{name}: {' '.join(str(error).split())}")
        return None


def _step(low: float, high: float) -> float:
    """Return the power of ten that is fine enough for a range: nobody can type what lies between two steps."""
    return float(min(_FINEST, 10.0 ** math.floor(math.log10((high - low) / 1000))))


class SpeedControl:
    """A choice of real-time factors, which follows those that others set, and the actual one."""

    def __init__(self, gui: Any, node: str, say: Callable[[str], None]):
        """Draw them into `gui`; `node` is the simulation's, `say` shows a line to the user."""
        self._node, self._say = node, say
        self._lock = threading.Lock()
        self._factors = {_speed_text(one): one for one in _FACTORS}
        words, hint = tuple(self._factors), "The real-time factor"
        self._field = gui.add_dropdown("Speed", words, initial_value=_speed_text(1.0), hint=hint)
        self._field.on_update(self._on_field)
        self._actual = gui.add_text("Actual speed", "", disabled=True, hint="The real-time factor of the last second")

    def show_set(self, message: Config) -> None:
        """Show the factor in force."""
        factor = decode_config(message).get(_FACTOR)
        if not isinstance(factor, float):
            return
        words = _speed_text(factor)
        with self._lock:
            if words not in self._factors:
                self._factors = {**{_speed_text(one): one for one in _FACTORS}, words: factor}
                self._field.options = tuple(self._factors)
            self._field.value = words

    def show_actual(self, factor: str) -> None:
        """Show the factor that diagnostics speak of."""
        try:
            self._actual.value = f"{float(factor):g} times real time"
        except ValueError:
            self._actual.value = ""

    def _on_field(self, event: Any) -> None:
        if event.client is None:  # this node has shown what holds
            return
        factor = self._factors[event.target.value]
        threading.Thread(target=lambda: self._set(factor), daemon=True).start()

    def _set(self, factor: float) -> None:
        config = _reconfigure(self._node, _FACTOR, factor, self._say)
        if config is not None:
            self.show_set(config)
            self._say(f"speed: {_speed_text(factor)}")


def _speed_text(factor: float) -> str:
    """Return what a person calls a real-time factor."""
    if not factor:
        return "as fast as it can"
    return "real time" if factor == 1.0 else f"{factor:g} times real time"
