"""The numbers of config/*.yaml, checked once when read, frozen after that.

No value is defined here: config/drone.yaml holds every default, this module says what is allowed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError

from drone_sim.config.errors import Problem, line_of, problems, told
from drone_sim.config.types import (
    Angle,
    Checked,
    Coordinate,
    File,
    FileName,
    Finite,
    Gain,
    Limits,
    Location,
    MarginOrNone,
    Name,
    ParameterError,
    Switch,
    Within,
    named_in,
    numeric,
    read_yaml,
)
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path, resolve
from drone_sim.scene import scene_parameters
from drone_sim.scene.scene_parameters import SceneParameters
from drone_sim.sensors.camera_parameters import MAX_CAMERAS, CameraParameters, check_together
from drone_sim.wording import shown

__all__ = ["CameraParameters", "ParameterError", "Parameters", "load", "read_yaml"]

MAX_SUB_STEPS = 1000


class TwistLimits(Checked):
    """Beyond these a command is a mistake."""

    linear: Annotated[Finite, Within(1e-6, 1e3)]
    angular: Annotated[Finite, Within(1e-6, 1e3)]


class PushParameters(Checked):
    """How long a push on the topic `push` lasts, and what is a mistake."""

    duration: Annotated[Finite, Within(1e-4, 1e4)]
    force_limit: Annotated[Finite, Within(1e-6, 1e6)]
    torque_limit: Annotated[Finite, Within(1e-6, 1e6)]


class DroneParameters(Checked):
    """Name, body and starting place of the drone."""

    name: Name
    urdf: File
    position: Annotated[
        tuple[Coordinate, Coordinate, Annotated[Finite, Within(0, 1e5)]], Field(description="3 numbers, [x, y, z] in m")
    ]
    yaw: Angle


class PropellerParameters(Checked):
    """V-REP's particle law; see propeller.py."""

    law: Literal["3.x", "4.x"]
    particles_per_second: Annotated[Finite, Within(1e-3, 1e6)]
    particle_density: Annotated[Finite, Within(1e-3, 1e6)]
    particle_size: Annotated[Finite, Within(1e-6, 1)]
    torque_per_velocity: Annotated[Finite, Within(0, 1e3)]
    velocity_limits: Limits


class ControlParameters(Checked):
    """The tutorial's gains; a child script reads them by name with getScriptSimulationParameter."""

    thrust_gravity: Annotated[Finite, Within(1e-3, 1e4)]
    thrust_limits: Limits
    Dthrust: Gain
    Kzref: Gain
    Dzref: Gain
    Dyaw: Gain
    angle_min: Gain
    angle_max: Gain
    Pangle: Gain
    Dangle: Gain
    Kvcorr: Gain
    recovery_margin: MarginOrNone
    Precovery: Gain


class Parameters(Checked):
    """Everything in config/drone.yaml."""

    config: FileName
    gui: Switch
    script: FileName
    script_time_limit: Annotated[Finite, Within(0.01, 1e4, or_zero=True)]
    real_time_factor: Annotated[Finite, Within(1e-3, 1e3, or_zero=True)]
    cmd_vel_timeout: Annotated[Finite, Within(1e-4, 1e6, or_zero=True)]
    cmd_vel_limits: TwistLimits
    position_limit: Annotated[Finite, Within(1e-3, 1e5)]
    push: PushParameters
    time_step: Annotated[Finite, Within(1e-4, 1)]
    sub_step: Annotated[Finite, Within(1e-5, 1)]
    gravity: Annotated[Finite, Within(-100, 100)]
    scene_file: FileName
    scene: SceneParameters
    drone: DroneParameters
    propellers: PropellerParameters
    control: ControlParameters
    samples: Annotated[Literal[0, 2, 4, 8], BeforeValidator(numeric)]
    cameras: Annotated[dict[Name, CameraParameters], Field(max_length=MAX_CAMERAS)]
    _given: dict[str, Any] = PrivateAttr(default_factory=dict)  # what stands without the scene file

    _drone_in_scene: tuple[str, ...] = PrivateAttr(default=())

    @property
    def drone_in_scene(self) -> tuple[str, ...]:
        """The keys of `drone` that the scene file gives."""
        return self._drone_in_scene

    @property
    def sub_steps(self) -> int:
        """Number of Bullet steps in a simulation step."""
        return round(self.time_step / self.sub_step)

    def in_scene(self, file: str) -> Parameters:
        """Return the parameters with floor, objects and drone as a scene file says now. Raises ParameterError.

        '' is the scene that was given without a file.
        """
        return _in_scene(self._given, file)

    def check_scene(self, content: dict[str, Any], file: Path) -> None:
        """Raise ParameterError where a scene file with this content could not be loaded."""
        _checked(self._given, str(file), scene_parameters.from_content(content, file.parent))

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
                f"parameter time_step = {self.time_step}: must be a whole multiple of sub_step = {self.sub_step}",
                ("time_step",),
            )
        if steps > MAX_SUB_STEPS:
            raise ParameterError(
                f"parameter sub_step = {self.sub_step}: makes {steps} of a time_step of {self.time_step} s; "
                f"at most {MAX_SUB_STEPS} are allowed",
                ("sub_step",),
            )
        check_together(self.cameras)


