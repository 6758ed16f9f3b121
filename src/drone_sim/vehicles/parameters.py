"""What a vehicle may be: name, body, place, script, propellers, gains, sensors, and the limits of its commands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PrivateAttr

from drone_sim.config.types import (
    Angle,
    Checked,
    Coordinate,
    File,
    FileName,
    Finite,
    Gain,
    Label,
    Limits,
    MarginOrNone,
    Name,
    ParameterError,
    ScriptValue,
    Within,
    merged,
)
from drone_sim.forces import ForceParameters
from drone_sim.forces.propellers import PropellerParameters
from drone_sim.mechanics.object_names import NO_SUFFIX
from drone_sim.sensors import AnySensor
from drone_sim.sensors.camera_parameters import MAX_CAMERAS, CameraParameters
from drone_sim.sensors.together import check_together
from drone_sim.vehicles.fault_parameters import FaultParameters
from drone_sim.vehicles.object_places import ObjectPlace
from drone_sim.vehicles.quadricopter_objects import OWN_NAMES
from drone_sim.wording import near_names

UNPREFIXED = "drone"  # the name with which the only vehicle has frames without a prefix
MAX_FORCES = 16
MAX_SENSORS = 64
MAX_SCRIPT_PARAMETERS = 256


class TwistLimits(Checked):
    """Beyond these a command is a mistake."""

    linear: Annotated[Finite, Within(1e-6, 1e3)]
    angular: Annotated[Finite, Within(1e-6, 1e3)]


class PushParameters(Checked):
    """How long a push on the topic `push` lasts, and what is a mistake."""

    duration: Annotated[Finite, Within(1e-4, 1e4)]
    force_limit: Annotated[Finite, Within(1e-6, 1e6)]
    torque_limit: Annotated[Finite, Within(1e-6, 1e6)]


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


def _own(places: Mapping[str, ObjectPlace]) -> Mapping[str, ObjectPlace]:
    for name in places:
        if name not in OWN_NAMES:
            raise ValueError(f"'{name}' is no object of a vehicle; {near_names(name, OWN_NAMES)}")
    return places


class PlaceParameters(Checked):
    """Body and starting place of a vehicle; `tilt` is roll and pitch (rad).

    `suffix` is that of its objects' names: -1 is none, 0 is #0, ...; left out, it is the next that is free.
    """

    urdf: File
    position: Annotated[
        tuple[Coordinate, Coordinate, Annotated[Finite, Within(0, 1e5)]], Field(description="3 numbers, [x, y, z] in m")
    ]
    yaw: Angle
    tilt: Annotated[tuple[Angle, Angle], Field(description="2 numbers, [roll, pitch] in rad")] = (0.0, 0.0)
    suffix: Annotated[int, Within(NO_SUFFIX, 1_000_000)] | None = None
    objects: Annotated[dict[Label, ObjectPlace], AfterValidator(_own)] = Field(default_factory=dict)


class DroneParameters(PlaceParameters):
    """Name, body and starting place of the drone."""

    name: Name


class EquipmentParameters(Checked):
    """What a vehicle carries and obeys; of the only vehicle these keys stand at the top."""

    script: FileName
    start: Literal["flying", "landed"]
    takeoff_height: Annotated[Finite, Within(0.05, 1e3)]
    cmd_vel_timeout: Annotated[Finite, Within(1e-4, 1e6, or_zero=True)]
    cmd_vel_limits: TwistLimits
    position_limit: Annotated[Finite, Within(1e-3, 1e5)]
    push: PushParameters
    propellers: PropellerParameters
    control: ControlParameters
    script_parameters: Annotated[dict[Label, ScriptValue], Field(max_length=MAX_SCRIPT_PARAMETERS)]
    cameras: Annotated[dict[Name, CameraParameters], Field(max_length=MAX_CAMERAS)]
    sensors: Annotated[dict[Name, AnySensor], Field(max_length=MAX_SENSORS)]
    forces: Annotated[dict[Name, ForceParameters], Field(max_length=MAX_FORCES)]
    faults: FaultParameters

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several keys at once."""
        check_together(self.cameras, self.sensors)
        self.check_faults()

    def check_faults(self) -> None:
        """Raise ParameterError for a fault of a sensor that it has not."""
        self.faults.check([*self.sensors, *self.cameras])


class VehicleParameters(EquipmentParameters, PlaceParameters):
    """One vehicle: an entry of `vehicles`, or what `drone` and the keys beside it say of the only one."""

    name: Name
    _is_alone: bool = PrivateAttr(default=False)

    @classmethod
    def only(cls, drone: DroneParameters, equipment: EquipmentParameters) -> VehicleParameters:
        """Return the only vehicle of a simulation."""
        place = {key: getattr(drone, key) for key in DroneParameters.model_fields}
        carried = {key: getattr(equipment, key) for key in EquipmentParameters.model_fields}
        return cls.model_construct(**place, **carried).alone()

    def alone(self) -> VehicleParameters:
        """Return the same for a vehicle that flies alone."""
        made = self.model_copy()
        made._is_alone = True
        return made

    @property
    def is_alone(self) -> bool:
        """Whether it begins as the only one."""
        return self._is_alone

    @property
    def frame_prefix(self) -> str:
        """What its frames' names begin with: `drone1/`, or '' of the only one, where it has its usual name."""
        return "" if self._is_alone and self.name == UNPREFIXED else f"{self.name}/"


def laid_over(entry: Mapping[str, Any], name: str, everything: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry of `vehicles` with what it leaves out, from the keys at the top. Raises ParameterError."""
    if "name" in entry:
        raise ParameterError(
            f"parameter vehicles/{name}/name: unknown key; the entry's own key is its name", ("vehicles", name, "name")
        )
    drone = everything.get("drone")
    base = {key: everything[key] for key in EquipmentParameters.model_fields if key in everything}
    place = {key: value for key, value in drone.items() if key != "name"} if isinstance(drone, Mapping) else {}
    return {**merged({**base, **place}, entry), "name": name}
