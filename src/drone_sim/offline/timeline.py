"""A flight's commands in a YAML file: what happens to the drone, and when.

    - {at: 1.0, twist: {linear: [1, 0, 0], angular: [0, 0, 0]}}            # m/s, rad/s, track frame
    - {at: 5.0, pose: {position: [0, 0, 2], rpy: [0.3, 0, 0]}}             # m, rad; put there at rest
    - {at: 8.0, push: {force: [1, 0, 0], torque: [0, 0, 0], duration: 0.2}}  # N, N m, world frame; s
    - {at: 9.0, vehicle: drone2, twist: {linear: [0, 1, 0]}}               # of several; the first one otherwise
    - {at: 10.0, weather: {wind: [3, 0, 0]}}                               # other values for keys of `weather`
    - {at: 11.0, faults: {propellers: [1, 1, 0, 1]}}                       # and of `faults`; the others stay
    - {at: 12.0, land: {}}                                                 # or takeoff, reset, home: docs/states.md
    - {at: 20.0, goto: {position: [1, 0, 2], rpy: [0, 0, 1.57]}}           # m, rad
    - {at: 30.0, object: {name: Ball, position: [1, 0, 2], rpy: [0, 0, 0]}} # of the scene; m, rad, world

`at` is in seconds of simulated time, in any order; three numbers that are left out are zeros.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from drone_sim.config.errors import changed
from drone_sim.config.types import (
    Checked,
    Finite,
    Label,
    Location,
    ParameterError,
    Within,
    numeric,
    one_line,
    readable_key,
)
from drone_sim.files import yaml_files
from drone_sim.forces.pushes import Push
from drone_sim.mechanics.frames import Vector, from_rpy, to_quaternion, to_rpy
from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.mechanics.state import Pose, Twist
from drone_sim.message_text import near_names, shown
from drone_sim.run.parameters import Parameters
from drone_sim.vehicles import checks
from drone_sim.vehicles.commands import EMPTY, REQUESTS
from drone_sim.vehicles.parameters import EquipmentParameters, VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

MAX_TIME = 1e6  # s, the longest flight
_ZERO = (0.0, 0.0, 0.0)
_TOLERANCE = 1e-6  # of a step: decimal times are not exact multiples of a binary step


class TimelineError(ValueError):
    """A timeline is wrong; one line that names file, entry (from 1), key, value and what is allowed."""


class ScriptRequest(NamedTuple):
    """What a vehicle's script is asked for: the topic, and a pose where it needs one."""

    topic: str
    pose: Pose | None = None


class ObjectMove(NamedTuple):
    """Where an object is to be (m, rad, world); without angles it stays turned as it is."""

    name: str  # as scripts find it
    position: Vector
    rpy: Vector | None

    def apply(self, objects: ObjectTree) -> None:
        """Put it there, with all that hangs on it. Raises ValueError where there is no such object."""
        handle = objects.handle(self.name)
        rpy = to_rpy(objects.matrix(handle)) if self.rpy is None else self.rpy
        objects.set_matrix(handle, WORLD, from_rpy(self.position, rpy))


@dataclass(frozen=True)
class ParameterChange:
    """Keys of the parameters that become others."""

    changes: Mapping[str, Any]

    def checked(self, _parameters: EquipmentParameters) -> ParameterChange:
        """Return this: it has been checked."""
        return self

    def apply(self, vehicle: Vehicle) -> None:
        """Change them."""
        raise NotImplementedError


class WeatherChange(ParameterChange):
    """Keys of `weather`, for all vehicles."""

    def apply(self, vehicle: Vehicle) -> None:
        """Change the air that it is in."""
        vehicle.context.change_weather(self.changes)


class FaultsChange(ParameterChange):
    """Keys of `faults`, for one vehicle."""

    def apply(self, vehicle: Vehicle) -> None:
        """Change what is wrong with it."""
        vehicle.change_faults(self.changes)


CHANGES: dict[str, type[ParameterChange]] = {"weather": WeatherChange, "faults": FaultsChange}


class Entry(NamedTuple):
    """What happens to a vehicle ('' is the first) at `at` seconds of simulated time."""

    at: float
    action: Twist | Pose | Push | ParameterChange | ScriptRequest | ObjectMove
    vehicle: str = ""

    @property
    def end(self) -> float:
        """The time (s) at which a push is over; of anything else `at`."""
        return self.at + (self.action.duration if isinstance(self.action, Push) else 0.0)

    def apply(self, vehicles: Mapping[str, Vehicle]) -> None:
        """Carry the entry out, on the vehicle among these that it is for."""
        vehicle = vehicles[self.vehicle] if self.vehicle else next(iter(vehicles.values()))
        if isinstance(self.action, Twist):
            vehicle.commands.receive(self.action)
        elif isinstance(self.action, Pose):
            vehicle.body.move(self.action)
        elif isinstance(self.action, Push):
            vehicle.pushes.add(self.action)
        elif isinstance(self.action, ScriptRequest):
            vehicle.ask(*self.action)
        elif isinstance(self.action, ObjectMove):
            self.action.apply(vehicle.context.objects)
        else:
            self.action.apply(vehicle)


