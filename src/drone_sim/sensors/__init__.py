"""The sensors of vehicles. Each has a period, a pose, noise and a latest sample.

`SENSORS` lists the kinds allowed under the key `sensors`. Cameras are sensors too, under the key `cameras`.
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
