"""Parameters of a vehicle: name, body, start pose, script, propellers, gains, sensors and command limits."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PrivateAttr, ValidationInfo

from drone_sim.config.types import (
    Angle,
    Checked,
    Coordinate,
    File,
    FileName,
    Finite,
    Fraction,
    Gain,
    Label,
    Limits,
    MarginOrNone,
    Name,
    ParameterError,
    Parts,
    ScriptValue,
    Unit,
    Within,
    merged,
)
from drone_sim.forces import ForceParameters
from drone_sim.forces.propellers import PropellerParameters
from drone_sim.mechanics.frames import Matrix, from_rpy
from drone_sim.mechanics.object_names import NO_SUFFIX
from drone_sim.message_text import near_names
from drone_sim.sensors import AnySensor
from drone_sim.sensors.camera_parameters import MAX_CAMERAS, CameraParameters
from drone_sim.sensors.sensor import Failure
from drone_sim.sensors.validation import check_sensors
from drone_sim.vehicles.driver import MAX_TOPICS, CommandMeaning, DriverTopic
from drone_sim.vehicles.quadricopter_objects import REMOVABLE, ObjectPlace, own_names
from drone_sim.vehicles.radio_link import LinkParameters
from drone_sim.vehicles.types import QUADRICOPTER, TYPES, propeller_places

UNPREFIXED = "drone"  # a single vehicle of this name has frames without a prefix
MAX_FORCES = 16
MAX_SENSORS = 64
MAX_SCRIPT_PARAMETERS = 256
MAX_FAILURES = 80


class TwistLimits(Checked):
    """Largest accepted velocity command (m/s, rad/s)."""

    linear: Annotated[Finite, Within(1e-6, 1e3)]
    angular: Annotated[Finite, Within(1e-6, 1e3)]


class PushParameters(Checked):
    """Duration (s) of a push on the topic `push`, and its largest accepted force (N) and torque (N m)."""

    duration: Annotated[Finite, Within(1e-4, 1e4)]
    force_limit: Annotated[Finite, Within(1e-6, 1e6)]
    torque_limit: Annotated[Finite, Within(1e-6, 1e6)]


class ControlParameters(Checked):
    """The tutorial's control gains; a child script reads them by name with getScriptSimulationParameter."""

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


class FaultParameters(Checked):
    """Faults: `commands` and `images` are the two directions of the radio link; `sensors` includes cameras."""

    propellers: Annotated[
        tuple[Fraction, ...],
        Parts(QUADRICOPTER.places),
        Field(description="numbers from 0 to 1, the fraction of its thrust that each propeller still has"),
    ]
    commands: LinkParameters
    images: LinkParameters
    sensors: Annotated[dict[Name, Failure], Field(max_length=MAX_FAILURES)]
    seed: Annotated[int, Within(0, 2**63 - 1)]

    def check(self, names: Collection[str], propellers: int) -> None:
        """Raise ParameterError for a sensor that is not in `names`, or a wrong number of propellers.

        A quadricopter's number of propellers, as in config/drone.yaml, is allowed for every vehicle.
        """
        if len(self.propellers) not in (propellers, len(QUADRICOPTER.rotors)):
            value = f"[{', '.join(f'{share:g}' for share in self.propellers)}]"
            expected = f"must be {propellers} numbers from 0 to 1, the fraction of its thrust that each propeller has"
            raise ParameterError(expected, ("faults", "propellers"), value)
        for name in self.sensors:
            if name not in names:
                problem = f"no such sensor or camera; {near_names(name, names)}" if names else "there are no sensors"
                raise ParameterError(problem, ("faults", "sensors", name))


def _check_names(places: Mapping[str, ObjectPlace | None], info: ValidationInfo) -> Mapping[str, ObjectPlace | None]:
    known = own_names(len(propeller_places(info.data.get("type", QUADRICOPTER.name))))
    for name, place in places.items():
        if name not in known:
            raise ValueError(f"'{name}' is not an object of a vehicle; {near_names(name, known)}")
        if place is None and name not in REMOVABLE:
            raise ValueError(f"'{name}' cannot be removed; null is allowed only for {', '.join(REMOVABLE)}")
    return places


def _check_type(name: str) -> str:
    if name not in TYPES:
        raise ValueError(f"no such type; {near_names(name, TYPES)}")
    return name


