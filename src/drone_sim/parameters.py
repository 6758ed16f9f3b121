"""The numbers of config/*.yaml, checked once when read, frozen after that.

No value is defined here: config/drone.yaml holds every default, this module says what is allowed.
"""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any, Dict, List, Literal, Mapping, Optional, Tuple, Union

import yaml
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from typing_extensions import Annotated

from drone_sim.frames import Matrix, from_rpy, multiply
from drone_sim.resources import package_path, resolve


class ParameterError(ValueError):
    """A parameter is wrong; the message is one line that names key, value and what is allowed."""


def _existing_file(name: str) -> str:
    try:
        return str(resolve(name))
    except FileNotFoundError as error:
        raise ValueError(str(error)) from None


def _none_from_word(value: Any) -> Any:
    # ROS's parameter server cannot hold YAML's null.
    return None if value in ("none", "null", "", []) else value


def _increasing(pair: Optional[Tuple[float, float]]) -> Optional[Tuple[float, float]]:
    if pair is not None and not pair[0] < pair[1]:
        raise ValueError("must be [lowest, highest] with lowest < highest")
    return pair


Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Point = Tuple[Finite, Finite, Finite]
Fraction = Annotated[float, Field(ge=0, le=1)]
Color = Tuple[Fraction, Fraction, Fraction, Fraction]
File = Annotated[str, AfterValidator(_existing_file)]
OptionalFile = Annotated[str, AfterValidator(lambda name: _existing_file(name) if name else "")]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
Limits = Annotated[Optional[Tuple[Finite, Finite]], BeforeValidator(_none_from_word), AfterValidator(_increasing)]


