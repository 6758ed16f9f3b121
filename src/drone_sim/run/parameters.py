"""Parameters of config/*.yaml, checked when they are read, and frozen.

This module defines what is allowed, and no values: config/drone.yaml holds every default.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

from drone_sim.config.errors import changed, line_of, problems
from drone_sim.config.types import (
    ADDRESS,
    Checked,
    FileName,
    Finite,
    Location,
    Name,
    ParameterError,
    ParameterProblem,
    Switch,
    Within,
    merged,
    named_in,
    numeric,
    one_line,
    read_yaml,
)
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path, resolve
from drone_sim.files.yaml_files import YamlLines
from drone_sim.forces.weather import WeatherParameters
from drone_sim.importing.cache import imported_scene
from drone_sim.message_text import MAX_NAME, shown
from drone_sim.run.profiles import profile_files, read_config
from drone_sim.scene import scene_parameters
from drone_sim.scene.scene_parameters import SceneParameters
from drone_sim.sensors.validation import check_rates
from drone_sim.vehicles.parameters import DroneParameters, EquipmentParameters, VehicleParameters, laid_over
from drone_sim.vrep_files.model import SUFFIXES, VrepFileError

MAX_SUB_STEPS = 1000
MAX_VEHICLES = 256
MAX_STEP_COUNT = 1_000_000
_SPACING = 1.0  # m, between two vehicles in a row

STEP = "step"
_NONE = "none"  # as the launch argument, for no topics: an empty one is hard to write
_MAX_AWAITED = 64
_LONGEST_TOPIC = 200  # characters
_TOPIC = re.compile(r"/?[A-Za-z]\w*(/\w+)*", re.ASCII)
_STEPS = re.compile(r"([1-9][0-9]{0,4}) steps?")


class RemoteApiParameters(Checked):
    """Access of clients to the remote API."""

    serve: Switch
    address: Annotated[str, Field(pattern=ADDRESS, max_length=MAX_NAME)]
    port: Annotated[int, Within(0, 65535)]
    legacy_port: Annotated[int, Within(0, 65535)]
    scenes: FileName


class PaceParameters(Checked):
    """Speed of the simulation compared with real time."""

    real_time_factor: Annotated[Finite, Within(1e-3, 1e3, or_zero=True)]


class PhysicsParameters(Checked):
    """Terms of rigid-body dynamics that V-REP leaves out."""

    gyroscopic: Switch


def _check_topic(topic: str) -> str:
    if not _TOPIC.fullmatch(topic):
        raise ValueError("must be a topic such as cmd_vel, drone2/cmd_vel or /drone/cmd_vel")
    return topic


def _check_trigger(trigger: str) -> str:
    if not (_STEPS.fullmatch(trigger) or _TOPIC.fullmatch(trigger)):
        raise ValueError("must be step, a number of steps such as `4 steps`, odom, or a camera's topic such as front")
    return trigger


class AwaitedTopic(Checked):
    """A topic that the vehicles listen to, and the message that each of its messages answers."""

    topic: Annotated[str, Field(max_length=_LONGEST_TOPIC), AfterValidator(_check_topic)]
    trigger: Annotated[str, Field(max_length=_LONGEST_TOPIC), AfterValidator(_check_trigger)]
    every: Annotated[int, Within(1, 100_000)]

    @property
    def steps(self) -> int:
        """Number of steps between two triggers; 0 if a vehicle's topic is the trigger."""
        if self.trigger == STEP:
            return 1
        found = _STEPS.fullmatch(self.trigger)
        return int(found[1]) if found else 0


def _check_list(value: Any) -> Any:
    if not isinstance(value, list):
        raise ValueError("must be a list of topics such as [cmd_vel]")
    return value


