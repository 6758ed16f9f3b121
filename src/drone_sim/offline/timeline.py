"""Timeline: a flight's commands and events in a YAML file.

    - {at: 1.0, twist: {linear: [1, 0, 0], angular: [0, 0, 0]}}            # m/s, rad/s, track frame
    - {at: 5.0, pose: {position: [0, 0, 2], rpy: [0.3, 0, 0]}}             # m, rad; at rest
    - {at: 8.0, push: {force: [1, 0, 0], torque: [0, 0, 0], duration: 0.2}}  # N, N m, world frame; s
    - {at: 9.0, vehicle: drone2, twist: {linear: [0, 1, 0]}}               # default: the first vehicle
    - {at: 10.0, weather: {wind: [3, 0, 0]}}                               # new values of keys of `weather`
    - {at: 11.0, faults: {propellers: [1, 1, 0, 1]}}                       # or `faults`; other keys keep theirs
    - {at: 12.0, land: {}}                                                 # or takeoff, reset, home: docs/states.md
    - {at: 20.0, goto: {position: [1, 0, 2], rpy: [0, 0, 1.57]}}           # m, rad
    - {at: 30.0, object: {name: Ball, position: [1, 0, 2], rpy: [0, 0, 0]}} # of the scene; m, rad, world

`at` is in seconds of simulated time; entries may be in any order. Omitted vectors are zeros.
"""

from __future__ import annotations

import hashlib
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
_DIGEST_LENGTH = 16
_TOLERANCE = 1e-6  # in steps: decimal times are not exact multiples of a binary step


class TimelineError(ValueError):
    """A timeline is invalid; one line with file, entry (from 1), key, value and what is allowed."""


class ScriptRequest(NamedTuple):
    """A request to a vehicle's script: the topic, and a pose if the request has one."""

    topic: str
    pose: Pose | None = None


class ObjectMove(NamedTuple):
    """The pose that an object is moved to (m, rad, world); without angles it keeps its orientation."""

    name: str  # its name in scripts
    position: Vector
    rpy: Vector | None

    def apply(self, objects: ObjectTree) -> None:
        """Move the object with its descendants. Raises ValueError if there is no such object."""
        handle = objects.handle(self.name)
        rpy = to_rpy(objects.matrix(handle)) if self.rpy is None else self.rpy
        objects.set_matrix(handle, WORLD, from_rpy(self.position, rpy))


@dataclass(frozen=True)
class ParameterChange:
    changes: Mapping[str, Any]

    def checked(self, _parameters: EquipmentParameters) -> ParameterChange:
        """Return itself: it was checked when it was read."""
        return self

    def apply(self, vehicle: Vehicle) -> None:
        raise NotImplementedError


class WeatherChange(ParameterChange):
    """New values of `weather`, for all vehicles."""

    def apply(self, vehicle: Vehicle) -> None:
        vehicle.context.change_weather(self.changes)


class FaultsChange(ParameterChange):
    """New values of `faults`, for one vehicle."""

    def apply(self, vehicle: Vehicle) -> None:
        vehicle.change_faults(self.changes)


CHANGES: dict[str, type[ParameterChange]] = {"weather": WeatherChange, "faults": FaultsChange}


class Entry(NamedTuple):
    """A command or event for a vehicle ('' is the first) at `at` seconds of simulated time."""

    at: float
    action: Twist | Pose | Push | ParameterChange | ScriptRequest | ObjectMove
    vehicle: str = ""

    @property
    def end(self) -> float:
        """The time (s) at which a push ends; `at` for other actions."""
        return self.at + (self.action.duration if isinstance(self.action, Push) else 0.0)

    def apply(self, vehicles: Mapping[str, Vehicle]) -> None:
        """Apply the action to the entry's vehicle. Raises TimelineError, as the scene may have changed in flight."""
        vehicle = vehicles.get(self.vehicle) if self.vehicle else next(iter(vehicles.values()), None)
        if vehicle is None:
            raise TimelineError(f"entry at {self.at:g} s: there is no vehicle {self.vehicle}".rstrip())
        try:
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
        except ValueError as error:
            raise TimelineError(f"entry at {self.at:g} s: {error}") from None


class Timeline:
    """Entries by simulation step: the first step that begins at or after their time."""

    def __init__(self, entries: Iterable[Entry], time_step: float):
        """Sort the entries by time, stably; `time_step` in seconds."""
        self.entries = sorted(entries, key=lambda entry: entry.at)
        self._time_step = time_step
        self._due: dict[int, list[Entry]] = {}
        for entry in self.entries:
            self._due.setdefault(first_step(entry.at, time_step), []).append(entry)

    @property
    def end(self) -> float:
        """The time (s) of the last command or the end of the last push; 0 without entries."""
        return max((entry.end for entry in self.entries), default=0.0)

    @property
    def digest(self) -> str:
        """A text that differs between timelines with different entries; '' without entries."""
        return hashlib.sha256(repr(self.entries).encode()).hexdigest()[:_DIGEST_LENGTH] if self.entries else ""

    def of(self, vehicle: str) -> Timeline:
        """Return the entries of a vehicle, including those without a vehicle's name."""
        return Timeline([entry for entry in self.entries if entry.vehicle in ("", vehicle)], self._time_step)

    def apply(self, step: int, vehicles: Mapping[str, Vehicle]) -> None:
        """Apply the entries of a step (counted from 0), just before it runs. Raises TimelineError."""
        for entry in self._due.get(step, ()):
            entry.apply(vehicles)


