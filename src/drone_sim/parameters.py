"""The numbers of config/*.yaml, checked once when read, frozen after that.

No value is defined here: config/drone.yaml holds every default, this module says what is allowed.
"""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any, Dict, Literal, Mapping, Optional, Tuple, Union

from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError
from typing_extensions import Annotated

from drone_sim import scene_parameters
from drone_sim.camera_parameters import MAX_CAMERAS, CameraParameters, check_together
from drone_sim.parameter_types import (
    Angle,
    Checked,
    Coordinate,
    File,
    FileName,
    Finite,
    Gain,
    Limits,
    MarginOrNone,
    Name,
    ParameterError,
    Switch,
    Within,
    numeric,
    read_yaml,
    readable_key,
)
from drone_sim.resources import package_path, resolve, shown
from drone_sim.scene_parameters import SHAPES, SceneParameters

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
    position: Tuple[Coordinate, Coordinate, Annotated[Finite, Within(0, 1e5)]]
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
    cameras: Annotated[Dict[Name, CameraParameters], Field(max_length=MAX_CAMERAS)]
    _given: Dict[str, Any] = PrivateAttr(default_factory=dict)  # what stands without the scene file

    _drone_in_scene: Tuple[str, ...] = PrivateAttr(default=())

    @property
    def drone_in_scene(self) -> Tuple[str, ...]:
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

    def check_scene(self, content: Dict[str, Any], file: Path) -> None:
        """Raise ParameterError where a scene file with this content could not be loaded."""
        _checked(self._given, str(file), scene_parameters.from_content(content, file.parent, str(file)))

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several keys at once."""
        steps = self.sub_steps
        if steps < 1 or abs(steps * self.sub_step - self.time_step) > 1e-9 * self.time_step:
            raise ParameterError(
                f"parameter time_step = {self.time_step}: must be a whole multiple of sub_step = {self.sub_step}"
            )
        if steps > MAX_SUB_STEPS:
            raise ParameterError(
                f"parameter sub_step = {self.sub_step}: makes {steps} of a time_step of {self.time_step} s; "
                f"at most {MAX_SUB_STEPS} are allowed"
            )
        check_together(self.cameras)


def load(overrides: Optional[Mapping[str, Any]] = None) -> Parameters:
    """Return config/drone.yaml with a file and `overrides` (nested mappings of the same shape) laid over it.

    The file is named by the overrides' key `config`; '' is none. What it names is relative to where the process
    runs, as in `overrides`. Raises ParameterError.
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
        try:
            _checked(given, "", {})
        except ParameterError as error:
            raise ParameterError(f"{config}: {error}") from None
    given = _merge(given, overrides)
    return _in_scene(given, given["scene_file"])


def _config(name: str) -> Dict[str, Any]:
    try:
        values = read_yaml(resolve(name))
    except FileNotFoundError as error:
        raise ParameterError(f"parameter config = {shown(name)}: {error}") from None
    if "config" in values:
        raise ParameterError(f"{name}: a config file names no other `config`")
    return values


def _in_scene(given: Dict[str, Any], file: Any) -> Parameters:
    in_file = isinstance(file, str) and bool(file)
    return _checked(given, file, scene_parameters.read(file) if in_file else {})


def _checked(given: Dict[str, Any], file: Any, scene: Dict[str, Any]) -> Parameters:
    """Return the parameters with what a scene file says; `file` is its name, '' where there is none."""
    values = _merge({**given, "scene_file": file}, scene)
    try:
        parameters = Parameters.model_validate(values)
    except ValidationError as error:
        from_scene = scene and error.errors()[0]["loc"][:1] in (("scene",), ("drone",))
        raise ParameterError(f"{file}: {_one_line(error)}" if from_scene else _one_line(error)) from None
    parameters._given = given
    drone = scene.get("drone")
    parameters._drone_in_scene = tuple(drone) if isinstance(drone, dict) else ()
    return parameters


def _merge(base: Any, overrides: Any) -> Any:
    if not (isinstance(base, dict) and isinstance(overrides, Mapping)):
        return overrides
    merged = dict(base)
    for key, value in overrides.items():
        merged[key] = _merge(base[key], value) if key in base else value
    return merged


def _one_line(error: ValidationError) -> str:
    first = error.errors()[0]
    key = readable_key(first["loc"])
    if first["type"] == "extra_forbidden":
        return f"parameter {key}: unknown key{_near(first['loc'])}"
    message = first["msg"].replace("Value error, ", "")
    if message.startswith("parameter "):  # of several keys at once: it names them itself
        return message
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    return f"parameter {key} = {shown(first['input'])}: {message[0].lower()}{message[1:]}{more}"


def _near(location: Tuple[Union[int, str], ...]) -> str:
    model: Any = Parameters
    for part in location[:-1]:
        fields = getattr(model, "model_fields", {})
        model = fields[part].annotation if part in fields else SHAPES.get(str(part))
    known = list(getattr(model, "model_fields", {}))
    near = difflib.get_close_matches(str(location[-1])[:80], known, n=3) or known
    return f"; known are {', '.join(near)}" if near else ""
