"""What is changed of a vehicle while it flies: gains, limits, noise, cameras, weather, faults, script parameters."""

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
_CONDITIONS = ("weather", "faults")  # of a flight: the next one begins with its own
_HEIGHT = "takeoff_height"  # which scripts read, too
_READ = (CONTROL, _HEIGHT)  # what is of no effect where the script does not read it
_TEXT = f"a string of at most {LONGEST} characters"
_WORDS = {float: "a finite number", int: "a whole number", bool: "true or false", str: _TEXT}


class _Parameter(NamedTuple):
    """dynamic_reconfigure/DoubleParameter and the like."""

    name: str
    value: Any


class Config(NamedTuple):
    """dynamic_reconfigure/Config: what scripts are told of new values, as ROS has it on the same topic."""

    bools: list[_Parameter]
    ints: list[_Parameter]
    strs: list[_Parameter]
    doubles: list[_Parameter]
    groups: list[Any]

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Config:
        """Return the message that says what holds, by name."""

        def those(kind: type) -> list[_Parameter]:
            return [_Parameter(name, value) for name, value in values.items() if type(value) is kind]

        return cls(those(bool), those(int), those(str), those(float), [])


class TunedParameters(EquipmentParameters):
    """A vehicle and the weather around it: values that are changed together are checked together."""

    weather: WeatherParameters


class _Checked(NamedTuple):
    changes: Mapping[str, Any]  # as YAML has them
    parameters: TunedParameters


