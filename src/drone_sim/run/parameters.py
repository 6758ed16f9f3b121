"""The numbers of config/*.yaml, checked once when read, frozen after that.

No value is defined here: config/drone.yaml holds every default, this module says what is allowed.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

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
from drone_sim.run.dumps import read_config
from drone_sim.scene import scene_parameters
from drone_sim.scene.scene_parameters import SceneParameters
from drone_sim.sensors.validation import check_rates
from drone_sim.vehicles.parameters import DroneParameters, EquipmentParameters, VehicleParameters, laid_over
from drone_sim.vrep_files.model import SUFFIXES, VrepFileError

MAX_SUB_STEPS = 1000
MAX_VEHICLES = 256
_SPACING = 1.0  # m, between two vehicles in a row


class RemoteApiParameters(Checked):
    """Who may drive the simulation from outside."""

    serve: Switch
    address: Annotated[str, Field(pattern=ADDRESS, max_length=MAX_NAME)]
    port: Annotated[int, Within(0, 65535)]
    legacy_port: Annotated[int, Within(0, 65535)]
    scenes: FileName


class PaceParameters(Checked):
    """How fast the simulation goes."""

    real_time_factor: Annotated[Finite, Within(1e-3, 1e3, or_zero=True)]


class PhysicsParameters(Checked):
    """What of the textbook's dynamics V-REP leaves out."""

    gyroscopic: Switch