class LockstepParameters(Checked):
    """What the next step waits for, and for how long. Without topics in `wait_for`, no step waits."""

    wait_for: Annotated[list[AwaitedTopic], BeforeValidator(_check_list), Field(max_length=_MAX_AWAITED)]
    trigger: Annotated[str, Field(max_length=_LONGEST_TOPIC), AfterValidator(_check_trigger)]
    every: Annotated[int, Within(1, 100_000)]
    timeout: Annotated[Finite, Within(0.01, 1e4)]
    start_timeout: Annotated[Finite, Within(0.1, 1e4)]
    on_timeout: Literal["hold", "go on", "end"]

    @model_validator(mode="before")
    @classmethod
    def _complete_topics(cls, values: Any) -> Any:
        """Accept names in place of entries, and names separated by commas, as the launch argument has them."""
        if not isinstance(values, Mapping):
            return values
        entries = values.get("wait_for")
        if isinstance(entries, str):
            entries = [] if entries.strip() in ("", _NONE) else [name.strip() for name in entries.split(",")]
        if not isinstance(entries, (list, tuple)):
            return values
        common = {key: values[key] for key in ("trigger", "every") if key in values}
        named = [{"topic": entry} if isinstance(entry, str) else entry for entry in entries]
        completed = [{**common, **entry} if isinstance(entry, Mapping) else entry for entry in named]
        return {**values, "wait_for": completed}


