"""`sim`: pictures of vision sensors.

An image is a string of width · height · 3 bytes: red, green, blue, **bottom row first**, as in V-REP (OpenGL's order);
simROS.imageTransportPublish flips it. It shows the scene after the last step, or the present scene if no picture was
rendered since. Depth is in m along the sensor's z axis, and infinite beyond the far plane. Every sensor has both,
whatever it publishes. A sensor of the scene may show handles instead of colors (sim.visionintparam_render_mode 2), or
only one object or collection (sim.visionintparam_entity_to_render).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CODED, GREYSCALE, METRES, bare, has
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.sensors import EVERY_SENSOR
from drone_sim.scripting.api.types import Handle, Number, WrongValue, numbers

# A state, then packets. An empty tuple is a documented packet that the sensor does not have; in Lua, it is nil.
VisionReading = tuple[Any, ...]

_GREY, _DEPTH_IN_METRES = 1, 1  # options in 4.x
_ALL = (0, 0)  # corner and size for the whole picture
NO_OBJECT = 0xFFFFFF  # the handle of the background in a picture of handles: white, as in V-REP
_LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)  # ITU-R BT.601


class Detected(NamedTuple):
    """Result of a sensor's own script: whether it triggers, and packets of floats, as strings."""

    trigger: bool = False
    packets: tuple[bytes, ...] = ()


@runtime_checkable
class Eye(Protocol):
    """A vision sensor of the scene: picture size in px, near and far plane in m, angle (rad) of the larger side."""

    width: int
    height: int
    near: float
    far: float
    angle: float
    orthographic_size: float | None  # m, of the larger side; None for a perspective sensor
    detected: Detected
    entity: int  # handle of the only visible object or collection, or EVERYTHING
    color_coded: bool  # whether its colors are handles: red + 256 green + 65536 blue

    def picture(self, kind: str = "color", only: Collection[str] | None = None) -> np.ndarray:
        """Return a picture: "color", (h, w, 3) uint8, or "depth", (h, w) in m, NaN beyond the far plane.

        Or "handles", (h, w) uint32, NO_OBJECT for the background. `only`: names of the visible objects, None for all.
        """