class Tuning:
    """What may be changed of one vehicle, and what has been."""

    def __init__(self, vehicle: Vehicle, parameters: dict[str, Any]):
        """Take the vehicle, of which nothing has been changed, and the parameters of its child script."""
        self._vehicle = vehicle
        self._parameters = parameters
        self.chosen: dict[str, Any] = {}  # by name: what stays so through every start
        self._initial: dict[str, Any] = {}  # by name: what the script's init has set, or found
        self._read_before: frozenset[str] | None = None  # by the script of the last run; None where there was none

    @property
    def everything(self) -> dict[str, ParameterField]:
        """What may be changed now, by name, whether the script reads it or not."""
        own = self._vehicle.context.scripts.attached_to(self._vehicle.object_name)
        declared = {name: value for name, value in own.parameters.items() if name not in own.read}
        return tunables(self._vehicle.parameters, declared)

    @property
    def known(self) -> dict[str, ParameterField]:
        """What may be changed now, by name, and counts: no gains that the script does not read."""
        read = self._read()
        return {
            name: one
            for name, one in self.everything.items()
            if read is None or one.location[0] not in _READ or str(one.location[one.location[0] == CONTROL]) in read
        }

    def _read(self) -> frozenset[str] | None:
        """Return the parameters that the script reads; until it has flown a step, what the last one did, too."""
        read = frozenset(self._vehicle.context.scripts.attached_to(self._vehicle.object_name).asked)
        if self._vehicle.context.clock.steps:
            return read
        return None if self._read_before is None else read | self._read_before

    def keep_read(self) -> None:
        """Remember what the script reads, which is let go."""
        self._read_before = self._read()

    def values(self) -> dict[str, Any]:
        """Return what holds now, by name: floats, ints, bools and strs."""
        return self._values(self.known)

    def _values(self, known: Mapping[str, ParameterField]) -> dict[str, Any]:
        return {name: self._value(one) for name, one in known.items()}

    def _value(self, leaf: ParameterField) -> Any:
        vehicle, (first, *rest) = self._vehicle, leaf.location
        if first in (CONTROL, SCRIPT, _HEIGHT):
            found = value_at(self._parameters, rest or (first,))
        elif first in _CONDITIONS:
            found = value_at(vehicle.context.weather.now if first == "weather" else vehicle.faults.now, rest)
        else:
            found = value_at(vehicle.parameters, leaf.location)
        if found is None:
            return leaf.none if leaf.none is not None else (*leaf.choices, leaf.kind())[0]
        if not _fits(leaf, found):  # a script may have put anything there
            found = value_at(vehicle.parameters, leaf.location)
        return leaf.kind(found)

    # ---- changing

    def check(self, changes: Mapping[str, Any]) -> _Checked:
        """Return new values, given by name, checked and as YAML has them. Raises ParameterError for invalid ones."""
        known = self.everything
        for name, value in changes.items():
            if name not in known:
                near = near_names(name[:80], known)
                raise ParameterError(f"cannot be changed in flight; {near}", (shown(name),))
            if not _fits(known[name], value):
                raise ParameterError(f"must be {_WORDS[known[name].kind]}", (name,), shown(value))
        laid = nested(known, self._values(known), changes)
        own = self._vehicle
        present = {key: getattr(own.parameters, key) for key in EquipmentParameters.model_fields}
        present.update(weather=own.context.weather.now, faults=own.faults.now)
        try:
            return _Checked(laid, changed(TunedParameters.model_construct(**present), laid))
        except ParameterError as error:
            raise ParameterError.of([_by_name(one, known) for one in error.problems]) from None

    def change(self, changes: Mapping[str, Any]) -> None:
        """Let other values hold, by name, from the next step on: all of them, or none. Raises ParameterError."""
        now = self._values(self.everything)
        changes = {name: value for name, value in changes.items() if name not in now or now[name] != value}
        laid, new = self.check(changes)  # without what holds already: a wind of 0 would bring air
        vehicle = self._vehicle
        self._keep(laid, new)
        vehicle.commands.timeout = new.cmd_vel_timeout
        for name in laid.get("cameras", ()):
            vehicle.cameras[name].change(new.cameras[name])
        for name in laid.get("sensors", ()):
            vehicle.instruments.by_name[name].change_noise(new.sensors[name])
        if "weather" in laid:
            vehicle.context.change_weather(laid["weather"])
        if "faults" in laid:
            vehicle.change_faults(laid["faults"])
        known = self.everything
        self.chosen.update({name: one for name, one in changes.items() if known[name].location[0] not in _CONDITIONS})
        self._tell()

    def _keep(self, laid: Mapping[str, Any], new: TunedParameters) -> None:
        """Store values where scripts read them, and for the next start (except weather and faults)."""
        vehicle = self._vehicle
        own = self._parameters
        own.update({name: getattr(new.control, name) for name in laid.get(CONTROL, ())})
        own.update({name: new.script_parameters[name] for name in laid.get(SCRIPT, ())})
        own.update({_HEIGHT: new.takeoff_height} if _HEIGHT in laid else {})
        kept = {key: getattr(new, key) for key in laid if key not in _CONDITIONS}
        if SCRIPT in kept:  # what a script declares is not among them
            kept[SCRIPT] = {name: new.script_parameters[name] for name in vehicle.parameters.script_parameters}
        vehicle.parameters = vehicle.parameters.model_copy(update=kept)

    def _tell(self) -> None:
        """Let the scripts know that something is different."""
        self._vehicle.context.tunings += 1
        hearing = [bus for bus in self._vehicle.commands.buses if bus.hears(TOPIC)]
        message = Config.of(self.values()) if hearing else None
        for bus in hearing:
            bus.post(TOPIC, message)

    # ---- starts and snapshots

    def take_over(self, before: Tuning) -> None:
        """Take over the tuned values of the vehicle that this one replaces; log if that is not possible."""
        self.chosen, self._initial = dict(before.chosen), dict(before._initial)
        self._read_before = before._read_before
        if not self.chosen:
            return
        known = self.everything
        try:
            self.change({name: one for name, one in self.chosen.items() if name in known})
        except ParameterError as error:
            _LOG.warning("%s lost some of its tuned values: %s", self._vehicle.name, error)

    def begin(self, before: Mapping[str, Any]) -> None:
        """Give the script's parameters the values that files or tuning say: those of its init are only defaults.

        `before` are its parameters before its init. A default that differs from the one at the last start
        has been edited since then, and overrides the tuned value.
        """
        own = self._parameters
        own.update(self._vehicle.parameters.script_parameters)
        for name, leaf in self.everything.items():
            if leaf.location[0] in (CONTROL, SCRIPT) and not leaf.part:
                key = str(leaf.location[1])
                initial = own.get(key)
                if key not in before or before[key] != initial:
                    own[key] = self._begun(name, leaf, initial)
                    self._initial[name] = initial
                elif name not in self.chosen:
                    self._initial[name] = initial

    def _begun(self, name: str, leaf: ParameterField, initial: Any) -> Any:
        """Return the first value of a parameter that the script's init has set."""
        if name in self.chosen and _fits(leaf, self.chosen[name]):
            if self._initial.get(name, initial) == initial:
                return self.chosen[name]
            del self.chosen[name]
            return initial
        from_file = value_at(self._vehicle.parameters, leaf.location)
        return from_file if leaf.location[0] == CONTROL and from_file != default_of(leaf.location) else initial

    def save_state(self) -> Restore:
        """Return a function that brings back what was changed; commands, cameras, sensors have theirs themselves."""
        return in_turn(saved(self._vehicle, "parameters"), saved(self, "chosen"))


def _fits(leaf: ParameterField, value: Any) -> bool:
    """Tell whether a value is of the kind that a parameter has."""
    if leaf.kind in (float, int):
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return is_number and (leaf.location[0] != SCRIPT or math.isfinite(value))
    return isinstance(value, leaf.kind) and (not isinstance(value, str) or len(value) <= LONGEST)


def _by_name(problem: ParameterProblem, known: Mapping[str, ParameterField]) -> ParameterProblem:
    """Return a problem with its location replaced by the name that is used for tuning."""
    names = (name for name, leaf in known.items() if leaf.location == problem.location)
    name = next(names, None)
    return problem if name is None else problem._replace(location=(name,))
