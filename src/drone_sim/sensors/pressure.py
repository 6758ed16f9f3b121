"""A barometer, and an altimeter that converts its pressure to height.

Pressure follows the International Standard Atmosphere (ISO 2533:1975): up to 11 km

    p = 101325 Pa · (1 - L h / T0)^(g0 M / (R L)),  L = 0.0065 K/m, T0 = 288.15 K, g0 M / (R L) = 5.25588

and above, at a constant 216.65 K, p = p(11 km) · exp(-g0 M (h - 11 km) / (R · 216.65 K)). h is the height above sea
level; the datum's altitude is used for it, although that is above the ellipsoid (48 m difference at Zürich).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from drone_sim.config.types import Name
from drone_sim.mechanics.frames import position
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Instrument, Mounting, Output, SensorParameters, Topic, xyz

_SEA_LEVEL = 101325.0  # Pa
_BASE_TEMPERATURE, _LAPSE = 288.15, 0.0065  # K, K/m
_AUTOCONVECTIVE_LAPSE = 9.80665 * 0.028964420 / 8.31432  # K/m, g0 M / R with the standard's constants
_EXPONENT = _AUTOCONVECTIVE_LAPSE / _LAPSE
_TROPOPAUSE = 11000.0  # m
_TOP_TEMPERATURE = _BASE_TEMPERATURE - _LAPSE * _TROPOPAUSE  # K
_TOP_PRESSURE = _SEA_LEVEL * (_TOP_TEMPERATURE / _BASE_TEMPERATURE) ** _EXPONENT  # Pa, at the tropopause


def pressure_at(height: float) -> float:
    """Return the pressure (Pa) of the standard atmosphere at a height above sea level (m)."""
    if height > _TROPOPAUSE:
        return _TOP_PRESSURE * math.exp(-_AUTOCONVECTIVE_LAPSE * (height - _TROPOPAUSE) / _TOP_TEMPERATURE)
    return _SEA_LEVEL * (1 - _LAPSE * height / _BASE_TEMPERATURE) ** _EXPONENT


def height_of(pressure: float) -> float:
    """Return the height above sea level (m) at which the standard atmosphere has this pressure (Pa, > 0)."""
    if pressure < _TOP_PRESSURE:
        return _TROPOPAUSE - math.log(pressure / _TOP_PRESSURE) * _TOP_TEMPERATURE / _AUTOCONVECTIVE_LAPSE
    return _BASE_TEMPERATURE / _LAPSE * (1 - (pressure / _SEA_LEVEL) ** (1 / _EXPONENT))


class PressureParameters(SensorParameters):
    """A barometer."""

    kind: Literal["pressure"]
    topic: Topic = "pressure"
    frame: Name = "imu_link"
    noise: NoiseParameters = NoiseParameters()  # Pa

    suffixes = ("", "/height")

    def make(self, mounting: Mounting) -> Pressure:
        return Pressure(self, mounting)


class PressureSample(NamedTuple):
    """Pressure (Pa), and the height above the scene's origin (m) computed from it."""

    pressure: float
    height: float


class Pressure(Instrument):
    """Measures the static pressure at the sensor."""

    parameters: PressureParameters

    def __init__(self, parameters: PressureParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        self._noise = self.make_noise(parameters.noise, 1)
        self.outputs = (
            Output("", "sensor_msgs/FluidPressure", self._message),
            Output("/height", "geometry_msgs/PointStamped", self._height),
        )

    def sample(self) -> PressureSample:
        """Return pressure and height, both with the noise of the pressure."""
        ground = self.carrier.datum.altitude
        (measured,) = self._noise.add((pressure_at(ground + position(self.mounting.pose())[2]),))
        return PressureSample(measured, height_of(max(measured, 1e-6)) - ground)

    def _message(self, value: PressureSample, header: Mapping[str, Any]) -> Fields:
        return {"header": header, "fluid_pressure": value.pressure, "variance": self._noise.variance}

    def _height(self, value: PressureSample, header: Mapping[str, Any]) -> Fields:
        return {"header": {**header, "frame_id": "world"}, "point": xyz((0.0, 0.0, value.height))}