class VisionSensors(Functions):
    """Vision sensors."""

    @sim("345")
    def getVisionSensorCharImage(
        self, handle: Handle, x: Number = 0, y: Number = 0, width: Number = 0, height: Number = 0, *_options: Any
    ) -> tuple[bytes, int, int]:
        """Return image, width and height of a part of a picture, or of the whole picture if width and height are 0.

        With sim.handleflag_greyscale added to the handle, the image is grey, with one byte for each pixel.
        """
        picture = self._colors(handle, (x, y), (width, height))
        if has(handle, GREYSCALE):
            picture = (picture @ _LUMINANCE).astype(np.uint8)
        rows, columns = picture.shape[:2]
        return b"".join(picture[::-1]), columns, rows  # `tobytes` would take forty times as long

    @sim("5")
    def getVisionSensorImg(
        self, handle: Handle, options: int = 0, _cutoff: Number = 0.0, pos: Any = _ALL, size: Any = _ALL
    ) -> tuple[bytes, list[int]]:
        """Return image and [width, height] of a part of a picture; `options`: 1 grey."""
        flag = GREYSCALE if int(options) & _GREY else 0
        image, width, height = self.getVisionSensorCharImage(bare(handle) + flag, *_pair(pos), *_pair(size))
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
        """Return depths as a string of floats, bottom row first, and [width, height].

        `options`: 1 in m; otherwise from 0 at the near plane to 1 at the far plane.
        """
        flag = CODED + (METRES if int(options) & _DEPTH_IN_METRES else 0)
        depths = self._depths(bare(handle) + flag, _pair(pos), _pair(size))
        return depths.tobytes(), [depths.shape[1], depths.shape[0]]

    @sim("345")
    def getVisionSensorDepthBuffer(
        self, handle: Handle, x: Number = 0, y: Number = 0, width: Number = 0, height: Number = 0
    ) -> Any:
        """Return depths as numbers, bottom row first, from 0 at the near plane to 1 at the far plane.

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
        """Like readVisionSensor; for sim.handle_all and _all_except_explicit, count the sensors that trigger."""
        if handle not in EVERY_SENSOR:
            return self.readVisionSensor(handle)
        return sum(sensor.detected.trigger for sensor in self._all(Eye)), (), ()

    @sim("345")
    def readVisionSensor(self, handle: Handle) -> VisionReading:
        """Return whether the sensor's own script triggers (1 or 0), 15 numbers, and the packets of that script.

        The numbers are the minima, then the maxima, then the means of intensity, red, green, blue and depth (0 to 1).
        Depth is 0 at the near plane and 1 at the far plane. If colors are handles, the numbers are the visible handles.
        Python gets at least three values, as CoppeliaSim documents; the third is empty without a script.
        """
        found = self._objects[bare(handle)]
        detected = found.detected if isinstance(found, Eye) else Detected()
        packets = [np.frombuffer(packet, "<f4").tolist() for packet in detected.packets]
        return int(detected.trigger), self._statistics(handle), *(packets or [()])

    @sim("345")
    def checkVisionSensor(self, handle: Handle, entity: Handle) -> VisionReading:
        """Return 1 if a sensor sees an object or collection, without all others, otherwise 0; and 15 numbers.

        The numbers are those of readVisionSensor for this picture. Unlike in V-REP, the sensor's script is not called.
        """
        only = self._names_of(entity)
        is_seen = np.isfinite(self._picture(handle, "depth", only)).any()
        return int(is_seen), self._statistics(handle, only), ()

    @sim("345")
    def checkVisionSensorEx(self, handle: Handle, entity: Handle, returnImage: bool) -> list[float]:
        """Return the image (0 to 1) or the depths (0 to 1) of an object or collection without all others.

        The bottom row is first. Pixels that do not show it have the depth 1; all others are its mask.
        """
        only = self._names_of(entity)
        if returnImage:
            picture: Any = self._colors(handle, only=only)[::-1] / np.float32(255)
        else:
            picture = self._depths(bare(handle), only=only)
        values: list[float] = picture.ravel().tolist()
        return values

    def _statistics(self, handle: int, only: Collection[str] | None = None) -> list[float]:
        """Return the first packet of readVisionSensor for a picture."""
        colors, found = self._colors(handle, only=only).reshape(-1, 3), self._objects[bare(handle)]
        if isinstance(found, Eye) and found.color_coded:
            handles = np.unique(colors @ (1, 256, 65536))
            return [float(visible) for visible in handles if visible != NO_OBJECT]
        intensities, depths = colors / np.float32(255), self._depths(bare(handle), only=only)[::-1].ravel()
        channels = np.column_stack([intensities.mean(1), intensities, depths])
        return [*channels.min(0).tolist(), *channels.max(0).tolist(), *channels.mean(0).tolist()]

    def _colors(
        self,
        handle: int,
        pos: Sequence[float] = _ALL,
        size: Sequence[float] = _ALL,
        only: Collection[str] | None = None,
    ) -> np.ndarray:
        """Return colors (height, width, 3), top row first."""
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
        """Return depths (height, width), bottom row first."""
        picture, found = self._picture(handle, "depth", only), self._objects[bare(handle)]
        depths = np.nan_to_num(_part(picture, pos, size)[::-1].astype("<f4"), nan=np.inf)
        if has(handle, METRES):
            return depths
        near, far = (found.near, found.far) if isinstance(found, Eye) else self._services.planes[found.name]
        return np.clip((depths - near) / max(far - near, 1e-9), 0.0, 1.0).astype("<f4")

    def _picture(self, handle: int, kind: str = "", only: Collection[str] | None = None) -> np.ndarray:
        """Return a picture of a kind ('': the kind that the sensor is for); `only`: names of the visible objects."""
        found, pictures = self._objects[bare(handle)], self._services.pictures
        if isinstance(found, Eye) and only is None:
            only = self._names_of(found.entity)
        take = found.picture if isinstance(found, Eye) else pictures.get(found.name)
        if take is None:
            known = ", ".join([*pictures, *(item.name for item in self._all(Eye))]) or "none"
            raise WrongValue(f"'{found.name}' is not a vision sensor; there are: {known}")
        # Without the script's time limit, because the first picture compiles shaders.
        arguments = (kind, only) if only is not None else (kind,) if kind else ()
        return self._services.outside(lambda: take(*arguments))


def _pair(values: Any) -> tuple[float, ...]:
    return numbers(values, 2) if len(values) else (0.0, 0.0)


def _part(picture: np.ndarray, pos: Sequence[float], size: Sequence[float]) -> np.ndarray:
    """Return a part of a picture, counted from its lower left corner. Raises WrongValue if it is not inside."""
    (x, y), (width, height) = (map(int, numbers(pair, 2)) for pair in (pos, size))
    if not (x or y or width or height):
        return picture
    rows, columns = picture.shape[:2]
    width, height = width or columns - x, height or rows - y
    if x < 0 or y < 0 or width <= 0 or height <= 0 or x + width > columns or y + height > rows:
        raise WrongValue(f"must be inside the picture of {columns} x {rows} pixels")
    return picture[rows - y - height : rows - y, x : x + width]
