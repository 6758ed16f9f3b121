"""Flight plans: YAML files with the scene, script, timeline and criteria of a flight. See docs/grading.md."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, PrivateAttr, TypeAdapter, ValidationError

from drone_sim.config.errors import line_of, problems
from drone_sim.config.types import (
    Checked,
    FileName,
    Finite,
    Label,
    Name,
    ParameterError,
    Switch,
    Within,
    merged,
    named_in,
    one_line,
)
from drone_sim.files import yaml_files
from drone_sim.files.resources import resolve
from drone_sim.grading.criteria import AnyCriterion
from drone_sim.grading.randomization import Randomization, check_objects, randomize
from drone_sim.message_text import near_names, shown
from drone_sim.offline import timeline as timelines
from drone_sim.offline.recording import MAX_ROWS
from drone_sim.offline.timeline import Timeline, TimelineError
from drone_sim.run import parameters as parameters_module
from drone_sim.run.parameters import Parameters
from drone_sim.scene import scene_parameters

MAX_DURATION = 20_000.0  # s
MAX_SEEDS = 1_000_000
MAX_CRITERIA = 200
MAX_ENTRIES = 10_000  # in the timeline
MAX_CALLS = 100
_NOT_CALLABLE = re.compile(r"sysCall_|sim[A-Z]")
_MAX_CACHED = 16  # parameters of different changes in the cache of a plan


class PlanError(ValueError):
    """A plan is wrong; the message is one line with file, line, key, value and what is allowed."""


def _check_config(value: Any) -> Any:
    if isinstance(value, str):
        return TypeAdapter(FileName).validate_python(value)
    if not isinstance(value, dict):
        raise ValueError("must hold keys of config/drone.yaml, or be the name of a file that does")
    return value


_Config = Annotated[Mapping[str, Any] | str, PlainValidator(_check_config)]


def _check_function(name: str) -> str:
    if _NOT_CALLABLE.match(name):
        raise ValueError("must be a function that a script of the scene defines, not a phase or one of the API")
    return name


_Function = Annotated[Name, AfterValidator(_check_function)]


class Plan(Checked):
    """The checked values of a plan's file; `read` creates it. It can be pickled."""

    name: Name
    title: Label = ""
    scene: FileName = ""
    config: _Config = Field(default_factory=dict)
    script: FileName = ""
    vehicle: Label = ""
    duration: Annotated[Finite, Within(1e-3, MAX_DURATION)]  # s
    seeds: Annotated[int, Within(1, MAX_SEEDS)] = 1
    lockstep: Switch = False  # a live flight waits in each step for the nodes that fly
    spread: Randomization = Randomization()
    timeline: Annotated[list[Any], Field(max_length=MAX_ENTRIES)] = Field(default_factory=list)
    # What a submission may do, see `rules` and `permissions`; the functions of the scene's scripts that it may call;
    # and whether it may read all objects, or only those of its own vehicle.
    allowed: Annotated[list[Literal["move", "push", "change"]], Field(max_length=3)] = Field(default_factory=list)
    calls: Annotated[list[_Function], Field(max_length=MAX_CALLS)] = Field(default_factory=list)
    reads: Literal["all", "own"] = "all"
    criteria: Annotated[list[AnyCriterion], Field(min_length=1, max_length=MAX_CRITERIA)]

    _path: str = PrivateAttr(default="")
    _cache: dict[str, Parameters] = PrivateAttr(default_factory=dict)  # by the changes

    def model_post_init(self, context: Any) -> None:
        """Check that labels of criteria are unique, and that their times are within the flight."""
        super().model_post_init(context)
        labels: set[str] = set()
        for index, criterion in enumerate(self.criteria):
            here = ("criteria", index)
            if criterion.label in labels:
                raise ParameterError("comes twice: give each its own `name`", (*here, "name"), f"'{criterion.label}'")
            labels.add(criterion.label)
            for key in ("after", "until"):
                time = getattr(criterion, key)
                if time is not None and time > self.duration:
                    raise ParameterError(f"the flight lasts {self.duration:g} s (duration)", (*here, key), f"{time:g}")

    def __getstate__(self) -> dict[Any, Any]:
        """Return the state without the cache of parameters, which are read again."""
        state = super().__getstate__()
        return {**state, "__pydantic_private__": {"_path": self._path, "_cache": {}}}

    @property
    def path(self) -> Path:
        return Path(self._path)

    @property
    def folder(self) -> Path:
        """The folder to which the file names in the plan are relative."""
        return self.path.parent

    @property
    def files(self) -> list[Path]:
        """The files of plan, scene and config. Raises FileNotFoundError for a missing file."""
        inside = self.config if isinstance(self.config, dict) else {"scene_file": "", "config": self.config}
        names = [self.scene or inside.get("scene_file"), inside.get("config")]
        return [self.path, *(resolve(named_in(self.folder, name)) for name in names if isinstance(name, str) and name)]

    def script_of(self, script: str | None) -> str:
        """Return the script to fly: `script`, or the plan's own if that is None; '' is the built-in script."""
        if script is not None:
            return script
        return str(named_in(self.folder, self.script)) if Path(self.script).suffix else self.script

    @property
    def default_script(self) -> str:
        """The plan's script, or that of its config, '' if there is none. Raises ParameterError."""
        return self.script_of(None) or self.parameters().script

    def parameters(self, seed: int = 0, changes: Mapping[str, Any] | None = None) -> Parameters:
        """Return the parameters of a flight; `changes` are keys of config/drone.yaml that override the plan's.

        Raises ParameterError.
        """
        changes = dict(changes or {})
        key = json.dumps(changes, sort_keys=True, default=str)
        if key not in self._cache:  # reads each file only once
            if len(self._cache) >= _MAX_CACHED:
                self._cache.clear()
            self._cache[key] = self._load(changes)
        return randomize(self._cache[key], self.spread, seed)

    def _load(self, changes: Mapping[str, Any]) -> Parameters:
        own: dict[str, Any] = {"scene_file": named_in(self.folder, self.scene)} if self.scene else {}
        if isinstance(self.config, str):
            own["config"] = str(named_in(self.folder, self.config))
        else:
            values = dict(self.config)
            scene_parameters.find_files_beside(self.folder, values)
            for key in ("script", "scene_file", "config"):
                if isinstance(values.get(key), str) and Path(values[key]).suffix:
                    values[key] = named_in(self.folder, values[key])
            own = {**values, **own}
        return parameters_module.load(merged(own, changes))

    def vehicle_of(self, parameters: Parameters) -> str:
        return self.vehicle or parameters.first.name

    def topics_of(self, parameters: Parameters) -> dict[str, str]:
        """Return the full names of the topics that criteria need, by their names in the plan.

        A relative name is below the graded vehicle's.
        """
        own = self.vehicle_of(parameters)
        names = {name for criterion in self.criteria for name in criterion.topics}
        return {name: name if name.startswith("/") else f"/{own}/{name}" for name in sorted(names)}

    def timeline_of(self, parameters: Parameters) -> Timeline:
        """Return the timeline of a flight with these parameters. Raises TimelineError."""
        return timelines.of_rows(self.timeline, parameters, self._path, ("timeline",))


