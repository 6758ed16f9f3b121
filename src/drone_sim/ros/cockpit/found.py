"""What the master knows: where the simulation's topics are, which vehicles fly, and what cameras they have."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

_VIEW, _ODOMETRY = "/view/bodies", "/odom"
_PICTURES = "sensor_msgs/CompressedImage"


class Found(NamedTuple):
    """Namespace of what is shown ('' where there is no simulation), vehicles, and their compressed cameras' topics."""

    namespace: str = ""
    vehicles: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()


def find(topics: Iterable[tuple[str, str]]) -> Found:
    """Return what is among the published topics, given with their types."""
    kinds = dict(topics)
    views = [name.removesuffix(_VIEW) for name in kinds if name.endswith(_VIEW)]
    if not views:
        return Found()
    vehicles = [name.removesuffix(_ODOMETRY).lstrip("/") for name in kinds if name.endswith(_ODOMETRY)]
    own = [name for name in sorted(vehicles) if f"/{name}/propellers" in kinds]
    cameras = [name for name, kind in sorted(kinds.items()) if kind == _PICTURES]
    return Found(sorted(views)[0], tuple(own), tuple(cameras))
