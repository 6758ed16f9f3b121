"""A flight plan: a YAML file that says what flies where, what happens, and what counts. See docs/grading.md."""

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
from drone_sim.grading.randomization import Randomization, check_objects, randomized
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
MAX_ENTRIES = 10_000  # of the timeline
MAX_CALLS = 100
_NOT_CALLED = re.compile(r"sysCall_|sim[A-Z]")
_MOST_LOADED = 16  # parameters, each of other changes, that are kept


class PlanError(ValueError):
    """A plan is wrong; one line that names file, line, key, value and what is allowed."""


def _config(value: Any) -> Any:
    if isinstance(value, str):
        return TypeAdapter(FileName).validate_python(value)
    if not isinstance(value, dict):
        raise ValueError("must hold keys of config/drone.yaml, or be the name of a file that does")
    return value


_Config = Annotated[Mapping[str, Any] | str, PlainValidator(_config)]


def _function(name: str) -> str:
    if _NOT_CALLED.match(name):
        raise ValueError("must be a function that a script of the scene defines, not a phase or one of the API")
    return name


_Function = Annotated[Name, AfterValidator(_function)]


class Plan(Checked):
    """What a plan's file says, checked; made by `read`. It can be pickled."""

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
    allowed: Annotated[list[Literal["move", "push", "change"]], Field(max_length=3)] = Field(
        default_factory=list
    )  # see `rules`
    # Functions of the scene's scripts that a submission may call.
    calls: Annotated[list[_Function], Field(max_length=MAX_CALLS)] = Field(default_factory=list)
    reads: Literal["all", "own"] = "all"  # what a submission may ask about: all objects, or its own vehicle's alone
    criteria: Annotated[list[AnyCriterion], Field(min_length=1, max_length=MAX_CRITERIA)]

    _path: str = PrivateAttr(default="")
    _loaded: dict[str, Parameters] = PrivateAttr(default_factory=dict)  # by the changes

    def model_post_init(self, context: Any) -> None:
        """Check the criteria beside each other."""
        super().model_post_init(context)
        taken: set[str] = set()
        for index, one in enumerate(self.criteria):
            here = ("criteria", index)
            if one.called in taken:
                raise ParameterError("comes twice: give each its own `name`", (*here, "name"), f"'{one.called}'")
            taken.add(one.called)
            for key in ("after", "until"):
                time = getattr(one, key)
                if time is not None and time > self.duration:
                    raise ParameterError(f"the flight lasts {self.duration:g} s (duration)", (*here, key), f"{time:g}")

    def __getstate__(self) -> dict[Any, Any]:
        """Return what is pickled: not the parameters, which are read anew."""
        state = super().__getstate__()
        return {**state, "__pydantic_private__": {"_path": self._path, "_loaded": {}}}

    @property
    def path(self) -> Path:
        """The file that it was read from, absolute."""
        return Path(self._path)

    @property
    def folder(self) -> Path:
        """Where the files that it names are looked for."""
        return self.path.parent

    @property
    def of(self) -> float:
        """The most points that a flight can get."""
        return sum(one.points for one in self.criteria)

    @property
    def files(self) -> list[Path]:
        """The files that it is made of: plan, scene, config. Raises FileNotFoundError for one that has gone."""
        inside = self.config if isinstance(self.config, dict) else {"scene_file": "", "config": self.config}
        named = [self.scene or inside.get("scene_file"), inside.get("config")]
        return [self.path, *(resolve(named_in(self.folder, one)) for one in named if isinstance(one, str) and one)]

    def script_of(self, script: str | None) -> str:
        """Return the script that flies where `script` is asked for: None is the plan's own, '' the built-in one."""
        if script is not None:
            return script
        return str(named_in(self.folder, self.script)) if Path(self.script).suffix else self.script

    @property
    def default_script(self) -> str:
        """The script that flies if none is given: the plan's, or its config's, '' for none. Raises ParameterError."""
        return self.script_of(None) or self.parameters().script

    def parameters(
        self, seed: int = 0, script: str | None = None, changes: Mapping[str, Any] | None = None
    ) -> Parameters:
        """Return what a flight begins with; `changes` are keys of config/drone.yaml, laid over the plan's.

        With a `script`, as for `script_of`, it is the one that they name. Raises ParameterError.
        """
        changes = dict(changes or {}) if script is None else {**(changes or {}), "script": self.script_of(script)}
        key = json.dumps(changes, sort_keys=True, default=str)
        if key not in self._loaded:  # files are read once
            if len(self._loaded) >= _MOST_LOADED:
                self._loaded.clear()
            self._loaded[key] = self._load(changes)
        return randomized(self._loaded[key], self.spread, seed)

    def _load(self, changes: Mapping[str, Any]) -> Parameters:
        own: dict[str, Any] = {"scene_file": named_in(self.folder, self.scene)} if self.scene else {}
        if isinstance(self.config, str):
            own["config"] = str(named_in(self.folder, self.config))
        else:
            own = {**_beside(self.folder, self.config), **own}
        return parameters_module.load(merged(own, changes))

    def vehicle_of(self, parameters: Parameters) -> str:
        """Return the name of the vehicle that is graded."""
        return self.vehicle or parameters.first.name

    def topics_of(self, parameters: Parameters) -> dict[str, str]:
        """Return the full names of the topics that criteria ask for; a relative one is the graded vehicle's."""
        own = self.vehicle_of(parameters)
        names = {name for one in self.criteria for name in one.topics}
        return {name: name if name.startswith("/") else f"/{own}/{name}" for name in sorted(names)}

    def timeline_of(self, parameters: Parameters) -> Timeline:
        """Return what happens in a flight with these parameters. Raises TimelineError."""
        return timelines.of_rows(self.timeline, parameters, self._path, ("timeline",))


