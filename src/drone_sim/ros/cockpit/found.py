"""What the master knows: where the simulation's topics are, which vehicles fly, and what cameras they have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from drone_sim.ros.cockpit.panel.readings import READINGS

_VIEW, _ODOMETRY = "/view/bodies", "/odom"
_PICTURES, _COMPRESSED = "sensor_msgs/Image", "sensor_msgs/CompressedImage"
_TRANSPORT = "/compressed"
_TOLD = ("/push", "/set_wind")  # by this page, too: no sensors


class Source(NamedTuple):
    """A topic of pictures, and where they come compressed, '' where they do not."""

    topic: str
    compressed: str = ""


class Found(NamedTuple):
    """Namespace of what is shown ('' where there is no simulation), vehicles, all topics of pictures.

    And the topics of sensors, with their types.
    """

    namespace: str = ""
    vehicles: tuple[str, ...] = ()
    cameras: tuple[Source, ...] = ()
    sensors: Mapping[str, str] = {}


def find(topics: Iterable[tuple[str, str]]) -> Found:
    """Return what is among the published topics, given with their types."""
    kinds = dict(topics)
    views = [name.removesuffix(_VIEW) for name in kinds if name.endswith(_VIEW)]
    if not views:
        return Found()
    vehicles = [name.removesuffix(_ODOMETRY).lstrip("/") for name in kinds if name.endswith(_ODOMETRY)]
    own = [name for name in sorted(vehicles) if f"/{name}/propellers" in kinds]
    return Found(sorted(views)[0], tuple(own), tuple(_cameras(kinds)), _sensors(kinds, own))


def _sensors(kinds: Mapping[str, str], vehicles: Iterable[str]) -> dict[str, str]:
    inside = tuple(f"/{name}/" for name in vehicles)
    topics = (name for name in sorted(kinds) if name.startswith(inside) and not name.endswith(_TOLD))
    return {name: kinds[name] for name in topics if kinds[name] in READINGS}


def _cameras(kinds: Mapping[str, str]) -> Iterator[Source]:
    """Yield each topic of pictures once, however many transports it has."""
    packed = {
        name.removesuffix(_TRANSPORT): name
        for name, kind in kinds.items()
        if kind == _COMPRESSED and name.endswith(_TRANSPORT)
    }
    plain = {name for name, kind in kinds.items() if kind == _PICTURES}
    for name in sorted(packed.keys() | plain):
        yield Source(name, packed.get(name, ""))