def first_step(time: float, time_step: float) -> int:
    """Return the number of the first step that begins at or after `time` (s); step k begins at k time_step."""
    return math.ceil(time / time_step - _TOLERANCE)


def read(path: str, parameters: Parameters) -> Timeline:
    """Return the timeline in a YAML file. Raises TimelineError."""
    try:
        rows = yaml_files.read(path)
    except yaml_files.YamlError as error:
        raise TimelineError(str(error)) from None
    return of_rows(rows, parameters, path)


def of_rows(rows: Any, parameters: Parameters, path: str, above: Location = ()) -> Timeline:
    """Return the timeline under the keys `above` in a YAML file. Raises TimelineError."""
    if not isinstance(rows, list):
        key = f"{readable_key(above)}: " if above else ""
        raise TimelineError(f"{path}: {key}must be a list of `- {{at: 1.0, twist: ...}}` entries, not {shown(rows)}")
    entries: list[Entry] = []
    wrong: _Problems = []
    for index, row in enumerate(rows):
        problems: _Problems = []
        entry = _entry(row, parameters, problems)
        if entry is not None:
            entries.append(entry)
        wrong += [((*above, index, *location), f"entry {index + 1}: {text}") for location, text in problems]
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


def _request_model(topic: str) -> type[_Model]:
    class RequestModel(_Model):
        def checked(self, _parameters: EquipmentParameters) -> ScriptRequest:
            return ScriptRequest(topic)

    return RequestModel


class _PushModel(_Model):
    force: _Vector = _ZERO
    torque: _Vector = _ZERO
    duration: Annotated[Finite, Within(1e-4, MAX_TIME)]

    def checked(self, parameters: EquipmentParameters) -> Push:
        return checks.push(self.force, self.torque, parameters)._replace(duration=self.duration)


_KINDS: dict[str, type[Any]] = {
    **{"twist": _TwistModel, "pose": _PoseModel, "push": _PushModel, "goto": _GotoModel, "object": _ObjectModel},
    **{topic: _request_model(topic) for topic, kind in REQUESTS.items() if kind == EMPTY},
}
_ALL_KINDS = (*_KINDS, *CHANGES)


_Problems = list[tuple[Location, str]]  # location of each wrong value, and a text


def _entry(row: Any, parameters: Parameters, wrong: _Problems) -> Entry | None:
    """Return an entry; or None, with its problems added to `wrong`, which must be empty."""
    if not isinstance(row, dict):
        wrong.append(((), f"{shown(row)}: must be a mapping such as {{at: 1.0, twist: ...}}"))
        return None
    known = ("at", "vehicle", *_ALL_KINDS)
    unknown = f"unknown key; known are {', '.join(known)}"
    wrong += [((key,), f"{readable_key((key,))}: {unknown}") for key in row if key not in known]
    kinds = [kind for kind in _ALL_KINDS if kind in row]
    if len(kinds) != 1:
        present = " and ".join(kinds) or "none"
        wrong += [] if wrong else [((), f"must hold one of {', '.join(_ALL_KINDS)}; it holds {present}")]
        return None
    kind = kinds[0]
    at = _checked(_TimeModel, {"at": row["at"]} if "at" in row else {}, (), wrong)
    vehicle = _vehicle(row.get("vehicle", ""), parameters, wrong)
    values = {} if row[kind] is None and REQUESTS.get(kind) == EMPTY else row[kind]
    is_change = kind in CHANGES
    action = (
        _change(kind, values, parameters, vehicle, wrong)
        if is_change
        else _checked(_KINDS[kind], values, (kind,), wrong)
    )
    if wrong:
        return None
    try:
        return Entry(at.at, action.checked(vehicle), row.get("vehicle", ""))
    except checks.Refused as refused:
        wrong.append(((kind, refused.field), f"{kind}.{refused}"))
        return None


def _vehicle(name: Any, parameters: Parameters, wrong: _Problems) -> VehicleParameters:
    """Return the parameters of a vehicle; those of the first one for an unknown name."""
    fleet = {vehicle.name: vehicle for vehicle in parameters.fleet}
    if name != "" and not (isinstance(name, str) and name in fleet):
        wrong.append((("vehicle",), f"vehicle = {shown(name)}: no such vehicle; {near_names(str(name), fleet)}"))
        return parameters.first
    return fleet.get(name, parameters.first)


def _change(kind: str, values: Any, parameters: Parameters, vehicle: VehicleParameters, wrong: _Problems) -> Any:
    """Return the change of an entry's `weather` or `faults`, or None if it is invalid."""
    base: Checked = parameters.weather if kind == "weather" else vehicle.faults
    try:
        new = changed(base, values)
    except ParameterError as error:
        wrong += [(problem.location, problem.text) for problem in error.below(kind).problems]
        return None
    try:
        if kind == "faults":
            vehicle.model_copy(update={"faults": new}).check_faults()
    except ParameterError as error:
        wrong += [(problem.location, problem.text) for problem in error.problems]
    return CHANGES[kind](values)


def _checked(model: type[Any], values: Any, above: Location, wrong: _Problems) -> Any:
    """Return the values as a model, or None if they are invalid."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        wrong += [((*above, *problem["loc"]), _one_line(problem, model, above)) for problem in error.errors()]
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