class Parameters(PaceParameters, EquipmentParameters):
    """Everything in config/drone.yaml."""

    config: FileName
    gui: Switch
    script_time_limit: Annotated[Finite, Within(0.01, 1e4, or_zero=True)]
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
    _given: dict[str, Any] = PrivateAttr(default_factory=dict)  # what stands without the scene file

    _in_scene_file: dict[str, Any] = PrivateAttr(default_factory=dict)
    _fleet: tuple[VehicleParameters, ...] = PrivateAttr(default=())

    @model_validator(mode="before")
    @classmethod
    def _lay_vehicles_over(cls, values: Any) -> Any:
        if not isinstance(values, Mapping) or "vehicles" not in values:
            return values
        entries = _entries(values["vehicles"], values.get("drone"))
        if isinstance(entries, Mapping):
            entries = {
                name: laid_over(entry, str(name), values) if isinstance(entry, Mapping) else entry
                for name, entry in entries.items()
            }
        return {**values, "vehicles": entries}

    @property
    def fleet(self) -> tuple[VehicleParameters, ...]:
        """What flies: the `vehicles`, or the drone alone where there are none, or one that has the drone's name.

        Nobody flies where the scene file says `vehicles: {}`, and nothing beside it says otherwise.
        """
        return self._fleet

    @property
    def first(self) -> VehicleParameters:
        """The first vehicle, most often the only one. Raises ParameterError where nobody flies."""
        if not self._fleet:
            raise ParameterError(
                f"{self.scene_file}: the scene has no vehicle (vehicles: {{}}); add one, such as vehicles: 1"
            )
        return self._fleet[0]

    @property
    def vehicle_entries(self) -> dict[str, dict[str, Any]]:
        """The entries of `vehicles` that stand for what flies; none where the scene file has some."""
        if "vehicles" in self._in_scene_file:
            return {}
        given = self._given.get("vehicles")
        places = {one.name: {"position": list(one.position), "yaw": one.yaw} for one in self._fleet}
        own = given if isinstance(given, Mapping) else {}
        return {name: {**place, **own.get(name, {})} for name, place in places.items()}

    @property
    def in_scene_file(self) -> Mapping[str, Any]:
        """What the scene file says beside the scene: `drone`, `vehicles`, `weather`, `time_step`, ..."""
        return self._in_scene_file

    @property
    def sub_steps(self) -> int:
        """Number of Bullet steps in a simulation step."""
        return round(self.time_step / self.sub_step)

    def in_scene(self, file: str) -> Parameters:
        """Return the parameters with floor, objects and drone as a scene file says now. Raises ParameterError.

        '' is the scene that was given without a file.
        """
        return self._at_the_same_step(_in_scene(self._given, file), file)

    def with_content(self, content: Mapping[str, Any], folder: Path, lines: YamlLines | None = None) -> Parameters:
        """Return the parameters in a scene of this content, such as a file in `folder` could have.

        Raises ParameterError, with where it stands in the `lines` of its text.
        """
        said = scene_parameters.from_content(copy.deepcopy(dict(content)), folder)
        return self._at_the_same_step(_checked(self._given, self.scene_file, said, lines=lines), "")

    def in_file(self, file: str) -> Parameters:
        """Return the same parameters, of a scene that has another file from now on."""
        return self.model_copy(update={"scene_file": file})

    def _at_the_same_step(self, found: Parameters, file: str) -> Parameters:
        if found.time_step != self.time_step:
            said = f"the time step cannot change while the simulation runs; it stays {self.time_step:g} s"
            raise ParameterError(f"{file or 'the scene'}: time_step = {found.time_step:g}: {said}", ("time_step",))
        return found

    def with_vehicles(self, entries: Any) -> Parameters:
        """Return the parameters with other `vehicles` given beside the scene file's. Raises ParameterError."""
        return _in_scene({**self._given, "vehicles": entries}, self.scene_file)

    def at_pace(self, factor: Any) -> Parameters:
        """Return the parameters with another real-time factor, also for scenes read later. Raises ParameterError."""
        pace = changed(PaceParameters(real_time_factor=self.real_time_factor), {"real_time_factor": factor})
        made = self.model_copy(update=pace.model_dump())
        made._given = {**self._given, **pace.model_dump()}
        return made

    def varied(
        self, weather: WeatherParameters, scene: SceneParameters, fleet: tuple[VehicleParameters, ...]
    ) -> Parameters:
        """Return the parameters with other weather and places, of the same objects and vehicles, for one simulation.

        They are checked already; a scene file that is read anew forgets them.
        """
        made = self.model_copy(update={"weather": weather, "scene": scene})
        made._fleet = fleet
        return made

    def scene_place(self, location: Location) -> str:
        """Return where a key of the scene stands, for a message: file and line, or just `scene`."""
        if not self.scene_file:
            return "scene"
        return f"{self.scene_file}: line {yaml_files.lines(resolve(self.scene_file)).find(location).line}"

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several keys at once."""
        steps = self.sub_steps
        if steps < 1 or abs(steps * self.sub_step - self.time_step) > 1e-9 * self.time_step:
            raise ParameterError(
                f"must be a whole multiple of sub_step = {self.sub_step}", ("time_step",), str(self.time_step)
            )
        if steps > MAX_SUB_STEPS:
            raise ParameterError(
                f"makes {steps} of a time_step of {self.time_step} s; at most {MAX_SUB_STEPS} are allowed",
                ("sub_step",),
                str(self.sub_step),
            )
        super().model_post_init(_context)
        check_rates(self.sensors, self.sub_step)
        for name, vehicle in self.vehicles.items():
            check_rates(vehicle.sensors, self.sub_step, ("vehicles", name))
        fleet = tuple(self.vehicles.values()) or (VehicleParameters.only(self.drone, self),)
        self._fleet = (fleet[0].alone(),) if [one.name for one in fleet] == [self.drone.name] else fleet


def _entries(given: Any, drone: Any) -> Any:
    """Return the entries that a number of vehicles stands for: drone1, drone2, ... in a row about the drone."""
    if isinstance(given, Mapping):
        return given
    is_number = isinstance(given, (int, float)) and not isinstance(given, bool)
    if not (is_number and 0 <= given <= MAX_VEHICLES and given == int(given)):
        must = f"a whole number from 0 to {MAX_VEHICLES}, or entries such as drone1: {{position: [0, 0, 0.8]}}"
        raise ParameterError(f"must be {must}", ("vehicles",), shown(given))
    try:
        x, y, z = map(float, drone["position"])
    except (TypeError, KeyError, ValueError):  # refused with the other values
        return {}
    middle = (given - 1) / 2
    sides = [_SPACING * (middle - number) for number in range(int(given))]
    return {f"drone{number}": {"position": [x, y + side, z]} for number, side in enumerate(sides, start=1)}


def load(overrides: Mapping[str, Any] | None = None) -> Parameters:
    """Return config/drone.yaml with a file and `overrides` (nested mappings of the same shape) laid over it.

    The file is named by the overrides' key `config`; '' is none, and of several, parted by commas, the later are laid
    over the earlier. The files that it names are relative to it, those in `overrides` to where the process runs.
    Raises ParameterError.
    """
    overrides = {} if overrides is None else overrides
    if not isinstance(overrides, Mapping):
        raise ParameterError(f"parameters = {shown(overrides)}: must be a mapping of the keys of config/drone.yaml")
    given = read_yaml(package_path() / "config" / "drone.yaml")
    config = overrides.get("config") or ""
    if not isinstance(config, str):
        raise ParameterError("must be the name of a file", ("config",), shown(config))
    for name in filter(None, config.split(",")):
        given = merged(given, _config(name, given))
        _checked(given, "", {}, name)
    if overrides.get("vehicles") == 0:  # roslaunch's arguments cannot be left out
        overrides = {key: value for key, value in overrides.items() if key != "vehicles"}
    given = merged(given, overrides)
    return _in_scene(given, given["scene_file"])


def _config(name: str, below: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a file says, which is laid over what stands `below`. Raises ParameterError."""
    try:
        path = resolve(name)
    except FileNotFoundError as error:
        raise ParameterError(str(error), ("config",), shown(name)) from None
    values = read_config(path, below)
    if "config" in values:
        raise ParameterError(f"{name}: a config file must not have the key `config`")
    scene_parameters.find_files_beside(path.parent, values)
    for key in ("script", "scene_file"):
        if isinstance(values.get(key), str) and Path(values[key]).suffix:  # tutorial and target have none
            values[key] = named_in(path.parent, values[key])
    return values