class _Parameters(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class TwistLimits(_Parameters):
    """Beyond these a command is a mistake."""

    linear: Positive
    angular: Positive


class PushParameters(_Parameters):
    """How long a push on the topic `push` lasts, and what is a mistake."""

    duration: Positive
    force_limit: Positive
    torque_limit: Positive


class FloorParameters(_Parameters):
    """A square floor at z = 0, centred on the origin."""

    size: Positive
    texture: File


class _ObjectParameters(_Parameters):
    """What the objects of a scene have in common; a mass of 0 stands still."""

    name: str = ""
    position: Point
    rpy: Point = (0.0, 0.0, 0.0)
    mass: NonNegative = 0.0
    color: Color = (0.7, 0.7, 0.7, 1.0)
    texture: OptionalFile = ""


class BoxParameters(_ObjectParameters):
    """A box; `size` is its full length, width and height."""

    shape: Literal["box"]
    size: Tuple[Positive, Positive, Positive]


class CylinderParameters(_ObjectParameters):
    """A cylinder along its z axis; `size` is radius and length."""

    shape: Literal["cylinder"]
    size: Tuple[Positive, Positive]


class SphereParameters(_ObjectParameters):
    """A sphere; `size` is its radius."""

    shape: Literal["sphere"]
    size: Tuple[Positive]


class MeshParameters(_ObjectParameters):
    """A mesh file (OBJ, STL, DAE); `size` is its scale along x, y and z."""

    shape: Literal["mesh"]
    file: File
    size: Tuple[Positive, Positive, Positive] = (1.0, 1.0, 1.0)
    color: Color = (1.0, 1.0, 1.0, 1.0)


class UrdfParameters(_ObjectParameters):
    """A URDF, which says itself how it looks; a mass of 0 nails its root link to the world."""

    shape: Literal["urdf"]
    file: File
    size: Tuple[()] = ()


ObjectParameters = Annotated[
    Union[BoxParameters, CylinderParameters, SphereParameters, MeshParameters, UrdfParameters],
    Field(discriminator="shape"),
]


class SceneParameters(_Parameters):
    """The world without the drone."""

    floor: FloorParameters
    objects: List[ObjectParameters]


class DroneParameters(_Parameters):
    """Name, body and starting place of the drone."""

    name: Name
    urdf: File
    position: Point
    yaw: Finite


class PropellerParameters(_Parameters):
    """V-REP's particle law; see propeller.py."""

    law: Literal["3.x", "4.x"]
    particles_per_second: Positive
    particle_density: Positive
    particle_size: Positive
    torque_per_velocity: NonNegative


class ControlParameters(_Parameters):
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


class MountParameters(_Parameters):
    """Where a camera sits that has no link in the URDF: in the frame of an object, looking along its +x."""

    parent: str
    position: Point
    rpy: Point

    @property
    def matrix(self) -> Matrix:
        """Parent from optical frame (z forward, x right, y down)."""
        return multiply(from_rpy(self.position, self.rpy), from_rpy((0, 0, 0), (-math.pi / 2, 0, -math.pi / 2)))


class CameraParameters(_Parameters):
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


class Parameters(_Parameters):
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
    cameras: Dict[Name, CameraParameters]

    @property
    def sub_steps(self) -> int:
        """Number of Bullet steps in a simulation step."""
        return round(self.time_step / self.sub_step)

    def with_scene_read_again(self) -> Parameters:
        """Return the parameters with floor, objects and drone as the scene file says now. Raises ParameterError."""
        if not self.scene_file:
            return self
        return _checked(_merge(self.model_dump(), _scene(self.scene_file)))

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several keys at once."""
        if self.sub_steps < 1 or abs(self.sub_steps * self.sub_step - self.time_step) > 1e-9 * self.time_step:
            raise ParameterError(
                f"parameter time_step = {self.time_step}: must be a whole multiple of sub_step = {self.sub_step}"
            )
        for name, camera in self.cameras.items():
            if camera.near >= camera.far:
                raise ParameterError(f"parameter cameras/{name}/near = {camera.near}: must be less than far = {camera.far}")


def load(overrides: Optional[Mapping[str, Any]] = None) -> Parameters:
    """Return config/drone.yaml with `overrides` (a nested mapping of the same shape) laid over it.

    Raises ParameterError.
    """
    values = _merge(read_yaml(package_path() / "config" / "drone.yaml"), overrides or {})
    if values["scene_file"]:
        values = _merge(values, _scene(values["scene_file"]))
    return _checked(values)


def _checked(values: Dict[str, Any]) -> Parameters:
    try:
        return Parameters.model_validate(values)
    except ValidationError as error:
        raise ParameterError(_one_line(error)) from None


def _scene(file: str) -> Dict[str, Any]:
    """Return a scene file's floor, objects and drone as they stand among the parameters."""
    try:
        content = read_yaml(resolve(file))
    except FileNotFoundError as error:
        raise ParameterError(f"parameter scene_file = '{file}': {error}") from None
    unknown = set(content) - {"floor", "objects", "drone"}
    if unknown:
        raise ParameterError(f"{file}: unknown key {min(unknown)}; known are drone, floor, objects")
    scene = {"scene": {key: content[key] for key in ("floor", "objects") if key in content}}
    return {**scene, "drone": content.get("drone", {})}


def read_yaml(path: Union[str, Path]) -> Dict[str, Any]:
    """Return the mapping in a YAML file; raises ParameterError, in one line, where there is none."""
    try:
        values = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path}: {' '.join(str(error).split())}") from None
    if not isinstance(values, dict):
        raise ParameterError(f"{path}: must hold `key: value` lines, not {type(values).__name__}")
    return values


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
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    return f"parameter {key} = {first['input']!r}: {message[0].lower()}{message[1:]}{more}"


def _near(location: Tuple[Union[int, str], ...]) -> str:
    model: Any = Parameters
    for part in location[:-1]:
        fields = getattr(model, "model_fields", {})
        model = fields[part].annotation if part in fields else None
    known = list(getattr(model, "model_fields", {}))
    near = difflib.get_close_matches(str(location[-1]), known, n=3) or known
    return f"; known are {', '.join(near)}" if near else ""
