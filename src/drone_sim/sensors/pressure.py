"""A barometer, and the height that an altimeter makes of it.

Pressure over height is that of the International Standard Atmosphere (ISO 2533:1975): up to 11 km

    p = 101325 Pa · (1 - L h / T0)^(g0 M / (R L)),  L = 0.0065 K/m, T0 = 288.15 K, g0 M / (R L) = 5.25588

and above, where it is 216.65 K throughout, p = p(11 km) · exp(-g0 M (h - 11 km) / (R · 216.65 K)). Its height is above
the sea; the datum's altitude is taken for that, though it counts from the ellipsoid (48 m apart at Zürich).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from drone_sim.config.types import Name
from drone_sim.mechanics.frames import position
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Fitting, Instrument, Output, SensorParameters, Topic, xyz

_SEA_LEVEL = 101325.0  # Pa
_WARMTH, _LAPSE = 288.15, 0.0065  # K, K/m
_WEIGHT = 9.80665 * 0.028964420 / 8.31432  # K/m, g0 M / R with the standard's own numbers
_EXPONENT = _WEIGHT / _LAPSE
_TROPOPAUSE = 11000.0  # m
_COLD = _WARMTH - _LAPSE * _TROPOPAUSE  # K
_ALOFT = _SEA_LEVEL * (_COLD / _WARMTH) ** _EXPONENT  # Pa, at the tropopause


def pressure_at(height: float) -> float:
    """Return the standard atmosphere's pressure (Pa) at a height above the sea (m)."""
    if height > _TROPOPAUSE:
        return _ALOFT * math.exp(-_WEIGHT * (height - _TROPOPAUSE) / _COLD)
    return _SEA_LEVEL * (1 - _LAPSE * height / _WARMTH) ** _EXPONENT


def height_of(pressure: float) -> float:
    """Return the height above the sea (m) at which the standard atmosphere has a pressure (Pa, more than 0)."""
    if pressure < _ALOFT:
        return _TROPOPAUSE - math.log(pressure / _ALOFT) * _COLD / _WEIGHT
    return _WARMTH / _LAPSE * (1 - (pressure / _SEA_LEVEL) ** (1 / _EXPONENT))


class PressureParameters(SensorParameters):
    """A barometer."""

    kind: Literal["pressure"]
    topic: Topic = "pressure"
    frame: Name = "imu_link"
    noise: NoiseParameters = NoiseParameters()  # Pa

    suffixes = ("", "/height")

    def make(self, fitting: Fitting) -> Pressure:
        """Return the instrument; `reset` comes before its first look."""
        return Pressure(self, fitting)


class PressureSample(NamedTuple):
    """Pressure (Pa), and the height above the scene's origin (m) that it means."""

    pressure: float
    height: float


class Pressure(Instrument):
    """Measures the pressure of the still air around it."""

    parameters: PressureParameters

    def __init__(self, parameters: PressureParameters, fitting: Fitting):
        """Take what it is like and where it sits."""
        super().__init__(parameters, fitting)
        self._noise = self.make_noise(parameters.noise, 1)
        self.outputs = (
            Output("", "sensor_msgs/FluidPressure", self._message),
            Output("/height", "geometry_msgs/PointStamped", self._height),
        )

    def sample(self) -> PressureSample:
        """Return pressure and height."""
        ground = self.carrier.datum.altitude
        (measured,) = self._noise.add((pressure_at(ground + position(self.fitting.pose())[2]),))
        return PressureSample(measured, height_of(max(measured, 1e-6)) - ground)

    def _message(self, value: PressureSample, header: Mapping[str, Any]) -> Fields:
        return {"header": header, "fluid_pressure": value.pressure, "variance": self._noise.variance}

    def _height(self, value: PressureSample, header: Mapping[str, Any]) -> Fields:
        return {"header": {**header, "frame_id": "world"}, "point": xyz((0.0, 0.0, value.height))}
