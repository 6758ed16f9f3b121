"""What a vehicle may be: name, body, place, script, propellers, gains, sensors, and the limits of its commands."""

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
from drone_sim.vehicles.quadricopter_objects import REMOVABLE, ObjectPlace, own_names
from drone_sim.vehicles.radio_link import LinkParameters
from drone_sim.vehicles.types import TYPES, propeller_places
from drone_sim.vehicles.types.quadricopter import Quadricopter

UNPREFIXED = "drone"  # the name with which the only vehicle has frames without a prefix
MAX_FORCES = 16
MAX_SENSORS = 64
MAX_SCRIPT_PARAMETERS = 256
MAX_FAILURES = 80


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


class FaultParameters(Checked):
    """What is wrong: `commands` and `images` are the radio link's two directions, `sensors` are cameras, too."""

    propellers: Annotated[
        tuple[Fraction, ...],
        Parts(propeller_places(Quadricopter.name)),
        Field(description="numbers from 0 to 1, the fraction of its thrust that each propeller still has"),
    ]
    commands: LinkParameters
    images: LinkParameters
    sensors: Annotated[dict[Name, Failure], Field(max_length=MAX_FAILURES)]
    seed: Annotated[int, Within(0, 2**63 - 1)]

    def check(self, names: Collection[str], propellers: int) -> None:
        """Raise ParameterError for a sensor that is not among the names, or a wrong number of propellers.

        The numbers of config/drone.yaml, as many as a quadricopter has, are allowed for every vehicle.
        """
        if len(self.propellers) not in (propellers, len(Quadricopter.rotors)):
            given = f"[{', '.join(f'{share:g}' for share in self.propellers)}]"
            must = f"must be {propellers} numbers from 0 to 1, the share that each propeller still gives"
            raise ParameterError(must, ("faults", "propellers"), given)
        for name in self.sensors:
            if name not in names:
                said = f"no such sensor or camera; {near_names(name, names)}" if names else "there are no sensors"
                raise ParameterError(said, ("faults", "sensors", name))


def _own(places: Mapping[str, ObjectPlace | None], info: ValidationInfo) -> Mapping[str, ObjectPlace | None]:
    known = own_names(len(propeller_places(info.data.get("type", Quadricopter.name))))
    for name, place in places.items():
        if name not in known:
            raise ValueError(f"'{name}' is not an object of a vehicle; {near_names(name, known)}")
        if place is None and name not in REMOVABLE:
            raise ValueError(f"'{name}': a vehicle needs it; null removes only {', '.join(REMOVABLE)}")
    return places


def _type(name: str) -> str:
    if name not in TYPES:
        raise ValueError(f"no such type; {near_names(name, TYPES)}")
    return name


class PlaceParameters(Checked):
    """Type, body and starting place of a vehicle; `tilt` is roll and pitch (rad).

    `suffix` is that of its objects' names: -1 is none, 0 is #0, ...; left out, it is the next that is free.
    """

    type: Annotated[str, AfterValidator(_type)]
    urdf: File
    position: Annotated[
        tuple[Coordinate, Coordinate, Annotated[Finite, Within(0, 1e5)]], Field(description="3 numbers, [x, y, z] in m")
    ]
    yaw: Angle
    tilt: Annotated[tuple[Angle, Angle], Field(description="2 numbers, [roll, pitch] in rad")] = (0.0, 0.0)
    suffix: Annotated[int, Within(NO_SUFFIX, 1_000_000)] | None = None
    objects: Annotated[dict[Label, ObjectPlace | None], AfterValidator(_own)] = Field(default_factory=dict)

    @property
    def matrix(self) -> Matrix:
        """Where it begins, in the world."""
        return from_rpy(self.position, (*self.tilt, self.yaw))


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
        check_sensors(self.cameras, self.sensors)
        self.check_faults()

    def check_faults(self) -> None:
        """Raise ParameterError for a fault of a sensor or propeller that the vehicle does not have.

        The keys at the top of a file belong to vehicles of any type, so their number of propellers is not checked.
        """
        propellers = len(propeller_places(getattr(self, "type", ""))) or len(self.faults.propellers)
        self.faults.check([*self.sensors, *self.cameras], propellers)


class VehicleParameters(EquipmentParameters, PlaceParameters):
    """One vehicle: an entry of `vehicles`, or what `drone` and the keys beside it say of the only one."""

    name: Name
    _is_alone: bool = PrivateAttr(default=False)

    @classmethod
    def only(cls, drone: DroneParameters, equipment: EquipmentParameters) -> VehicleParameters:
        """Return the only vehicle of a simulation."""
        place = {key: getattr(drone, key) for key in DroneParameters.model_fields}
        carried = {key: getattr(equipment, key) for key in EquipmentParameters.model_fields}
        made = cls.model_construct(**place, **carried).alone()
        made.check_faults()
        return made

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
    """Return an entry of `vehicles` with what it leaves out, from the keys at the top; without cameras that are null.

    Raises ParameterError.
    """
    if "name" in entry:
        raise ParameterError("unknown key; a vehicle is named by the key of its entry", ("vehicles", name, "name"))
    drone = everything.get("drone")
    base = {key: everything[key] for key in EquipmentParameters.model_fields if key in everything}
    place = {key: value for key, value in drone.items() if key != "name"} if isinstance(drone, Mapping) else {}
    whole = merged({**base, **place}, entry)
    for key in ("cameras", "sensors"):
        if isinstance(whole.get(key), Mapping):
            whole[key] = {one: value for one, value in whole[key].items() if value is not None}
    return {**whole, "name": name}