class Timeline:
    """Entries by the simulation step whose actuation is the first at or after their time."""

    def __init__(self, entries: Iterable[Entry], time_step: float):
        """Sort the `entries` by time, those of one time in the order given; `time_step` in seconds."""
        self.entries = sorted(entries, key=lambda entry: entry.at)
        self._time_step = time_step
        self._due: dict[int, list[Entry]] = {}
        for entry in self.entries:
            self._due.setdefault(first_step(entry.at, time_step), []).append(entry)

    @property
    def end(self) -> float:
        """The time (s) at which the last command is given and the last push is over; 0 without entries."""
        return max((entry.end for entry in self.entries), default=0.0)

    def of(self, vehicle: str) -> Timeline:
        """Return what happens to one vehicle, which is the first where an entry names none."""
        return Timeline([one for one in self.entries if one.vehicle in ("", vehicle)], self._time_step)

    def is_due(self, step: int) -> bool:
        """Tell whether anything is due in a step."""
        return step in self._due

    def apply(self, step: int, vehicles: Mapping[str, Vehicle]) -> None:
        """Do what is due in a step (counted from 0), just before it runs."""
        for entry in self._due.get(step, ()):
            entry.apply(vehicles)


def first_step(time: float, time_step: float) -> int:
    """Return the number of the first step that begins at or after `time` (s); step k begins at k time_step."""
    return math.ceil(time / time_step - _TOLERANCE)


def read(path: str, parameters: Parameters) -> Timeline:
    """Return the timeline in a YAML file; raises TimelineError."""
    try:
        rows = yaml_files.read(path)
    except yaml_files.YamlError as error:
        raise TimelineError(str(error)) from None
    return of_rows(rows, parameters, path)


def of_rows(rows: Any, parameters: Parameters, path: str, above: Location = ()) -> Timeline:
    """Return the timeline that stands under the keys `above` in a YAML file; raises TimelineError."""
    if not isinstance(rows, list):
        key = f"{readable_key(above)}: " if above else ""
        raise TimelineError(f"{path}: {key}must be a list of `- {{at: 1.0, twist: ...}}` entries, not {shown(rows)}")
    entries: list[Entry] = []
    wrong: _Wrong = []
    for index, row in enumerate(rows):
        found: _Wrong = []
        entry = _entry(row, parameters, found)
        if entry is not None:
            entries.append(entry)
        wrong += [((*above, index, *location), f"entry {index + 1}: {text}") for location, text in found]
    if wrong:
        lines = yaml_files.lines(path)
        raise TimelineError(one_line([(lines.find(location).line, text) for location, text in wrong], path))
    return Timeline(entries, parameters.time_step)


# ---- one entry


def _vector(value: Any) -> Vector:
    try:
        x, y, z = (float(numeric(number)) for number in value)
    except (TypeError, ValueError):
        x = y = z = math.nan
    if isinstance(value, (str, dict)) or not math.isfinite(x + y + z):
        raise ValueError("must be three finite numbers, such as [1, 0, 0]")
    return x, y, z


