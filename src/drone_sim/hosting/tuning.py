"""Tuning of a vehicle in flight: gains, limits, noise, cameras, weather, faults, script parameters."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from drone_sim.config.errors import changed
from drone_sim.config.fields import ParameterField, default_of
from drone_sim.config.types import ParameterError, ParameterProblem
from drone_sim.forces.weather import WeatherParameters
from drone_sim.hosting.tunable import CONTROL, LONGEST, SCRIPT, nested, tunables, value_at
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.message_text import near_names, shown
from drone_sim.vehicles.parameters import EquipmentParameters
from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)
TOPIC = "parameter_updates"
_CONDITIONS = ("weather", "faults")  # of a flight; the next flight begins with those of the files
_HEIGHT = "takeoff_height"  # which scripts also read
_READ = (CONTROL, _HEIGHT)  # without effect if the script does not read them
_STRING = f"a string of at most {LONGEST} characters"
_ALLOWED = {float: "a finite number", int: "a whole number", bool: "true or false", str: _STRING}


class _Parameter(NamedTuple):
    """dynamic_reconfigure/DoubleParameter, BoolParameter, IntParameter or StrParameter."""

    name: str
    value: Any


class Config(NamedTuple):
    """dynamic_reconfigure/Config, the message to scripts with new values, as on ROS's parameter_updates topic."""

    bools: list[_Parameter]
    ints: list[_Parameter]
    strs: list[_Parameter]
    doubles: list[_Parameter]
    groups: list[Any]

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Config:
        """Return the message with these values by name."""

        def of_kind(kind: type) -> list[_Parameter]:
            return [_Parameter(name, value) for name, value in values.items() if type(value) is kind]

        return cls(of_kind(bool), of_kind(int), of_kind(str), of_kind(float), [])


class TunedParameters(EquipmentParameters):
    """Parameters of a vehicle and of the weather, so that joint changes are checked together."""

    weather: WeatherParameters


class _ValidChanges(NamedTuple):
    changes: Mapping[str, Any]  # nested, as in YAML
    parameters: TunedParameters


