"""A satellite receiver: sensor_msgs/NavSatFix, for a scene whose origin is at the datum on the Earth.

Geodetic positions are latitude and longitude (degrees) and height above the ellipsoid of WGS 84 (m). Constants:
NGA.STND.0036, World Geodetic System 1984, version 1.0.0 (2014). The local frame is the plane tangent to the ellipsoid
at the datum: x east, y north, z up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, cos, degrees, hypot, radians, sin, sqrt
from typing import Any, Literal

from drone_sim.config.types import Checked, Name
from drone_sim.mechanics.frames import Matrix, Vector, position, transform
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Instrument, Mounting, Output, SensorParameters, Topic, diagonal

SEMI_MAJOR = 6378137.0  # m
FLATTENING = 1 / 298.257223563
_ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)
_ITERATIONS = 5  # each reduces the error, some metres at first, by a factor of 150: far below 1e-6 m


def to_earth(latitude: float, longitude: float, height: float) -> Vector:
    """Return the position in the Earth-centred, Earth-fixed frame (ECEF), m (closed form)."""
    phi, lam = radians(latitude), radians(longitude)
    radius = SEMI_MAJOR / sqrt(1 - _ECCENTRICITY_2 * sin(phi) ** 2)
    return (
        (radius + height) * cos(phi) * cos(lam),
        (radius + height) * cos(phi) * sin(lam),
        (radius * (1 - _ECCENTRICITY_2) + height) * sin(phi),
    )


def from_earth(place: Sequence[float]) -> Vector:
    """Return latitude and longitude (degrees) and height (m) of a position in the ECEF frame (m).

    Fixed-point iteration of tan φ = (z + e² N sin φ) / p: Torge and Müller, Geodesy (2012), chapter 4.
    """
    x, y, z = place
    p = hypot(x, y)
    phi = atan2(z, p * (1 - _ECCENTRICITY_2))
    for _ in range(_ITERATIONS):
        radius = SEMI_MAJOR / sqrt(1 - _ECCENTRICITY_2 * sin(phi) ** 2)
        phi = atan2(z + _ECCENTRICITY_2 * radius * sin(phi), p)
    radius = SEMI_MAJOR / sqrt(1 - _ECCENTRICITY_2 * sin(phi) ** 2)
    # p / cos φ - N fails at the poles, z / sin φ - (1 - e²) N at the equator; this form is exact everywhere.
    height = p * cos(phi) + (z + _ECCENTRICITY_2 * radius * sin(phi)) * sin(phi) - radius
    return degrees(phi), degrees(atan2(y, x)), height


def earth_from_local(latitude: float, longitude: float, height: float) -> Matrix:
    """Return the transform ECEF-from-local for the local frame (east, north, up) at a datum."""
    phi, lam = radians(latitude), radians(longitude)
    sp, cp, sl, cl = sin(phi), cos(phi), sin(lam), cos(lam)
    x, y, z = to_earth(latitude, longitude, height)
    return (-sl, -sp * cl, cp * cl, x, cl, -sp * sl, cp * sl, y, 0.0, cp, sp, z)


def geodetic(local: Sequence[float], datum: Sequence[float]) -> Vector:
    """Return latitude, longitude (degrees) and height (m) of a local position (m); `datum` holds the same values."""
    return from_earth(transform(earth_from_local(*datum), local))


_FIX, _GPS = 0, 1  # sensor_msgs/NavSatStatus: STATUS_FIX, SERVICE_GPS
_UNKNOWN, _DIAGONAL = 0, 2  # sensor_msgs/NavSatFix: COVARIANCE_TYPE_


class FixNoise(Checked):
    """Noise of the position, in the local frame."""

    horizontal: NoiseParameters = NoiseParameters()  # m, east and north
    vertical: NoiseParameters = NoiseParameters()  # m


class FixParameters(SensorParameters):
    """A satellite receiver that always has a fix."""

    kind: Literal["fix"]
    topic: Topic = "fix"
    frame: Name = "gps_link"
    noise: FixNoise = FixNoise()

    def make(self, mounting: Mounting) -> Fix:
        return Fix(self, mounting)


class Fix(Instrument):
    """Measures latitude, longitude (degrees) and height above the ellipsoid of WGS 84 (m)."""

    parameters: FixParameters

    def __init__(self, parameters: FixParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        self._horizontal = self.make_noise(parameters.noise.horizontal, 2)
        self._vertical = self.make_noise(parameters.noise.vertical, 1)
        self.outputs = (Output("", "sensor_msgs/NavSatFix", self._message),)

    def sample(self) -> Vector:
        x, y, z = position(self.mounting.pose())
        datum = self.carrier.datum
        local = (*self._horizontal.add((x, y)), *self._vertical.add((z,)))
        return geodetic(local, (datum.latitude, datum.longitude, datum.altitude))

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