_Vector = Annotated[Vector, BeforeValidator(_vector)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _TimeModel(_Model):
    at: Annotated[Finite, Within(0, MAX_TIME)]


class _TwistModel(_Model):
    linear: _Vector = _ZERO
    angular: _Vector = _ZERO

    def checked(self, parameters: EquipmentParameters) -> Twist:
        return checks.twist(self.linear, self.angular, parameters)


class _PoseModel(_Model):
    position: _Vector = _ZERO
    rpy: _Vector = _ZERO

    def checked(self, parameters: EquipmentParameters) -> Pose:
        return checks.pose(self.position, to_quaternion(from_rpy(_ZERO, self.rpy)), parameters)


class _ObjectModel(_Model):
    name: Label
    position: _Vector
    rpy: _Vector | None = None

    def checked(self, _parameters: EquipmentParameters) -> ObjectMove:
        return ObjectMove(self.name, self.position, self.rpy)


class _GotoModel(_PoseModel):
    def checked(self, parameters: EquipmentParameters) -> ScriptRequest:  # type: ignore[override]
        return ScriptRequest("goto", super().checked(parameters))


def _asking(topic: str) -> type[_Model]:
    """Return the model of a request that says no more than its name."""

    class Asking(_Model):
        def checked(self, _parameters: EquipmentParameters) -> ScriptRequest:
            return ScriptRequest(topic)

    return Asking


class _PushModel(_Model):
    force: _Vector = _ZERO
    torque: _Vector = _ZERO
    duration: Annotated[Finite, Within(1e-4, MAX_TIME)]

    def checked(self, parameters: EquipmentParameters) -> Push:
        return checks.push(self.force, self.torque, parameters)._replace(duration=self.duration)


_KINDS: dict[str, type[Any]] = {
    **{"twist": _TwistModel, "pose": _PoseModel, "push": _PushModel, "goto": _GotoModel, "object": _ObjectModel},
    **{topic: _asking(topic) for topic, kind in REQUESTS.items() if kind == EMPTY},
}
_ALL_KINDS = (*_KINDS, *CHANGES)


_Wrong = list[tuple[Location, str]]  # the keys on the way to each wrong value, and a text


def _entry(row: Any, parameters: Parameters, wrong: _Wrong) -> Entry | None:
    """Return an entry; or None, with what is wrong with it added to `wrong`, which is empty before."""
    if not isinstance(row, dict):
        wrong.append(((), f"{shown(row)}: must be a mapping such as {{at: 1.0, twist: ...}}"))
        return None
    known = ("at", "vehicle", *_ALL_KINDS)
    unknown = f"unknown key; known are {', '.join(known)}"
    wrong += [((key,), f"{readable_key((key,))}: {unknown}") for key in row if key not in known]
    kinds = [kind for kind in _ALL_KINDS if kind in row]
    if len(kinds) != 1:
        held = " and ".join(kinds) or "none"
        wrong += [] if wrong else [((), f"must hold one of {', '.join(_ALL_KINDS)}; it holds {held}")]
        return None
    kind = kinds[0]
    at = _checked(_TimeModel, {"at": row["at"]} if "at" in row else {}, (), wrong)
    own = _vehicle(row.get("vehicle", ""), parameters, wrong)
    values = {} if row[kind] is None and REQUESTS.get(kind) == EMPTY else row[kind]
    is_change = kind in CHANGES
    action = (
        _change(kind, values, parameters, own, wrong) if is_change else _checked(_KINDS[kind], values, (kind,), wrong)
    )
    if wrong:
        return None
    try:
        return Entry(at.at, action.checked(own), row.get("vehicle", ""))
    except checks.Refused as refused:
        wrong.append(((kind, refused.field), f"{kind}.{refused}"))
        return None


def _vehicle(name: Any, parameters: Parameters, wrong: _Wrong) -> VehicleParameters:
    """Return what is allowed of a vehicle; of the first one for a wrong name."""
    fleet = {one.name: one for one in parameters.fleet}
    if name != "" and not (isinstance(name, str) and name in fleet):
        wrong.append((("vehicle",), f"vehicle = {shown(name)}: no such vehicle; {near_names(str(name), fleet)}"))
        return parameters.first
    return fleet.get(name, parameters.first)


def _change(kind: str, values: Any, parameters: Parameters, vehicle: VehicleParameters, wrong: _Wrong) -> Any:
    """Return the change that an entry's `weather` or `faults` asks for, or None."""
    base: Checked = parameters.weather if kind == "weather" else vehicle.faults
    try:
        new = changed(base, values)
    except ParameterError as error:
        wrong += [(one.location, one.text) for one in error.below(kind).problems]
        return None
    try:
        if kind == "faults":
            vehicle.model_copy(update={"faults": new}).check_faults()
    except ParameterError as error:
        wrong += [(one.location, one.text) for one in error.problems]
    return CHANGES[kind](values)


def _checked(model: type[Any], values: Any, above: Location, wrong: _Wrong) -> Any:
    """Return a model of the values, or None."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        wrong += [((*above, *one["loc"]), _one_line(one, model, above)) for one in error.errors()]
        return None


def _one_line(error: Any, model: type[BaseModel], above: Location) -> str:
    key = readable_key((*above, *error["loc"])).replace("/", ".")
    known = ", ".join(model.model_fields)
    if error["type"] == "extra_forbidden":
        return f"{key}: unknown key; {f'known are {known}' if known else 'it takes none'}"
    if error["type"] == "missing":
        return f"{key}: missing{'; it is a number of seconds' if error['loc'][-1] in ('at', 'duration') else ''}"
    if error["type"] == "model_type":
        return f"{key} = {shown(error['input'])}: must be a mapping of {known or 'nothing'}"
    message = error["msg"].replace("Value error, ", "")
    return f"{key} = {shown(error['input'])}: {message[0].lower()}{message[1:]}"
