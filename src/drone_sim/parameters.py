"""The numbers of config/*.yaml, checked once when read, frozen after that.

No value is defined here: config/drone.yaml holds every default, this module says what is allowed.
"""

from __future__ import annotations

import difflib
import math
from typing import Any, Dict, Literal, Mapping, Optional, Tuple, Union

from pydantic import Field, PrivateAttr, ValidationError
from typing_extensions import Annotated

from drone_sim import scene_parameters
from drone_sim.frames import Matrix, from_rpy, multiply
from drone_sim.parameter_types import (
    AngleOrNone,
    Checked,
    File,
    Finite,
    Limits,
    Name,
    NonNegative,
    ParameterError,
    Point,
    Positive,
    read_yaml,
)
from drone_sim.resources import package_path
from drone_sim.scene_parameters import SHAPES, SceneParameters

__all__ = ["CameraParameters", "ParameterError", "Parameters", "load", "read_yaml"]


class TwistLimits(Checked):
    """Beyond these a command is a mistake."""

    linear: Positive
    angular: Positive


class PushParameters(Checked):
    """How long a push on the topic `push` lasts, and what is a mistake."""

    duration: Positive
    force_limit: Positive
    torque_limit: Positive


class DroneParameters(Checked):
    """Name, body and starting place of the drone."""

    name: Name
    urdf: File
    position: Tuple[Finite, Finite, NonNegative]
    yaw: Finite


class PropellerParameters(Checked):
    """V-REP's particle law; see propeller.py."""

    law: Literal["3.x", "4.x"]
    particles_per_second: Positive
    particle_density: Positive
    particle_size: Positive
    torque_per_velocity: NonNegative
    velocity_limits: Limits


class ControlParameters(Checked):
    """The tutorial's gains; a child script reads them by name with getScriptSimulationParameter."""

    thrust_gravity: Positive
    thrust_limits: Limits
    Dthrust: NonNegative
    Kzref: NonNegative
    Dzref: NonNegative
    Dyaw: NonNegative
    angle_min: NonNegative
    angle_max: NonNegative
    Pangle: NonNegative
    Dangle: NonNegative
    Kvcorr: NonNegative
    recovery_margin: AngleOrNone
    Precovery: NonNegative


class MountParameters(Checked):
    """Where a camera sits that has no link in the URDF: in the frame of an object, looking along its +x."""

    parent: str
    position: Point
    rpy: Point

    @property
    def matrix(self) -> Matrix:
        """Parent from optical frame (z forward, x right, y down)."""
        return multiply(from_rpy(self.position, self.rpy), from_rpy((0, 0, 0), (-math.pi / 2, 0, -math.pi / 2)))


class CameraParameters(Checked):
    """A vision sensor: where it sits, what it sees."""

    object: Name
    topic: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_/]*$")]
    kind: Literal["color", "depth"]
    frame: Name
    mount: Optional[MountParameters] = None
    every: Annotated[int, Field(ge=1)]
    width: Annotated[int, Field(ge=1, le=8192)]
    height: Annotated[int, Field(ge=1, le=8192)]
    horizontal_fov: Annotated[float, Field(gt=0, lt=3.14)]
    near: Positive
    far: Positive


class Parameters(Checked):
    """Everything in config/drone.yaml."""

    gui: bool
    script: str
    script_time_limit: NonNegative
    real_time_factor: NonNegative
    cmd_vel_timeout: NonNegative
    cmd_vel_limits: TwistLimits
    position_limit: Positive
    push: PushParameters
    time_step: Positive
    sub_step: Positive
    gravity: Finite
    scene_file: str
    scene: SceneParameters
    drone: DroneParameters
    propellers: PropellerParameters
    control: ControlParameters
    samples: Literal[0, 2, 4, 8]
    cameras: Dict[Name, CameraParameters]
    _given: Dict[str, Any] = PrivateAttr(default_factory=dict)  # what stands without the scene file

    @property
    def sub_steps(self) -> int:
        """Number of Bullet steps in a simulation step."""
        return round(self.time_step / self.sub_step)

    def in_scene(self, file: str) -> Parameters:
        """Return the parameters with floor, objects and drone as a scene file says now. Raises ParameterError.

        '' is the scene that was given without a file.
        """
        return _in_scene(self._given, file)

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several keys at once."""
        if self.sub_steps < 1 or abs(self.sub_steps * self.sub_step - self.time_step) > 1e-9 * self.time_step:
            raise ParameterError(
                f"parameter time_step = {self.time_step}: must be a whole multiple of sub_step = {self.sub_step}"
            )
        for name, camera in self.cameras.items():
            if camera.near >= camera.far:
                raise ParameterError(
                    f"parameter cameras/{name}/near = {camera.near}: must be less than far = {camera.far}"
                )


def load(overrides: Optional[Mapping[str, Any]] = None) -> Parameters:
    """Return config/drone.yaml with `overrides` (a nested mapping of the same shape) laid over it.

    Raises ParameterError.
    """
    given = _merge(read_yaml(package_path() / "config" / "drone.yaml"), overrides or {})
    return _in_scene(given, given["scene_file"])


def _in_scene(given: Dict[str, Any], file: Any) -> Parameters:
    values = {**given, "scene_file": file}
    in_file = isinstance(file, str) and bool(file)
    if in_file:
        values = _merge(values, scene_parameters.read(file))
    try:
        parameters = Parameters.model_validate(values)
    except ValidationError as error:
        from_scene = in_file and error.errors()[0]["loc"][0] in ("scene", "drone")
        raise ParameterError(f"{file}: {_one_line(error)}" if from_scene else _one_line(error)) from None
    parameters._given = given
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
    key = "/".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return f"parameter {key}: unknown key{_near(first['loc'])}"
    message = first["msg"].replace("Value error, ", "")
    if not first["loc"]:  # of several keys at once: it names them itself
        return message
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    value = first["input"]
    shown = repr(value) if isinstance(value, str) else f"{value!r:.60}"
    return f"parameter {key} = {shown}: {message[0].lower()}{message[1:]}{more}"


def _near(location: Tuple[Union[int, str], ...]) -> str:
    model: Any = Parameters
    for part in location[:-1]:
        fields = getattr(model, "model_fields", {})
        model = fields[part].annotation if part in fields else SHAPES.get(str(part))
    known = list(getattr(model, "model_fields", {}))
    near = difflib.get_close_matches(str(location[-1]), known, n=3) or known
    return f"; known are {', '.join(near)}" if near else ""
