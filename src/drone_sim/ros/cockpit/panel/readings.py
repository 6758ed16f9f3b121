"""What there is to plot of a sensor's message: numbers, with their names and units."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from geometry_msgs.msg import PointStamped, Vector3Stamped, WrenchStamped
from sensor_msgs.msg import BatteryState, FluidPressure, Imu, MagneticField, NavSatFix, Range


class Reading(NamedTuple):
    """A kind of message, the names of its numbers, and what returns these."""

    message: type
    names: tuple[str, ...]
    numbers: Callable[[Any], tuple[float, ...]]


def _vector(one: Any) -> tuple[float, float, float]:
    return one.x, one.y, one.z


def _axes(what: str, unit: str) -> tuple[str, ...]:
    return tuple(f"{what} {axis}, {unit}" for axis in "xyz")


READINGS = {
    one.message._type: one  # type: ignore[attr-defined]
    for one in (
        Reading(
            Imu,
            (*_axes("acceleration", "m/s²"), *_axes("rate", "rad/s")),
            lambda m: (*_vector(m.linear_acceleration), *_vector(m.angular_velocity)),
        ),
        Reading(Range, ("range, m",), lambda m: (m.range if math.isfinite(m.range) else math.nan,)),
        Reading(MagneticField, _axes("field", "T"), lambda m: _vector(m.magnetic_field)),
        Reading(FluidPressure, ("pressure, Pa",), lambda m: (m.fluid_pressure,)),
        Reading(NavSatFix, ("altitude, m",), lambda m: (m.altitude,)),
        Reading(BatteryState, ("voltage, V", "current, A"), lambda m: (m.voltage, m.current)),
        Reading(PointStamped, _axes("point", "m"), lambda m: _vector(m.point)),
        Reading(Vector3Stamped, _axes("vector", "m/s"), lambda m: _vector(m.vector)),
        Reading(
            WrenchStamped,
            (*_axes("force", "N"), *_axes("torque", "N m")),
            lambda m: (*_vector(m.wrench.force), *_vector(m.wrench.torque)),
        ),
    )
}
