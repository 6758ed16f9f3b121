"""What measures: each sensor with its period, its pose, its noise and its last sample.

A new kind is a file of its own, with its parameters and its instrument, and its line in KINDS. Cameras are sensors, too,
with parameters of their own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Union

from pydantic import Field

from drone_sim.sensors.battery import Battery, BatteryParameters
from drone_sim.sensors.contacts import Contacts, ContactsParameters
from drone_sim.sensors.fix import Fix, FixParameters
from drone_sim.sensors.imu import Imu, ImuParameters
from drone_sim.sensors.magnetic_field import MagneticField, MagneticFieldParameters
from drone_sim.sensors.parameters import SensorParameters
from drone_sim.sensors.pressure import Pressure, PressureParameters
from drone_sim.sensors.range import Range, RangeParameters
from drone_sim.sensors.sensor import Carrier, Contact, Fitting, Hit, Instrument, Reading

__all__ = ["KINDS", "AnySensor", "Carrier", "Contact", "Fitting", "Hit", "Instrument", "Reading", "create"]

KINDS: dict[type[SensorParameters], type[Instrument]] = {
    ImuParameters: Imu,
    RangeParameters: Range,
    MagneticFieldParameters: MagneticField,
    PressureParameters: Pressure,
    FixParameters: Fix,
    ContactsParameters: Contacts,
    BatteryParameters: Battery,
}

if TYPE_CHECKING:  # a union that is made of a list is none for mypy
    AnySensor = SensorParameters
else:
    AnySensor = Annotated[Union[tuple(KINDS)], Field(discriminator="kind")]  # noqa: UP007


def create(parameters: SensorParameters, fitting: Fitting) -> Instrument:
    """Return the instrument that these parameters describe, ready for the first sub-step."""
    instrument = KINDS[type(parameters)](parameters, fitting)
    instrument.reset()
    return instrument