def _in_scene(given: dict[str, Any], file: Any) -> Parameters:
    if not (isinstance(file, str) and file):
        return _checked(given, file, {})
    if Path(file).suffix.lower() in SUFFIXES:
        file = _imported(file)
    return _checked(given, file, scene_parameters.read(file), file)


def _imported(file: str) -> str:
    """Return the scene file that one of V-REP's is made into. Raises ParameterError."""
    try:
        return str(imported_scene(resolve(file)))
    except (OSError, VrepFileError) as error:
        raise ParameterError(str(error), ("scene_file",), shown(file)) from None


def _checked(
    given: dict[str, Any], file: Any, scene: dict[str, Any], named: str = "", lines: YamlLines | None = None
) -> Parameters:
    """Return the parameters with what the scene file says; `file` is its name, '' where there is none.

    What is wrong may stand in the file `named`, which is the scene file or one laid over config/drone.yaml, or in the
    `lines` of a scene's text.
    """
    nobody = scene.get("vehicles") == {}
    laid = {key: value for key, value in scene.items() if key != "vehicles"} if nobody else scene
    try:
        parameters = Parameters.model_validate(merged({**given, "scene_file": file}, laid))
    except ValidationError as error:
        found = problems(error, Parameters)
        own = [one for one in found if _is_given(one, given, scene)]  # what is only a vehicle's own is told at the top
        told = own or list(dict.fromkeys(one._replace(location=one.location[2:]) for one in found))
        raise ParameterError.of(told, _in_file(told, named, bool(scene), lines)) from None
    parameters._given = given
    parameters._in_scene_file = {key: scene[key] for key in scene_parameters.BESIDE if key in scene}
    if nobody and not parameters.vehicles:
        parameters._fleet = ()
    return parameters


def _is_given(problem: ParameterProblem, *sources: Mapping[str, Any]) -> bool:
    """Tell whether a wrong value is the vehicle's own; one from the keys at the top is reported there instead."""
    if problem.location[:1] != ("vehicles",) or len(problem.location) < 3:
        return True
    for source in sources:
        here: Any = source
        for key in problem.location[:3]:
            here = here.get(key) if isinstance(here, Mapping) else None
        if here is not None:
            return True
    return False


def _in_file(found: Sequence[ParameterProblem], file: str, is_scene: bool, lines: YamlLines | None) -> str:
    """Return what is wrong with the lines of a file, or of a text, that it stands in; '' where there is none."""
    if not file and lines is None:
        return ""
    lines = lines or yaml_files.lines(resolve(file))
    placed = []
    for problem in found:
        inner = scene_parameters.problem_in_file(problem) if is_scene else problem
        line = line_of(lines, inner) if inner is not None else None
        placed.append((line, problem.sentence if line is None or inner is None else inner.sentence))
    return one_line(placed, file if not is_scene or any(line for line, _ in placed) else "")