def load(overrides: Mapping[str, Any] | None = None) -> Parameters:
    """Return config/drone.yaml with a file and `overrides` (nested mappings of the same shape) laid over it.

    The file is named by the overrides' key `config`; '' is none. The files that it names are relative to it, those
    in `overrides` to where the process runs. Raises ParameterError.
    """
    overrides = {} if overrides is None else overrides
    if not isinstance(overrides, Mapping):
        raise ParameterError(f"parameters = {shown(overrides)}: must be a mapping of the keys of config/drone.yaml")
    given = read_yaml(package_path() / "config" / "drone.yaml")
    config = overrides.get("config") or ""
    if not isinstance(config, str):
        raise ParameterError(f"parameter config = {shown(config)}: must be the name of a file")
    if config:
        given = _merge(given, _config(config))
        _checked(given, "", {}, config)
    given = _merge(given, overrides)
    return _in_scene(given, given["scene_file"])


def _config(name: str) -> dict[str, Any]:
    """Return what a file says. Raises ParameterError."""
    try:
        path = resolve(name)
    except FileNotFoundError as error:
        raise ParameterError(f"parameter config = {shown(name)}: {error}") from None
    values = read_yaml(path)
    if "config" in values:
        raise ParameterError(f"{name}: a config file names no other `config`")
    scene_parameters.find_files_beside(path.parent, values)
    for key in ("script", "scene_file"):
        if isinstance(values.get(key), str) and Path(values[key]).suffix:  # tutorial and target have none
            values[key] = named_in(path.parent, values[key])
    return values


def _in_scene(given: dict[str, Any], file: Any) -> Parameters:
    if not (isinstance(file, str) and file):
        return _checked(given, file, {})
    return _checked(given, file, scene_parameters.read(file), file)


def _checked(given: dict[str, Any], file: Any, scene: dict[str, Any], named: str = "") -> Parameters:
    """Return the parameters with what the scene file says; `file` is its name, '' where there is none.

    What is wrong may stand in the file `named`, which is the scene file or one laid over config/drone.yaml.
    """
    try:
        parameters = Parameters.model_validate(_merge({**given, "scene_file": file}, scene))
    except ValidationError as error:
        raise ParameterError(_told(problems(error, Parameters), named, bool(scene))) from None
    parameters._given = given
    drone = scene.get("drone")
    parameters._drone_in_scene = tuple(drone) if isinstance(drone, dict) else ()
    return parameters


def _told(found: list[Problem], file: str, is_scene: bool) -> str:
    lines = yaml_files.lines(resolve(file)) if file else yaml_files.Lines("")
    placed = []
    for problem in found:
        inner = scene_parameters.problem_in_file(problem) if is_scene else problem
        line = line_of(lines, inner) if inner is not None else None
        placed.append((line, problem.text if line is None or inner is None else inner.text))
    return told(placed, file if not is_scene or any(line for line, _ in placed) else "")


def _merge(base: Any, overrides: Any) -> Any:
    if not (isinstance(base, dict) and isinstance(overrides, Mapping)):
        return overrides
    merged = dict(base)
    for key, value in overrides.items():
        merged[key] = _merge(base[key], value) if key in base else value
    return merged
