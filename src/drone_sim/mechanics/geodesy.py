"""Places on the Earth: latitude and longitude (degrees) and height (m) on the ellipsoid of WGS 84.

Constants: NGA.STND.0036, World Geodetic System 1984, version 1.0.0 (2014). The local frame is the plane that
touches the ellipsoid at the datum: x east, y north, z up.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, degrees, hypot, radians, sin, sqrt

from drone_sim.mechanics.frames import Matrix, Vector, transform

SEMI_MAJOR = 6378137.0  # m
FLATTENING = 1 / 298.257223563
_ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)
_ROUNDS = 5  # of an iteration whose error shrinks by 1/150 every time, from some metres: far below 1e-6 m


def to_earth(latitude: float, longitude: float, height: float) -> Vector:
    """Return a place in the Earth-centred, Earth-fixed frame, in m (closed form)."""
    phi, lam = radians(latitude), radians(longitude)
    across = SEMI_MAJOR / sqrt(1 - _ECCENTRICITY_2 * sin(phi) ** 2)
    return (
        (across + height) * cos(phi) * cos(lam),
        (across + height) * cos(phi) * sin(lam),
        (across * (1 - _ECCENTRICITY_2) + height) * sin(phi),
    )


def from_earth(place: Sequence[float]) -> Vector:
    """Return latitude and longitude (degrees) and height (m) of a place in the Earth's frame (m).

    The fixed point of tan φ = (z + e² N sin φ) / p: Torge and Müller, Geodesy (2012), chapter 4.
    """
    x, y, z = place
    p = hypot(x, y)
    phi = atan2(z, p * (1 - _ECCENTRICITY_2))
    for _ in range(_ROUNDS):
        across = SEMI_MAJOR / sqrt(1 - _ECCENTRICITY_2 * sin(phi) ** 2)
        phi = atan2(z + _ECCENTRICITY_2 * across * sin(phi), p)
    across = SEMI_MAJOR / sqrt(1 - _ECCENTRICITY_2 * sin(phi) ** 2)
    # Of the two forms that are exact, at the poles and at the equator, this is exact at both.
    height = p * cos(phi) + (z + _ECCENTRICITY_2 * across * sin(phi)) * sin(phi) - across
    return degrees(phi), degrees(atan2(y, x)), height


def earth_from_local(latitude: float, longitude: float, height: float) -> Matrix:
    """Return the transform from the local frame (east, north, up) at a datum to the Earth's frame."""
    phi, lam = radians(latitude), radians(longitude)
    sp, cp, sl, cl = sin(phi), cos(phi), sin(lam), cos(lam)
    x, y, z = to_earth(latitude, longitude, height)
    return (-sl, -sp * cl, cp * cl, x, cl, -sp * sl, cp * sl, y, 0.0, cp, sp, z)


def geodetic(local: Sequence[float], datum: Sequence[float]) -> Vector:
    """Return latitude, longitude (degrees) and height (m) of a local place (m); of the datum those are given, too."""
    return from_earth(transform(earth_from_local(*datum), local))