def _beside(folder: Path, config: Mapping[str, Any]) -> dict[str, Any]:
    """Return a plan's own `config` with the files that it names found beside the plan."""
    values = dict(config)
    scene_parameters.find_files_beside(folder, values)
    for key in ("script", "scene_file", "config"):
        if isinstance(values.get(key), str) and Path(values[key]).suffix:
            values[key] = named_in(folder, values[key])
    return values


def read(path: str | Path) -> Plan:
    """Return the plan in a YAML file, with scene, config and timeline checked. Raises PlanError."""
    try:
        values = yaml_files.read(path)
    except yaml_files.YamlError as error:
        raise PlanError(str(error)) from None
    if not isinstance(values, dict):
        raise PlanError(f"{path}: must have `key: value` lines, one of them `criteria`, not {shown(values)}")
    plan = _checked(values, Path(path))
    try:
        parameters = plan.parameters()
        _check_with(plan, parameters)
        plan.timeline_of(parameters)
    except TimelineError as error:
        raise PlanError(str(error)) from None
    except ParameterError as error:
        raise PlanError(_placed(error, path)) from None
    return plan


def _checked(values: dict[str, Any], path: Path) -> Plan:
    """Return the plan as far as its own keys go. Raises PlanError."""
    try:
        plan = Plan.model_validate({"name": path.stem, **values})
    except ValidationError as error:
        lines = yaml_files.lines(path)
        placed = [(line_of(lines, one), one.text) for one in problems(error, Plan)]
        raise PlanError(one_line(placed, str(path))) from None
    plan._path = str(path.resolve())
    return plan


def _check_with(plan: Plan, parameters: Parameters) -> None:
    """Raise ParameterError for a vehicle or an object that is not there, and for more steps than a table can have."""
    steps = plan.duration / parameters.time_step
    if steps > MAX_ROWS:
        raise ParameterError(
            f"makes {steps:.0f} steps; at most {MAX_ROWS} are kept", ("duration",), f"{plan.duration:g}"
        )
    names = [one.name for one in parameters.fleet] or [parameters.first.name]
    if plan.vehicle and plan.vehicle not in names:
        near = near_names(plan.vehicle, names)
        raise ParameterError(f"no such vehicle; {near}", ("vehicle",), shown(plan.vehicle))
    paths = [one.name for one in parameters.scene.objects if getattr(one, "kind", "") in ("path", "curved_path")]
    for index, criterion in enumerate(plan.criteria):
        for name in criterion.lines:
            if name not in paths and "/" not in name:
                near = near_names(name, paths) if paths else "the scene has none"
                raise ParameterError(f"no such path; {near}", ("criteria", index, "along"), shown(name))
    check_objects(parameters, plan.spread)


def _placed(error: ParameterError, path: str | Path) -> str:
    """Return what is wrong, with the plan's file and, where the wrong key stands in it, the line."""
    lines = yaml_files.lines(path)
    for own in (error, error.below("config")):  # what stands under `config` is called as in config/drone.yaml
        depth, line = lines.find(own.location)
        if error.location and depth == len(own.location):
            return f"{path}: line {line}: {own.text}"
    return f"{path}: {error.text}"
