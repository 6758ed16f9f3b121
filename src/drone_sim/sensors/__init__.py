"""What measures: each sensor with its period, its pose, its noise and its last sample.

A kind that `sensors:` may name has its line here. Cameras are sensors too, with parameters of their own.
"""

from __future__ import annotations

from drone_sim.config.types import one_of
from drone_sim.sensors.battery import BatteryParameters
from drone_sim.sensors.contacts import ContactsParameters
from drone_sim.sensors.fix import FixParameters
from drone_sim.sensors.imu import ImuParameters
from drone_sim.sensors.magnetic_field import MagneticFieldParameters
from drone_sim.sensors.pressure import PressureParameters
from drone_sim.sensors.range import RangeParameters
from drone_sim.sensors.wind import WindParameters

SENSORS = (
    ImuParameters,
    RangeParameters,
    MagneticFieldParameters,
    PressureParameters,
    FixParameters,
    ContactsParameters,
    BatteryParameters,
    WindParameters,
)

AnySensor = one_of(*SENSORS)