class Parameters(PaceParameters, EquipmentParameters):
    """All parameters in config/drone.yaml."""

    profile: FileName
    config: FileName
    gui: Switch
    script_time_limit: Annotated[Finite, Within(0.01, 1e4, or_zero=True)]
    timeline_file: FileName
    step_count: Annotated[int, Within(1, MAX_STEP_COUNT)]
    lockstep: LockstepParameters
    remote_api: RemoteApiParameters
    time_step: Annotated[Finite, Within(1e-4, 1)]
    sub_step: Annotated[Finite, Within(1e-5, 1)]
    gravity: Annotated[Finite, Within(-100, 100)]
    physics: PhysicsParameters
    scene_file: FileName
    scene: SceneParameters
    drone: DroneParameters
    weather: WeatherParameters
    vehicles: Annotated[dict[Name, VehicleParameters], Field(max_length=MAX_VEHICLES)]
    samples: Annotated[Literal[0, 2, 4, 8], BeforeValidator(numeric)]
    _values: dict[str, Any] = PrivateAttr(default_factory=dict)  # the parameters without the scene file
    _in_scene_file: dict[str, Any] = PrivateAttr(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _complete_vehicles(cls, values: Any) -> Any:
        if not isinstance(values, Mapping) or "vehicles" not in values:
            return values
        entries = _vehicle_entries(values["vehicles"], values.get("drone"))
        if isinstance(entries, Mapping):
            entries = {
                name: laid_over(entry, str(name), values) if isinstance(entry, Mapping) else entry
                for name, entry in entries.items()
            }
        return {**values, "vehicles": entries}

    @property
    def fleet(self) -> tuple[VehicleParameters, ...]:
        """The vehicles that fly. Empty if the scene file has `vehicles: {}` and no other source adds vehicles."""
        fleet = tuple(self.vehicles.values())
        return (fleet[0].alone(),) if [*self.vehicles] == [self.drone.name] else fleet

    @property
    def first(self) -> VehicleParameters:
        """The first vehicle, usually the only one. Raises ParameterError if there is none."""
        if not self.vehicles:
            raise ParameterError(
                f"{self.scene_file}: the scene has no vehicle (vehicles: {{}}); add one, such as vehicles: 1"
            )
        return self.fleet[0]

    @property
    def vehicle_entries(self) -> dict[str, dict[str, Any]]:
        """The entries of `vehicles` for the present fleet, with positions and yaw; {} if the scene file has entries."""
        if "vehicles" in self._in_scene_file:
            return {}
        configured = self._values.get("vehicles")
        poses = {vehicle.name: {"position": list(vehicle.position), "yaw": vehicle.yaw} for vehicle in self.fleet}
        entries = configured if isinstance(configured, Mapping) else {}
        return {name: {**pose, **entries.get(name, {})} for name, pose in poses.items()}

    @property
    def in_scene_file(self) -> Mapping[str, Any]:
        """The scene file's keys other than the scene: `drone`, `vehicles`, `weather`, `time_step`, ..."""
        return self._in_scene_file

    @property
    def sub_steps(self) -> int:
        """Number of Bullet steps in a simulation step."""
        return round(self.time_step / self.sub_step)

    def in_scene(self, file: str) -> Parameters:
        """Return the parameters with floor, objects and drone of a scene file, read now. Raises ParameterError.

        For '' the scene is that of the parameters, without a file.
        """
        return self._with_same_time_step(_parameters_in_scene(self._values, file), file)

    def with_content(self, content: Mapping[str, Any], folder: Path, lines: YamlLines | None = None) -> Parameters:
        """Return the parameters with the scene in `content`, whose file names are relative to `folder`.

        Raises ParameterError, with the line numbers of `lines`, the text of the content.
        """
        scene = scene_parameters.from_content(copy.deepcopy(dict(content)), folder)
        return self._with_same_time_step(_checked(self._values, self.scene_file, scene, lines=lines), "")

    def in_file(self, file: str) -> Parameters:
        """Return the same parameters with another path for the scene file."""
        return self.model_copy(update={"scene_file": file})

    def _with_same_time_step(self, other: Parameters, file: str) -> Parameters:
        if other.time_step != self.time_step:
            reason = f"the time step cannot change while the simulation runs; it stays {self.time_step:g} s"
            raise ParameterError(f"{file or 'the scene'}: time_step = {other.time_step:g}: {reason}", ("time_step",))
        return other

    def with_vehicles(self, entries: Any) -> Parameters:
        """Return the parameters with other `vehicles` in addition to the scene file's. Raises ParameterError."""
        return _parameters_in_scene({**self._values, "vehicles": entries}, self.scene_file)

    def at_pace(self, factor: Any) -> Parameters:
        """Return the parameters with another real-time factor, which scenes read later keep. Raises ParameterError."""
        pace = changed(PaceParameters(real_time_factor=self.real_time_factor), {"real_time_factor": factor})
        parameters = self.model_copy(update=pace.model_dump())
        parameters._values = {**self._values, **pace.model_dump()}
        return parameters

    def varied(
        self, weather: WeatherParameters, scene: SceneParameters, fleet: tuple[VehicleParameters, ...]
    ) -> Parameters:
        """Return the parameters with another weather, scene and fleet, for the same objects and vehicles.

        The arguments are already validated. Reading a scene file again discards them.
        """
        vehicles = {vehicle.name: vehicle for vehicle in fleet}
        return self.model_copy(update={"weather": weather, "scene": scene, "vehicles": vehicles})

    def scene_place(self, location: Location) -> str:
        """Return the position of a key of the scene for a message: file and line, or `scene` without a file."""
        if not self.scene_file:
            return "scene"
        return f"{self.scene_file}: line {yaml_files.lines(resolve(self.scene_file)).find(location).line}"

    def model_post_init(self, _context: Any) -> None:
        steps = self.sub_steps
        if steps < 1 or abs(steps * self.sub_step - self.time_step) > 1e-9 * self.time_step:
            raise ParameterError(
                f"must be a whole multiple of sub_step = {self.sub_step}", ("time_step",), str(self.time_step)
            )
        if steps > MAX_SUB_STEPS:
            raise ParameterError(
                f"makes {steps} sub-steps of a time_step of {self.time_step} s; at most {MAX_SUB_STEPS} are allowed",
                ("sub_step",),
                str(self.sub_step),
            )
        super().model_post_init(_context)
        check_rates(self.sensors, self.sub_step)
        for name, vehicle in self.vehicles.items():
            check_rates(vehicle.sensors, self.sub_step, ("vehicles", name))


def _vehicle_entries(value: Any, drone: Any) -> Any:
    """Return the entries of `vehicles`: the drone's if there are no others.

    A number n becomes drone1 ... drone<n>, in a row centred on the drone.
    """
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if isinstance(value, Mapping) or (is_number and value == 0):
        name = drone.get("name") if isinstance(drone, Mapping) else None
        return value or ({name: {}} if isinstance(name, str) else {})
    if not (is_number and 0 <= value <= MAX_VEHICLES and value == int(value)):
        allowed = f"a whole number from 0 to {MAX_VEHICLES}, or entries such as drone1: {{position: [0, 0, 0.8]}}"
        raise ParameterError(f"must be {allowed}", ("vehicles",), shown(value))
    try:
        x, y, z = map(float, drone["position"])
    except (TypeError, KeyError, ValueError):  # reported when the other values are checked
        return {}
    middle = (value - 1) / 2
    offsets = [_SPACING * (middle - number) for number in range(int(value))]
    return {f"drone{number}": {"position": [x, y + offset, z]} for number, offset in enumerate(offsets, start=1)}


def load(overrides: Mapping[str, Any] | None = None) -> Parameters:
    """Return the parameters of config/drone.yaml, overridden by a profile, by config files, then by `overrides`.

    The key `profile` of the overrides names the profile ('' for none), the key `config` the files, separated by commas
    ('' for none); later files override earlier ones. File names in a config file are relative to it, those in
    `overrides` to the working directory.
    Raises ParameterError.
    """
    overrides = {} if overrides is None else overrides
    if not isinstance(overrides, Mapping):
        raise ParameterError(f"parameters = {shown(overrides)}: must be a mapping of the keys of config/drone.yaml")
    values = read_yaml(package_path() / "config" / "drone.yaml")
    for key, names in (("profile", profile_files), ("config", lambda files: files.split(","))):
        given = overrides.get(key) or ""
        if not isinstance(given, str):
            raise ParameterError("must be the name of a file", (key,), shown(given))
        for name in filter(None, names(given)):
            values = merged(values, _read_config(name, values, key))
            _checked(values, "", {}, name)
    if overrides.get("vehicles") == 0:  # means no override: arguments of roslaunch cannot be omitted
        overrides = {key: value for key, value in overrides.items() if key != "vehicles"}
    values = merged(values, overrides)
    return _parameters_in_scene(values, values["scene_file"])


def _read_config(name: str, below: Mapping[str, Any], key: str) -> dict[str, Any]:
    """Return the content of a profile or config (the `key`) that overrides `below`. Raises ParameterError."""
    try:
        path = resolve(name)
    except FileNotFoundError as error:
        raise ParameterError(str(error), (key,), shown(name)) from None
    values = read_config(path, below)
    for other in ("config", "profile"):
        if other in values:
            raise ParameterError(f"{name}: a {key} file must not have the key `{other}`")
    scene_parameters.find_files_beside(path.parent, values)
    for key in ("script", "scene_file", "timeline_file"):
        if isinstance(values.get(key), str) and Path(values[key]).suffix:  # `tutorial` and `target` are no files
            values[key] = named_in(path.parent, values[key])
    return values


def _parameters_in_scene(values: dict[str, Any], file: Any) -> Parameters:
    if not (isinstance(file, str) and file):
        return _checked(values, file, {})
    if Path(file).suffix.lower() in SUFFIXES:
        try:
            file = str(imported_scene(resolve(file)))
        except (OSError, VrepFileError) as error:
            raise ParameterError(str(error), ("scene_file",), shown(file)) from None
    return _checked(values, file, scene_parameters.read(file), file)


def _checked(
    values: dict[str, Any], file: Any, scene: dict[str, Any], named: str = "", lines: YamlLines | None = None
) -> Parameters:
    """Return the parameters of `values` with the scene in `scene`; `file` is the scene file's name, '' for none.

    Messages give line numbers in the file `named` (the scene file or a config file), or in `lines`, a scene's text.
    """
    is_empty = scene.get("vehicles") == {}
    overrides = {key: value for key, value in scene.items() if key != "vehicles"} if is_empty else scene
    try:
        parameters = Parameters.model_validate(merged({**values, "scene_file": file}, overrides))
    except ValidationError as error:
        wrong = problems(error, Parameters)
        # A wrong value that a vehicle inherits, and that is not in its own entry, is reported at the top level.
        own = [
            problem
            for problem in wrong
            if problem.location[:1] != ("vehicles",)
            or any(_has(source, problem.location[:3]) for source in (values, scene))
        ]
        reported = own or list(dict.fromkeys(problem._replace(location=problem.location[2:]) for problem in wrong))
        raise ParameterError.of(reported, _line_in_file(reported, named, bool(scene), lines)) from None
    parameters._values = values
    parameters._in_scene_file = {key: scene[key] for key in scene_parameters.BESIDE if key in scene}
    return parameters.model_copy(update={"vehicles": {}}) if is_empty and not values.get("vehicles") else parameters


def _has(value: Any, location: Location) -> bool:
    """Return whether a nested mapping has a key."""
    for key in location:
        if not (isinstance(value, Mapping) and key in value):
            return False
        value = value[key]
    return True


def _line_in_file(wrong: Sequence[ParameterProblem], file: str, is_scene: bool, lines: YamlLines | None) -> str:
    """Return one line with all problems and their line numbers in the file or text; '' if there is neither."""
    if not file and lines is None:
        return ""
    lines = lines or yaml_files.lines(resolve(file))
    placed = []
    for problem in wrong:
        in_scene = scene_parameters.problem_in_file(problem) if is_scene else problem
        line = line_of(lines, in_scene) if in_scene is not None else None
        placed.append((line, problem.sentence if line is None or in_scene is None else in_scene.sentence))
    return one_line(placed, file if not is_scene or any(line for line, _ in placed) else "")