class PlaceParameters(Checked):
    """Type, body and start pose of a vehicle; `tilt` is roll and pitch (rad).

    `suffix` is that of its objects' names: -1 is none, 0 is #0, ...; the default is the next free one.
    """

    type: Annotated[str, AfterValidator(_check_type)]
    urdf: File
    position: Annotated[
        tuple[Coordinate, Coordinate, Annotated[Finite, Within(0, 1e5)]], Field(description="3 numbers, [x, y, z] in m")
    ]
    yaw: Angle
    tilt: Annotated[tuple[Angle, Angle], Field(description="2 numbers, [roll, pitch] in rad")] = (0.0, 0.0)
    suffix: Annotated[int, Within(NO_SUFFIX, 1_000_000)] | None = None
    objects: Annotated[dict[Label, ObjectPlace | None], AfterValidator(_check_names)] = Field(default_factory=dict)

    @property
    def matrix(self) -> Matrix:
        """World from root link at the start."""
        return from_rpy(self.position, (*self.tilt, self.yaw))


class DroneParameters(PlaceParameters):
    """Name, body and start pose of the drone."""

    name: Name


class EquipmentParameters(Checked):
    """Equipment and limits of a vehicle; for a single vehicle these keys are at the top level of the file."""

    script: FileName
    start: Literal["flying", "landed"]
    takeoff_height: Annotated[Finite, Within(0.05, 1e3), Unit("m")]
    cmd_vel_timeout: Annotated[Finite, Within(1e-4, 1e6, or_zero=True), Unit("s")]
    cmd_vel_limits: TwistLimits
    cmd_vel_meaning: CommandMeaning
    topics: Annotated[dict[Name, DriverTopic], Field(max_length=MAX_TOPICS)]
    position_limit: Annotated[Finite, Within(1e-3, 1e5), Unit("m")]
    push: PushParameters
    propellers: PropellerParameters
    control: ControlParameters
    script_parameters: Annotated[dict[Label, ScriptValue], Field(max_length=MAX_SCRIPT_PARAMETERS)]
    cameras: Annotated[dict[Name, CameraParameters], Field(max_length=MAX_CAMERAS)]
    sensors: Annotated[dict[Name, AnySensor], Field(max_length=MAX_SENSORS)]
    forces: Annotated[dict[Name, ForceParameters], Field(max_length=MAX_FORCES)]
    faults: FaultParameters

    def model_post_init(self, _context: Any) -> None:
        """Check keys that depend on each other."""
        check_sensors(self.cameras, self.sensors)
        self.check_faults()

    def check_faults(self) -> None:
        """Raise ParameterError for a fault of a sensor or propeller that the vehicle does not have.

        Keys at the top level of a file apply to vehicles of any type: their number of propellers is not checked.
        """
        propellers = len(propeller_places(getattr(self, "type", ""))) or len(self.faults.propellers)
        self.faults.check([*self.sensors, *self.cameras], propellers)


class VehicleParameters(EquipmentParameters, PlaceParameters):
    """One vehicle: an entry of `vehicles`, completed from `drone` and the keys at the top level."""

    name: Name
    _is_alone: bool = PrivateAttr(default=False)

    def alone(self) -> VehicleParameters:
        """Return a copy marked as the simulation's single vehicle."""
        copy = self.model_copy()
        copy._is_alone = True
        return copy

    @property
    def is_alone(self) -> bool:
        """Whether this is the simulation's single vehicle at the start."""
        return self._is_alone

    @property
    def frame_prefix(self) -> str:
        """Prefix of its frame names, such as `drone1/`; '' for a single vehicle named `drone`."""
        return "" if self._is_alone and self.name == UNPREFIXED else f"{self.name}/"


def laid_over(entry: Mapping[str, Any], name: str, everything: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry of `vehicles` completed from `everything`, the keys at the top level of the file.

    Cameras, sensors and topics that are null are left out. Raises ParameterError.
    """
    if "name" in entry:
        raise ParameterError("unknown key; a vehicle is named by the key of its entry", ("vehicles", name, "name"))
    drone = everything.get("drone")
    base = {key: everything[key] for key in EquipmentParameters.model_fields if key in everything}
    place = {key: value for key, value in drone.items() if key != "name"} if isinstance(drone, Mapping) else {}
    result = merged({**base, **place}, entry)
    for key in ("cameras", "sensors", "topics"):
        if isinstance(result.get(key), Mapping):
            result[key] = {item: value for item, value in result[key].items() if value is not None}
    return {**result, "name": name}
