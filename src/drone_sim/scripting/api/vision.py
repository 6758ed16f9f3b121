"""`sim`: what vision sensors see.

An image is a string of width · height · 3 bytes, red, green, blue, **the bottom row first**, as V-REP
gives it (OpenGL's order); simROS.imageTransportPublish turns it over. It shows the scene as of the last
step, or as of now where nobody has looked since.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any, Protocol, runtime_checkable

import numpy as np

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.calls import WrongValue
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.types import Handle


@runtime_checkable
class Eye(Protocol):
    """A vision sensor of the scene."""

    def picture(self, kind: str) -> np.ndarray:
        """Return what it sees: "color", (h, w, 3) uint8, or "depth", (h, w) in m, NaN beyond the far plane."""


class VisionSensors:
    """The functions on vision sensors."""

    def __init__(self, host: Host, surroundings: Surroundings):
        """Take the drone and its cameras."""
        self._objects = host.objects
        self._pictures = surroundings.pictures
        self._outside = surroundings.outside

    def getVisionSensorCharImage(self, handle: Handle, *_options: Any) -> tuple[bytes, int, int]:
        """Return image, width and height."""
        picture = self._picture(handle)
        height, width = picture.shape[:2]
        return b"".join(picture[::-1]), width, height  # row by row: `tobytes` takes forty times as long

    def getVisionSensorImg(self, handle: Handle, *_options: Any) -> tuple[bytes, list[int]]:
        """Return image and [width, height]."""
        image, width, height = self.getVisionSensorCharImage(handle)
        return image, [width, height]

    def getVisionSensorResolution(self, handle: Handle) -> list[int]:
        """Return [width, height]."""
        height, width = self._picture(handle).shape[:2]
        return [width, height]

    def getVisionSensorRes(self, handle: Handle) -> list[int]:
        """Return [width, height]."""
        return self.getVisionSensorResolution(handle)

    def handleVisionSensor(self, handle: Handle) -> int:
        """Take the picture; return the number of detections: 0, there are no filters."""
        self._picture(handle)
        return 0

    def _picture(self, handle: int) -> np.ndarray:
        found = self._objects[handle]
        name = found.name
        if isinstance(found, Eye):  # of the scene
            return self._outside(partial(found.picture, "color"))
        if name not in self._pictures:
            known = ", ".join([*self._pictures, *_eyes(self._objects)]) or "none"
            raise WrongValue(f"'{name}' is not a vision sensor; there are: {known}")
        picture = self._outside(self._pictures[name])  # not the script's time; the first picture compiles shaders
        if picture.ndim != 3 or picture.dtype != np.uint8:
            raise WrongValue(f"'{name}' sees no colours")
        return picture


def _eyes(objects: ObjectTree) -> Iterator[str]:
    return (objects[handle].name for handle in objects if isinstance(objects[handle], Eye))
