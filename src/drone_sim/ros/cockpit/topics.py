"""The simulation's topics on the master: vehicles, their cameras, and sensors to plot."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from geometry_msgs.msg import PointStamped, Vector3Stamped, WrenchStamped
from sensor_msgs.msg import BatteryState, FluidPressure, Imu, MagneticField, NavSatFix, Range
from std_msgs.msg import String

from drone_sim.ros.core.message_conversion import xyz

_VIEW, _ODOMETRY = "/view/bodies", "/odom"
_PICTURES, _COMPRESSED = "sensor_msgs/Image", "sensor_msgs/CompressedImage"
_TRANSPORT, _TRUTH = "/compressed", "/truth/"
_COMMANDS = ("/push", "/set_wind")  # by this page, too: no sensors


class ImageTopic(NamedTuple):
    """A topic of pictures, whatever its transports."""

    topic: str
    compressed: str = ""  # the topic of compressed pictures; '' if there is none
    has_truth: bool = False  # whether ground truth is published below the topic


class FoundTopics(NamedTuple):
    """The topics of one simulation."""

    namespace: str = ""  # of the markers; '' without a simulation
    vehicles: tuple[str, ...] = ()
    cameras: tuple[ImageTopic, ...] = ()
    sensors: Mapping[str, str] = {}  # topics of sensors, with their types


def find_topics(topics: Iterable[tuple[str, str]]) -> FoundTopics:
    """Return the simulation among the published topics, which are given with their types."""
    kinds = dict(topics)
    views = [name.removesuffix(_VIEW) for name in kinds if name.endswith(_VIEW)]
    if not views:
        return FoundTopics()
    vehicles = [name.removesuffix(_ODOMETRY).lstrip("/") for name in kinds if name.endswith(_ODOMETRY)]
    own = [name for name in sorted(vehicles) if f"/{name}/propellers" in kinds]
    inside = tuple(f"/{name}/" for name in own)
    measured = (name for name in sorted(kinds) if name.startswith(inside) and not name.endswith(_COMMANDS))
    sensors = {name: kinds[name] for name in measured if kinds[name] in PLOTTED}
    packed = [name for name, kind in kinds.items() if kind == _COMPRESSED and name.endswith(_TRANSPORT)]
    compressed = {name.removesuffix(_TRANSPORT): name for name in packed}
    plain = {name for name, kind in kinds.items() if kind == _PICTURES}
    cameras = tuple(
        ImageTopic(name, compressed.get(name, ""), f"{name}{_TRUTH}boxes" in kinds)
        for name in sorted(compressed.keys() | plain)
        if _TRUTH not in name  # truth is shown over its picture
    )
    return FoundTopics(min(views), tuple(own), cameras, sensors)


def read_json(message: String, max_length: int) -> dict[str, Any] | None:
    """Return the mapping in a JSON message; None if it is none, or has more than `max_length` characters."""
    try:
        content = json.loads(message.data) if len(message.data) <= max_length else None
    except (ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


class PlottedMessage(NamedTuple):
    """A message type, the names of the numbers that are plotted, and a function that returns them."""

    message: type
    names: tuple[str, ...]
    numbers: Callable[[Any], tuple[float, ...]]


def _axes(what: str, unit: str) -> tuple[str, ...]:
    return tuple(f"{what} {axis}, {unit}" for axis in "xyz")


PLOTTED = {
    plotted.message._type: plotted  # type: ignore[attr-defined]
    for plotted in (
        PlottedMessage(
            Imu,
            (*_axes("acceleration", "m/s²"), *_axes("rate", "rad/s")),
            lambda m: (*xyz(m.linear_acceleration), *xyz(m.angular_velocity)),
        ),
        PlottedMessage(Range, ("range, m",), lambda m: (m.range if math.isfinite(m.range) else math.nan,)),
        PlottedMessage(MagneticField, _axes("field", "T"), lambda m: xyz(m.magnetic_field)),
        PlottedMessage(FluidPressure, ("pressure, Pa",), lambda m: (m.fluid_pressure,)),
        PlottedMessage(NavSatFix, ("altitude, m",), lambda m: (m.altitude,)),
        PlottedMessage(BatteryState, ("voltage, V", "current, A"), lambda m: (m.voltage, m.current)),
        PlottedMessage(PointStamped, _axes("point", "m"), lambda m: xyz(m.point)),
        PlottedMessage(Vector3Stamped, _axes("vector", "m/s"), lambda m: xyz(m.vector)),
        PlottedMessage(
            WrenchStamped,
            (*_axes("force", "N"), *_axes("torque", "N m")),
            lambda m: (*xyz(m.wrench.force), *xyz(m.wrench.torque)),
        ),
    )
}
