"""`sim`: what vision sensors see.

An image is a string of width · height · 3 bytes, red, green, blue, **the bottom row first**, as V-REP
gives it (OpenGL's order); simROS.imageTransportPublish turns it over. It shows the scene as of the last
step, or as of now where nobody has looked since. Depth is in m along the sensor's z, and infinite beyond the far plane.
Every sensor has both, whichever of them it publishes. A sensor of the scene may see handles in the place of colours
(sim.visionintparam_render_mode 2), and one object or collection alone (sim.visionintparam_entity_to_render).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from drone_sim.mechanics.object_collections import members
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CODED, GREYSCALE, METRES, bare, has
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.sensors import EVERY_SENSOR, EVERYTHING
from drone_sim.scripting.api.types import Handle, Number, WrongValue, numbers

# A state, then packets. An empty tuple stands for a documented packet that the sensor does not have; Lua gets nil.
VisionReading = tuple[Any, ...]

_GREY, _DEPTH_IN_METRES = 1, 1  # options of 4.x
_ALL = (0, 0)  # the corner and size of a whole picture
NO_OBJECT = 0xFFFFFF  # the handle where a picture of handles shows nothing: white, as in V-REP
_LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)  # ITU-R BT.601


class Detected(NamedTuple):
    """What a sensor's own script has found in its picture: whether it triggers, and packets of floats, as strings."""

    trigger: bool = False
    packets: tuple[bytes, ...] = ()


@runtime_checkable
class Eye(Protocol):
    """A vision sensor of the scene: its picture in px, its near and far planes in m, the angle of its larger side."""

    width: int
    height: int
    near: float
    far: float
    angle: float
    orthographic_size: float | None  # m, of its larger side, where it is orthographic
    detected: Detected
    entity: int  # handle of the object or collection that it sees alone, or EVERYTHING
    color_coded: bool  # whether its colours are handles: red + 256 green + 65536 blue

    def picture(self, kind: str = "color", only: Collection[str] | None = None) -> np.ndarray:
        """Return what it sees: "color", (h, w, 3) uint8, or "depth", (h, w) in m, NaN beyond the far plane.

        Or "handles", (h, w) uint32, NO_OBJECT where there is none; of `only` the objects of these names, or of all.
        """