class Tuning:
    """Tunable parameters of one vehicle, and their tuned values."""

    def __init__(self, vehicle: Vehicle, parameters: dict[str, Any]):
        """Begin without tuned values. `parameters`: those of the vehicle's child script."""
        self._vehicle = vehicle
        self._parameters = parameters
        self.chosen: dict[str, Any] = {}  # by name: tuned values, which persist across starts
        self._initial: dict[str, Any] = {}  # by name: values after the script's init
        self._last_read_keys: frozenset[str] | None = None  # in the last run; None if there was none

    @property
    def everything(self) -> dict[str, ParameterField]:
        """The tunable parameters by name, also those that the script does not read."""
        script = self._vehicle.context.scripts.attached_to(self._vehicle.object_name)
        declared = {name: value for name, value in script.parameters.items() if name not in script.read}
        return tunables(self._vehicle.parameters, declared)

    @property
    def known(self) -> dict[str, ParameterField]:
        """The tunable parameters by name, without gains and takeoff height that the script does not read."""
        read = self._read_keys()
        return {
            name: leaf
            for name, leaf in self.everything.items()
            if read is None or leaf.location[0] not in _READ or str(leaf.location[leaf.location[0] == CONTROL]) in read
        }

    def _read_keys(self) -> frozenset[str] | None:
        """Return the parameters that the script reads; before the first step, also those read in the last run."""
        read = frozenset(self._vehicle.context.scripts.attached_to(self._vehicle.object_name).asked)
        if self._vehicle.context.clock.steps:
            return read
        return None if self._last_read_keys is None else read | self._last_read_keys

    def keep_read(self) -> None:
        """Store which parameters the script has read, before it is unloaded."""
        self._last_read_keys = self._read_keys()

    def values(self) -> dict[str, Any]:
        """Return the present values by name: floats, ints, bools and strs."""
        return self._values(self.known)

    def _values(self, known: Mapping[str, ParameterField]) -> dict[str, Any]:
        return {name: self._value(field) for name, field in known.items()}

    def _value(self, leaf: ParameterField) -> Any:
        vehicle, (first, *rest) = self._vehicle, leaf.location
        if first in (CONTROL, SCRIPT, _HEIGHT):
            value = value_at(self._parameters, rest or (first,))
        elif first in _CONDITIONS:
            value = value_at(vehicle.context.weather.now if first == "weather" else vehicle.faults.now, rest)
        else:
            value = value_at(vehicle.parameters, leaf.location)
        if value is None:
            return leaf.none if leaf.none is not None else (*leaf.choices, leaf.kind())[0]
        if not _fits(leaf, value):  # a script may have stored any value
            value = value_at(vehicle.parameters, leaf.location)
        return leaf.kind(value)

    # ---- changing

    def check(self, changes: Mapping[str, Any]) -> _ValidChanges:
        """Return new values, given by name, validated and nested as in YAML. Raises ParameterError."""
        known = self.everything
        for name, value in changes.items():
            if name not in known:
                near = near_names(name[:80], known)
                raise ParameterError(f"cannot be changed in flight; {near}", (shown(name),))
            if not _fits(known[name], value):
                raise ParameterError(f"must be {_ALLOWED[known[name].kind]}", (name,), shown(value))
        tree = nested(known, self._values(known), changes)
        vehicle = self._vehicle
        present = {key: getattr(vehicle.parameters, key) for key in EquipmentParameters.model_fields}
        present.update(weather=vehicle.context.weather.now, faults=vehicle.faults.now)
        try:
            return _ValidChanges(tree, changed(TunedParameters.model_construct(**present), tree))
        except ParameterError as error:
            raise ParameterError.of([_with_tuning_name(problem, known) for problem in error.problems]) from None

    def change(self, changes: Mapping[str, Any]) -> None:
        """Change values by name, from the next step on. Raises ParameterError without a change."""
        present = self._values(self.everything)
        changes = {name: value for name, value in changes.items() if name not in present or present[name] != value}
        tree, new = self.check(changes)  # only what differs: a wind that stays 0 must not add drag
        vehicle = self._vehicle
        self._store(tree, new)
        vehicle.commands.timeout = new.cmd_vel_timeout
        for name in tree.get("cameras", ()):
            vehicle.cameras[name].change(new.cameras[name])
        for name in tree.get("sensors", ()):
            vehicle.instruments.by_name[name].change_noise(new.sensors[name])
        if "weather" in tree:
            vehicle.context.change_weather(tree["weather"])
        if "faults" in tree:
            vehicle.change_faults(tree["faults"])
        known = self.everything
        self.chosen.update({key: value for key, value in changes.items() if known[key].location[0] not in _CONDITIONS})
        self._notify_scripts()

    def _store(self, changes: Mapping[str, Any], new: TunedParameters) -> None:
        """Store values where scripts read them, and for the next start (except weather and faults)."""
        vehicle = self._vehicle
        of_script = self._parameters
        of_script.update({name: getattr(new.control, name) for name in changes.get(CONTROL, ())})
        of_script.update({name: new.script_parameters[name] for name in changes.get(SCRIPT, ())})
        of_script.update({_HEIGHT: new.takeoff_height} if _HEIGHT in changes else {})
        kept = {key: getattr(new, key) for key in changes if key not in _CONDITIONS}
        if SCRIPT in kept:  # without the parameters that the script declares itself
            kept[SCRIPT] = {name: new.script_parameters[name] for name in vehicle.parameters.script_parameters}
        vehicle.parameters = vehicle.parameters.model_copy(update=kept)

    def _notify_scripts(self) -> None:
        """Post the values to the scripts that subscribe to TOPIC."""
        self._vehicle.context.tunings += 1
        subscribed = [bus for bus in self._vehicle.commands.buses if bus.hears(TOPIC)]
        message = Config.of(self.values()) if subscribed else None
        for bus in subscribed:
            bus.post(TOPIC, message)

    # ---- starts and snapshots

    def take_over(self, before: Tuning) -> None:
        """Take over the tuned values of the vehicle that this one replaces; log a warning if they are not valid."""
        self.chosen, self._initial = dict(before.chosen), dict(before._initial)
        self._last_read_keys = before._last_read_keys
        if not self.chosen:
            return
        known = self.everything
        try:
            self.change({name: value for name, value in self.chosen.items() if name in known})
        except ParameterError as error:
            _LOG.warning("%s lost some of its tuned values: %s", self._vehicle.name, error)

    def begin(self, before: Mapping[str, Any]) -> None:
        """Set the script's parameters to the values of files or tuning; those set in its init are only defaults.

        `before` are its parameters before its init. A default that differs from the one at the last start
        has been edited since then, and overrides the tuned value.
        """
        of_script = self._parameters
        of_script.update(self._vehicle.parameters.script_parameters)
        for name, leaf in self.everything.items():
            if leaf.location[0] in (CONTROL, SCRIPT) and not leaf.part:
                key = str(leaf.location[1])
                initial = of_script.get(key)
                if key not in before or before[key] != initial:
                    of_script[key] = self._initial_value(name, leaf, initial)
                    self._initial[name] = initial
                elif name not in self.chosen:
                    self._initial[name] = initial

    def _initial_value(self, name: str, leaf: ParameterField, initial: Any) -> Any:
        """Return the value to begin with of a parameter that the script's init has set."""
        if name in self.chosen and _fits(leaf, self.chosen[name]):
            if self._initial.get(name, initial) == initial:
                return self.chosen[name]
            del self.chosen[name]
            return initial
        from_file = value_at(self._vehicle.parameters, leaf.location)
        return from_file if leaf.location[0] == CONTROL and from_file != default_of(leaf.location) else initial

    def save_state(self) -> Restore:
        """Return a function that restores tuned values; commands, cameras and sensors restore their own."""
        return in_turn(saved(self._vehicle, "parameters"), saved(self, "chosen"))


def _fits(leaf: ParameterField, value: Any) -> bool:
    """Return whether a value has the type of a parameter; strings up to LONGEST, script numbers finite."""
    if leaf.kind in (float, int):
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return is_number and (leaf.location[0] != SCRIPT or math.isfinite(value))
    return isinstance(value, leaf.kind) and (not isinstance(value, str) or len(value) <= LONGEST)


def _with_tuning_name(problem: ParameterProblem, known: Mapping[str, ParameterField]) -> ParameterProblem:
    """Return a problem with its location replaced by the name of the tunable parameter."""
    names = (name for name, leaf in known.items() if leaf.location == problem.location)
    name = next(names, None)
    return problem if name is None else problem._replace(location=(name,))
