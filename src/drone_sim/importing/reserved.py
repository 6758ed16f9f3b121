"""The names that our own objects have."""

from __future__ import annotations

from collections.abc import Sequence

from drone_sim.mechanics.frames import IDENTITY
from drone_sim.mechanics.object_names import suffixed
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.vehicles.quadricopter_objects import QuadricopterObjects

_CAMERAS = ("FrontVision", "DepthVision", "TrackCam", "FloorVision")
_FLOOR = ("Floor", "ResizableFloor_5_25")


def reserved_names(suffixes: Sequence[int]) -> set[str]:
    """Return the names of our floor, and of the objects and cameras of vehicles with these suffixes (none: our own)."""
    names = set(_FLOOR)
    for suffix in suffixes or (-1,):
        tree = ObjectTree()
        QuadricopterObjects(tree, suffixed("", suffix), []).add(None, {}, [IDENTITY] * 4, {}, {})  # type: ignore[arg-type]
        names |= {*tree.names, *(suffixed(camera, suffix) for camera in _CAMERAS)}
    return names
