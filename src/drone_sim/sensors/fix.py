"""A satellite receiver: sensor_msgs/NavSatFix, from where the scene's origin lies on the Earth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from drone_sim.config.types import Checked, Name
from drone_sim.mechanics import geodesy
from drone_sim.mechanics.frames import Vector, position
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.parameters import SensorParameters, Topic
from drone_sim.sensors.sensor import Fields, Fitting, Instrument, Output, diagonal

_FIX, _GPS = 0, 1  # sensor_msgs/NavSatStatus: STATUS_FIX, SERVICE_GPS
_UNKNOWN, _DIAGONAL = 0, 2  # sensor_msgs/NavSatFix: COVARIANCE_TYPE_


class FixNoise(Checked):
    """What is wrong with where it says that it is."""

    horizontal: NoiseParameters = NoiseParameters()  # m, east and north
    vertical: NoiseParameters = NoiseParameters()  # m


class FixParameters(SensorParameters):
    """A satellite receiver that always has a fix."""

    kind: Literal["fix"]
    topic: Topic = "fix"
    frame: Name = "gps_link"
    noise: FixNoise = FixNoise()

    def make(self, fitting: Fitting) -> Fix:
        """Return the instrument; `reset` comes before its first look."""
        return Fix(self, fitting)


class Fix(Instrument):
    """Measures latitude, longitude (degrees) and height above the ellipsoid of WGS 84 (m)."""

    parameters: FixParameters

    def __init__(self, parameters: FixParameters, fitting: Fitting):
        """Take what it is like and where it sits."""
        super().__init__(parameters, fitting)
        self._horizontal = self.make_noise(parameters.noise.horizontal, 2)
        self._vertical = self.make_noise(parameters.noise.vertical, 1)
        self.outputs = (Output("", "sensor_msgs/NavSatFix", self._message),)

    def sample(self) -> Vector:
        """Return latitude, longitude and altitude."""
        x, y, z = position(self.fitting.pose())
        datum = self.carrier.datum
        local = (*self._horizontal.add((x, y)), *self._vertical.add((z,)))
        return geodesy.geodetic(local, (datum.latitude, datum.longitude, datum.altitude))

    def _message(self, value: Vector, header: Mapping[str, Any]) -> Fields:
        latitude, longitude, altitude = value
        across, up = self._horizontal.variance, self._vertical.variance
        return {
            "header": header,
            "status": {"status": _FIX, "service": _GPS},
            "latitude": latitude,
            "longitude": longitude,
            "altitude": altitude,
            "position_covariance": diagonal(across, across, up),
            "position_covariance_type": _DIAGONAL if across or up else _UNKNOWN,
        }