class VisionSensors(Functions):
    """Vision sensors."""

    @sim("345")
    def getVisionSensorCharImage(
        self, handle: Handle, x: Number = 0, y: Number = 0, width: Number = 0, height: Number = 0, *_options: Any
    ) -> tuple[bytes, int, int]:
        """Return image, width and height of a part of a picture; the whole picture if width and height are 0.

        With sim.handleflag_greyscale added to the handle the image is grey, one byte for each pixel.
        """
        picture = self._colors(handle, (x, y), (width, height))
        if has(handle, GREYSCALE):
            picture = (picture @ _LUMINANCE).astype(np.uint8)
        rows, columns = picture.shape[:2]
        return b"".join(picture[::-1]), columns, rows  # row by row: `tobytes` takes forty times as long

    @sim("5")
    def getVisionSensorImg(
        self, handle: Handle, options: int = 0, _cutoff: Number = 0.0, pos: Any = _ALL, size: Any = _ALL
    ) -> tuple[bytes, list[int]]:
        """Return image and [width, height] of a part of a picture; `options` 1: gray."""
        flag = GREYSCALE if int(options) & _GREY else 0
        image, width, height = self.getVisionSensorCharImage(bare(handle) + flag, *_two(pos), *_two(size))
        return image, [width, height]

    @sim("345")
    def getVisionSensorImage(
        self, handle: Handle, x: Number = 0, y: Number = 0, width: Number = 0, height: Number = 0, as_string: int = 0
    ) -> Any:
        """Return an image as numbers from 0 to 1, or as a string if `as_string` is 1 (3.x)."""
        image = self.getVisionSensorCharImage(handle, x, y, width, height)[0]
        return image if as_string else (np.frombuffer(image, np.uint8) / np.float32(255)).tolist()

    @sim("5")
    def getVisionSensorDepth(
        self, handle: Handle, options: int = 0, pos: Any = _ALL, size: Any = _ALL
    ) -> tuple[bytes, list[int]]:
        """Return depths as a string of floats, the bottom row first, and [width, height].

        `options` 1: in m; else from 0, at the near plane, to 1, at the far one.
        """
        flag = CODED + (METRES if int(options) & _DEPTH_IN_METRES else 0)
        depths = self._depths(bare(handle) + flag, _two(pos), _two(size))
        return depths.tobytes(), [depths.shape[1], depths.shape[0]]

    @sim("345")
    def getVisionSensorDepthBuffer(
        self, handle: Handle, x: Number = 0, y: Number = 0, width: Number = 0, height: Number = 0
    ) -> Any:
        """Return depths as numbers, the bottom row first, from 0 at the near plane to 1 at the far one.

        Flags added to the handle: sim.handleflag_depthbuffermeters (m), _codedstring (a string of floats).
        """
        depths = self._depths(handle, (x, y), (width, height))
        return depths.tobytes() if has(handle, CODED) else depths.ravel().tolist()

    @sim("345", getVisionSensorRes="5")
    def getVisionSensorResolution(self, handle: Handle) -> list[int]:
        """Return [width, height]."""
        height, width = self._picture(handle).shape[:2]
        return [width, height]

    @sim("345")
    def handleVisionSensor(self, handle: Handle) -> VisionReading:
        """Do what readVisionSensor does; for sim.handle_all, and _all_except_explicit, count those that trigger."""
        if handle not in EVERY_SENSOR:
            return self.readVisionSensor(handle)
        every = [self._objects[one] for one in self._objects]
        return sum(one.detected.trigger for one in every if isinstance(one, Eye)), (), ()

    @sim("345")
    def readVisionSensor(self, handle: Handle) -> VisionReading:
        """Return whether the sensor's own script triggers (1 or 0), 15 numbers, and the packets of that script.

        They are intensity, red, green, blue and depth (0 to 1): the least, the largest, and the mean of each. Depth is
        0 at the near plane, and 1 at the far one. Where colours are handles, the numbers are those of what is seen.
        In Python there are three values at least, as CoppeliaSim documents: the third is empty without such a script.
        """
        detected = self._detected(handle)
        packets = [np.frombuffer(one, "<f4").tolist() for one in detected.packets]
        return int(detected.trigger), self._statistics(handle), *(packets or [()])

    @sim("345")
    def checkVisionSensor(self, handle: Handle, entity: Handle) -> VisionReading:
        """Return whether a sensor would see an object or collection if there were nothing else, 1 or 0, and 15 numbers.

        They are those of readVisionSensor, of that picture. The sensor's script is not asked: V-REP's is, and triggers.
        """
        only = self._names(entity)
        is_seen = np.isfinite(self._picture(handle, "depth", only)).any()
        return int(is_seen), self._statistics(handle, only), ()

    @sim("345")
    def checkVisionSensorEx(self, handle: Handle, entity: Handle, returnImage: bool) -> list[float]:
        """Return the image (0 to 1), or the depths (0 to 1), of only one object or collection.

        The bottom row comes first. Pixels that do not show it have the depth 1; all others are its mask.
        """
        only = self._names(entity)
        if returnImage:
            seen: Any = self._colors(handle, only=only)[::-1] / np.float32(255)
        else:
            seen = self._depths(bare(handle), only=only)
        values: list[float] = seen.ravel().tolist()
        return values

    def _names(self, entity: int) -> set[str] | None:
        """Return the names of the objects that an entity is, None for all."""
        if entity == EVERYTHING:
            return None
        found = members(entity, self._objects, self._context.collections)
        return {name for one in found for name in self._objects[one].names}

    def _statistics(self, handle: int, only: Collection[str] | None = None) -> list[float]:
        """Return the first packet of a picture."""
        colors, found = self._colors(handle, only=only).reshape(-1, 3), self._objects[bare(handle)]
        if isinstance(found, Eye) and found.color_coded:
            handles = np.unique(colors @ (1, 256, 65536))
            return [float(one) for one in handles if one != NO_OBJECT]
        shares, depths = colors / np.float32(255), self._depths(bare(handle), only=only)[::-1].ravel()
        channels = np.column_stack([shares.mean(1), shares, depths])
        return [*channels.min(0).tolist(), *channels.max(0).tolist(), *channels.mean(0).tolist()]

    def _detected(self, handle: int) -> Detected:
        found = self._objects[bare(handle)]
        return found.detected if isinstance(found, Eye) else Detected()

    def _colors(
        self,
        handle: int,
        pos: Sequence[float] = _ALL,
        size: Sequence[float] = _ALL,
        only: Collection[str] | None = None,
    ) -> np.ndarray:
        """Return colours (height, width, 3)."""
        found = self._objects[bare(handle)]
        if isinstance(found, Eye) and found.color_coded:
            handles = self._picture(handle, "handles", only).astype("<u4")
            channels = handles.view(np.uint8).reshape(*handles.shape, 4)
            return _part(np.ascontiguousarray(channels[:, :, :3]), pos, size)
        return _part(self._picture(handle, "color", only), pos, size)

    def _depths(
        self,
        handle: int,
        pos: Sequence[float] = _ALL,
        size: Sequence[float] = _ALL,
        only: Collection[str] | None = None,
    ) -> np.ndarray:
        """Return depths (height, width), the bottom row first."""
        picture, found = self._picture(handle, "depth", only), self._objects[bare(handle)]
        depths = np.nan_to_num(_part(picture, pos, size)[::-1].astype("<f4"), nan=np.inf)
        if has(handle, METRES):
            return depths
        near, far = (found.near, found.far) if isinstance(found, Eye) else self._surroundings.planes[found.name]
        return np.clip((depths - near) / max(far - near, 1e-9), 0.0, 1.0).astype("<f4")

    def _picture(self, handle: int, kind: str = "", only: Collection[str] | None = None) -> np.ndarray:
        """Return what a sensor sees, of `only` these objects or of all: without a `kind` what it is made for."""
        found, pictures = self._objects[bare(handle)], self._surroundings.pictures
        if isinstance(found, Eye) and only is None:
            only = self._names(found.entity)
        take = found.picture if isinstance(found, Eye) else pictures.get(found.name)
        if take is None:
            eyes = [one.name for one in map(self._objects.__getitem__, self._objects) if isinstance(one, Eye)]
            known = ", ".join([*pictures, *eyes]) or "none"
            raise WrongValue(f"'{found.name}' is not a vision sensor; there are: {known}")
        # Not the script's time: the first picture compiles shaders.
        given = (kind, only) if only is not None else (kind,) if kind else ()
        return self._surroundings.outside(lambda: take(*given))


def _two(values: Any) -> tuple[float, ...]:
    return numbers(values, 2) if len(values) else (0.0, 0.0)


def _part(picture: np.ndarray, pos: Sequence[float], size: Sequence[float]) -> np.ndarray:
    """Return a part of a picture from its lower left corner; raises WrongValue for one beyond it."""
    (x, y), (width, height) = (map(int, numbers(two, 2)) for two in (pos, size))
    if not (x or y or width or height):
        return picture
    rows, columns = picture.shape[:2]
    width, height = width or columns - x, height or rows - y
    if x < 0 or y < 0 or width <= 0 or height <= 0 or x + width > columns or y + height > rows:
        raise WrongValue(f"must be inside the picture of {columns} x {rows} pixels")
    return picture[rows - y - height : rows - y, x : x + width]