def read(path: str | Path) -> Plan:
    """Return the plan in a YAML file, after checking its scene, config and timeline. Raises PlanError."""
    try:
        values = yaml_files.read(path)
    except yaml_files.YamlError as error:
        raise PlanError(str(error)) from None
    if not isinstance(values, dict):
        raise PlanError(f"{path}: must have `key: value` lines, one of them `criteria`, not {shown(values)}")
    try:
        plan = Plan.model_validate({"name": Path(path).stem, **values})
    except ValidationError as error:
        lines = yaml_files.lines(path)
        placed = [(line_of(lines, problem), problem.text) for problem in problems(error, Plan)]
        raise PlanError(one_line(placed, str(path))) from None
    plan._path = str(Path(path).resolve())
    try:
        parameters = plan.parameters()
        _check_references(plan, parameters)
        plan.timeline_of(parameters)
    except TimelineError as error:
        raise PlanError(str(error)) from None
    except ParameterError as error:
        raise PlanError(_format_parameter_error(error, path)) from None
    return plan


def _check_references(plan: Plan, parameters: Parameters) -> None:
    """Raise ParameterError for an unknown vehicle, object or path, and for more steps than a table can have."""
    steps = plan.duration / parameters.time_step
    if steps > MAX_ROWS:
        reason = f"makes {steps:.0f} steps; at most {MAX_ROWS} are kept"
        raise ParameterError(reason, ("duration",), f"{plan.duration:g}")
    names = [vehicle.name for vehicle in parameters.fleet] or [parameters.first.name]
    if plan.vehicle and plan.vehicle not in names:
        near = near_names(plan.vehicle, names)
        raise ParameterError(f"no such vehicle; {near}", ("vehicle",), shown(plan.vehicle))
    paths = [entry.name for entry in parameters.scene.objects if getattr(entry, "kind", "") in ("path", "curved_path")]
    for index, criterion in enumerate(plan.criteria):
        for name in criterion.path_names:
            if name not in paths and "/" not in name:
                near = near_names(name, paths) if paths else "the scene has none"
                raise ParameterError(f"no such path; {near}", ("criteria", index, "along"), shown(name))
    check_objects(parameters, plan.spread)


def _format_parameter_error(error: ParameterError, path: str | Path) -> str:
    """Return the message of an error with the plan's file, and the line of the wrong key if it is in that file."""
    lines = yaml_files.lines(path)
    for own in (error, error.below("config")):  # an error of a key under `config` does not name `config`
        depth, line = lines.find(own.location)
        if error.location and depth == len(own.location):
            return f"{path}: line {line}: {own.text}"
    return f"{path}: {error.text}"
