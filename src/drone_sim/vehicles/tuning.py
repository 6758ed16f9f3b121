"""What is changed of a vehicle while it flies: gains, limits, noise, cameras, weather, faults, script parameters."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from drone_sim.config.changing import changed
from drone_sim.config.leaves import Leaf
from drone_sim.config.types import ParameterError
from drone_sim.forces.weather import WeatherParameters
from drone_sim.vehicles.parameters import EquipmentParameters
from drone_sim.vehicles.tunable import CONTROL, LONGEST, SCRIPT, nested, tunables, value_at
from drone_sim.vehicles.tuning_message import TOPIC, message_of
from drone_sim.wording import near_names, shown

if TYPE_CHECKING:
    from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)
_CONDITIONS = ("weather", "faults")  # of a flight: the next one begins with its own
_HEIGHT = "takeoff_height"  # which scripts read, too
_TEXT = f"a text of at most {LONGEST} characters"
_WORDS = {float: "a finite number", int: "a whole number", bool: "true or false", str: _TEXT}


class TunedParameters(EquipmentParameters):
    """A vehicle and the weather around it: what is changed at once is checked at once."""

    weather: WeatherParameters


class _Checked(NamedTuple):
    changes: Mapping[str, Any]  # as YAML has them
    parameters: TunedParameters


class Tuning:
    """What may be changed of one vehicle, and what has been."""

    def __init__(self, vehicle: Vehicle):
        """Take the vehicle, of which nothing has been changed."""
        self._vehicle = vehicle
        self.chosen: dict[str, Any] = {}  # by name: what stays so through every start

    @property
    def known(self) -> dict[str, Leaf]:
        """What may be changed now, by name."""
        own = self._vehicle.scripts.attached_to(self._vehicle.own_script)
        declared = {name: value for name, value in own.parameters.items() if name not in own.read}
        return tunables(self._vehicle.parameters, declared)

    def values(self) -> dict[str, Any]:
        """Return what holds now, by name: floats, ints, bools and strs."""
        return {name: self._value(one) for name, one in self.known.items()}

    def _value(self, leaf: Leaf) -> Any:
        vehicle, (first, *rest) = self._vehicle, leaf.location
        if first in (CONTROL, SCRIPT, _HEIGHT):
            found = value_at(vehicle.script_parameters[vehicle.own_script], rest or (first,))
        elif first in _CONDITIONS:
            found = value_at(vehicle.weather if first == "weather" else vehicle.faults.now, rest)
        else:
            found = value_at(vehicle.parameters, leaf.location)
        if found is None:
            return leaf.none if leaf.none is not None else (*leaf.choices, leaf.kind())[0]
        if not _fits(leaf, found):  # a script may have put anything there
            found = value_at(vehicle.parameters, leaf.location)
        return leaf.kind(found)

    # ---- changing

    def check(self, changes: Mapping[str, Any]) -> _Checked:
        """Return what other values, by name, come to. Raises ParameterError for what is not allowed."""
        known = self.known
        for name, value in changes.items():
            if name not in known:
                near = near_names(name[:80], known)
                raise ParameterError(f"parameter {shown(name)}: cannot be changed in flight; {near}")
            if not _fits(known[name], value):
                raise ParameterError(f"parameter {name} = {shown(value)}: must be {_WORDS[known[name].kind]}")
        laid = nested(known, self.values(), changes)
        own = self._vehicle
        present = {key: getattr(own.parameters, key) for key in EquipmentParameters.model_fields}
        present.update(weather=own.weather, faults=own.faults.now)
        try:
            return _Checked(laid, changed(TunedParameters.model_construct(**present), laid))
        except ParameterError as error:
            raise ParameterError(_by_name(str(error), known)) from None

    def change(self, changes: Mapping[str, Any]) -> None:
        """Let other values hold, by name, from the next step on: all of them, or none. Raises ParameterError."""
        now = self.values()
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
            vehicle.change_weather(laid["weather"])
        if "faults" in laid:
            vehicle.change_faults(laid["faults"])
        known = self.known
        self.chosen.update({name: one for name, one in changes.items() if known[name].location[0] not in _CONDITIONS})
        self._tell()

    def _keep(self, laid: Mapping[str, Any], new: TunedParameters) -> None:
        """Keep what scripts read where they read it, and all but the conditions for the next start."""
        vehicle = self._vehicle
        own = vehicle.script_parameters[vehicle.own_script]
        own.update({name: getattr(new.control, name) for name in laid.get(CONTROL, ())})
        own.update({name: new.script_parameters[name] for name in laid.get(SCRIPT, ())})
        own.update({_HEIGHT: new.takeoff_height} if _HEIGHT in laid else {})
        kept = {key: getattr(new, key) for key in laid if key not in _CONDITIONS}
        if SCRIPT in kept:  # what a script declares is not among them
            kept[SCRIPT] = {name: new.script_parameters[name] for name in vehicle.parameters.script_parameters}
        vehicle.parameters = vehicle.parameters.model_copy(update=kept)

    def _tell(self) -> None:
        """Let the scripts know that something is different."""
        self._vehicle.count_change()
        hearing = [bus for bus in self._vehicle.commands.buses if bus.hears(TOPIC)]
        message = message_of(self.values()) if hearing else None
        for bus in hearing:
            bus.post(TOPIC, message)

    # ---- starts and snapshots

    def take_over(self, before: Tuning) -> None:
        """Be tuned as the vehicle was that this one takes the place of; say so where that is not possible."""
        self.chosen = dict(before.chosen)
        known = self.known
        try:
            self.change({name: one for name, one in self.chosen.items() if name in known})
        except ParameterError as error:
            _LOG.warning("%s is not tuned as it was: %s", self._vehicle.name, error)

    def begin(self) -> None:
        """Give the script's parameters the values that files or tuning say: those of its init are only defaults."""
        own = self._vehicle.script_parameters[self._vehicle.own_script]
        own.update(self._vehicle.parameters.script_parameters)
        for name, leaf in self.known.items() if self.chosen else ():
            if name in self.chosen and leaf.location[0] == SCRIPT and _fits(leaf, self.chosen[name]):
                own[str(leaf.location[1])] = self.chosen[name]

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what was changed; commands, cameras, sensors have theirs themselves."""
        parameters, chosen = self._vehicle.parameters, dict(self.chosen)

        def recall() -> None:
            self._vehicle.parameters, self.chosen = parameters, dict(chosen)
            self._vehicle.count_change()

        return recall


def _fits(leaf: Leaf, value: Any) -> bool:
    """Tell whether a value is of the kind that a parameter has."""
    if leaf.kind in (float, int):
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return is_number and (leaf.location[0] != SCRIPT or math.isfinite(value))
    return isinstance(value, leaf.kind) and (not isinstance(value, str) or len(value) <= LONGEST)


def _by_name(said: str, known: Mapping[str, Leaf]) -> str:
    """Return what is wrong with values named as they are tuned."""
    for name, leaf in known.items():
        said = said.replace(f"parameter {'/'.join(map(str, leaf.location))} = ", f"parameter {name} = ")
    return said
