"""`simVision`: pictures that a script filters: each sensor has a work image, and two buffers beside it.

An image is (height, width, 3), red, green, blue from 0 to 1, the bottom row first, as V-REP has it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np

from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.scripting.api.calls import Module
from drone_sim.scripting.api.constants import ABSOLUTE, CONSTANTS, bare, has
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.types import Handle, Number, ThreeNumbers, WrongValue, numbers
from drone_sim.scripting.api.vision import Eye, VisionSensors

simVision = Module("simVision")
_WORK, _BUFFER1, _BUFFER2 = "work image", "buffer 1", "buffer 2"
_SELF = CONSTANTS["handle_self"]
_MOST = 100  # sensors with images, of one script
_MOST_POINTS = 100_000
_EDGES = 27.0 * np.eye(9)[4].reshape(3, 3) - 3.0  # a pixel against the mean of those around it


class ImageFilters(Functions):
    """Filters of pictures."""

    def __init__(self, *seen: Any):
        """Take what all functions take; there are no images yet."""
        super().__init__(*seen)
        self._sensors = VisionSensors(*seen)
        self._images: dict[tuple[int, str], np.ndarray] = {}

    # ---- where images come from, and go

    @simVision("45")
    def sensorImgToWorkImg(self, handle: Handle) -> None:
        """Let the work image be what a sensor sees."""
        self._keep(handle, self._picture_of(handle))

    @simVision("45")
    def sensorDepthMapToWorkImg(self, handle: Handle) -> None:
        """Let the work image be a sensor's depths, grey: 0 at the near plane, 1 at the far one."""
        depths = self._sensors._depths(self._handle(handle), (0, 0), (0, 0))
        self._keep(handle, np.repeat(depths[:, :, None], 3, axis=2))

    @simVision("45", workImgToSensorDepthMap="45")
    def workImgToSensorImg(self, handle: Handle, _removeBuffer: bool = True) -> None:
        """Do nothing: a picture is what the sensor sees."""
        self._image(handle)
        self._ignored.say(
            "workImgToSensorImg", "a script cannot change the sensor's picture; accepted and ignored", "simVision"
        )

    @simVision("45")
    def uniformImgToWorkImg(self, handle: Handle, color: ThreeNumbers) -> None:
        """Let the work image be of one color."""
        self._keep(handle, np.broadcast_to(np.array(numbers(color, 3)), self._picture_of(handle).shape).copy())

    # ---- what is done to every pixel

    @simVision("45")
    def intensityScaleOnWorkImg(self, handle: Handle, start: Number, end: Number, greyScale: bool) -> None:
        """Make the image grey, and scale its brightness: 0 becomes `start`, and 1 `end`."""
        if not greyScale:
            raise ValueError("color scales are not supported: greyScale must be true")
        low, high = numbers((start, end), 2)
        grey = low + (high - low) * self._image(handle).mean(2)
        self._keep(handle, np.repeat(grey[:, :, None], 3, axis=2))

    @simVision("45")
    def normalizeWorkImg(self, handle: Handle) -> None:
        """Stretch the work image from 0 to 1."""
        image = self._image(handle)
        low, high = image.min(), image.max()
        self._keep(handle, (image - low) / (high - low) if high > low else np.zeros_like(image))

    @simVision("45")
    def selectiveColorOnWorkImg(
        self, handle: Handle, color: ThreeNumbers, colorTolerance: ThreeNumbers, rgb: bool, keep: bool, toBuffer1: bool
    ) -> None:
        """Black out the pixels within a tolerance of a color, in RGB or HSL, or with `keep` all others.

        `toBuffer1`: put the pixels that get black into buffer 1.
        """
        image, middle, apart = self._image(handle), numbers(color, 3), np.array(numbers(colorTolerance, 3))
        off = np.abs((image if rgb else _hsl(image)) - middle)
        if not rgb:
            off[:, :, 0] = np.minimum(off[:, :, 0], 1 - off[:, :, 0])  # hues go round
        gone = (off > apart + 1e-6).any(2) == bool(keep)
        if toBuffer1:
            self._keep(handle, np.where(gone[:, :, None], image, 0.0), _BUFFER1)
        self._keep(handle, np.where(gone[:, :, None], 0.0, image))

    @simVision("45")
    def edgeDetectionOnWorkImg(self, handle: Handle, threshold: Number) -> None:
        """Let edges be white and everything else black."""
        found = cv2.filter2D(self._image(handle), -1, _EDGES, borderType=cv2.BORDER_REPLICATE)
        edges = found.mean(2) > numbers((threshold,), 1)[0]
        self._keep(handle, np.repeat(edges[:, :, None], 3, axis=2).astype(float))

    # ---- what is found

    @simVision("45")
    def binaryWorkImg(
        self, handle: Handle, threshold: Number, oneProportion: Number, oneTol: Number, *expected: Any
    ) -> tuple[bool, bytes]:
        """Let pixels be white, where they are as bright as a threshold, or black; return whether it triggers, a packet.

        The packet has the share of white, its centre (x, y from 0 to 1), its orientation (rad) and its roundness. The
        others are xCenter, xCenterTol, yCenter, yCenterTol, orient, orientTol, roundness, enableTrigger.
        """
        white = self._image(handle).mean(2) >= numbers((threshold,), 1)[0]
        self._keep(handle, np.repeat(white[:, :, None], 3, axis=2).astype(float))
        found = _shape_of(white)
        return _triggers(found, numbers((oneProportion, oneTol), 2), expected), _packed(found)

    @simVision("45")
    def blobDetectionOnWorkImg(
        self, handle: Handle, threshold: Number, minBlobSize: Number, modifyWorkImage: bool = False, *_overlay: Any
    ) -> tuple[bool, bytes]:
        """Find blobs as bright as a threshold; return false and a packet: how many, 6, and 6 numbers of each.

        These are its share of the picture, its orientation (rad), its centre and its size (from 0 to 1). Smaller ones
        than `minBlobSize` are blacked out.
        """
        image = self._image(handle)
        least, smallest = numbers((threshold, minBlobSize), 2)
        count, labels, stats, _ = cv2.connectedComponentsWithStats((image.mean(2) >= least).astype(np.uint8))
        areas = stats[:, cv2.CC_STAT_AREA] / labels.size
        large = [label for label in range(1, count) if areas[label] >= smallest]
        lost = (labels > 0) & ~np.isin(labels, large) | (labels == 0) & bool(modifyWorkImage)
        self._keep(handle, np.where(lost[:, :, None], 0.0, image))
        blobs = [one for label in large for one in (areas[label], *_box(labels == label))]
        return False, _packed([len(large), 6, *blobs])

    @simVision("45")
    def changedPixelsOnWorkImg(self, handle: Handle, threshold: Number) -> tuple[bool, bytes]:
        """Compare the work image with that of the last call; return whether pixels have changed by more, and a packet.

        The packet has the share of pixels that have become brighter or darker. These are white in the work image.
        """
        image, (least,) = self._image(handle), numbers((threshold,), 1)
        before = self._images.get((self._handle(handle), _BUFFER1), image)
        changed = np.abs(image.mean(2) - before.mean(2)) >= least
        self._keep(handle, image, _BUFFER1)
        self._keep(handle, np.repeat(changed[:, :, None], 3, axis=2).astype(float))
        return bool(changed.any()), _packed([changed.mean()])

    @simVision("45")
    def coordinatesFromWorkImg(
        self,
        handle: Handle,
        xyPointCount: Sequence[int],
        evenlySpacedInAngularSpace: bool,
        returnColorData: bool = False,
    ) -> tuple[bool, bytes, bytes]:
        """Return false, and the points that the depths in a perspective sensor's work image stand for, in a packet.

        It has how many there are along x and y, and of each x, y, z (m, in the sensor's frame, or with
        sim.handleflag_abscoords the world's) and the distance (m). Then their colours, from buffer 1.
        """
        eye, image = self._eye(handle), self._image(handle)
        columns, rows = (int(one) for one in numbers(xyPointCount, 2))
        if not 0 < columns * rows <= _MOST_POINTS:
            raise WrongValue(f"expected 1 to {_MOST_POINTS} points, not {columns} x {rows}")
        x, y = _directions(eye, columns, rows, bool(evenlySpacedInAngularSpace))
        row = ((y[:, None] + 1) / 2 * (image.shape[0] - 0.5)).astype(int)
        column = ((1 - x[None, :]) / 2 * (image.shape[1] - 0.5)).astype(int)
        depth = eye.near + image.mean(2)[row, column] * (eye.far - eye.near)
        wide, high = (math.tan(angle / 2) for angle in _angles(eye))
        points = np.stack([x[None, :] * wide * depth, y[:, None] * high * depth, depth], axis=-1).reshape(-1, 3)
        far = np.linalg.norm(points, axis=1)
        points *= np.minimum(1.0, eye.far / np.maximum(far, 1e-12))[:, None]
        if has(handle, ABSOLUTE):
            m = np.reshape(self._objects.matrix(self._handle(handle)), (3, 4))
            points = points @ m[:, :3].T + m[:, 3]
        packet = _packed([columns, rows, *np.column_stack([points, np.minimum(far, eye.far)]).ravel()])
        colors = self._images.get((self._handle(handle), _BUFFER1))
        if not returnColorData or colors is None:
            return False, packet, b""
        return False, packet, (colors[row, column] * 255).astype(np.uint8).tobytes()

    # ---- what all share

    def save_state(self) -> Restore:
        """Return a function that brings back the images."""
        return saved(self, "_images")

    def _handle(self, handle: int) -> int:
        own = self._objects.handle(self._host.own_script)
        return own if handle == _SELF else bare(handle)

    def _eye(self, handle: int) -> Eye:
        found = self._objects[self._handle(handle)]
        if not isinstance(found, Eye) or found.orthographic_size is not None:
            raise ValueError(f"'{found.name}' is not a perspective vision sensor of the scene")
        return found

    def _picture_of(self, handle: int) -> np.ndarray:
        return self._sensors._colors(self._handle(handle), (0, 0), (0, 0))[::-1] / 255.0

    def _image(self, handle: int, which: str = _WORK) -> np.ndarray:
        """Return an image of a sensor; raises ValueError where there is none yet."""
        number = self._handle(handle)
        if (number, which) not in self._images:
            raise ValueError(f"'{self._objects[number].name}' has no {which} yet: call sensorImgToWorkImg first")
        return self._images[number, which]

    def _keep(self, handle: int, image: np.ndarray, which: str = _WORK) -> None:
        key = self._handle(handle), which
        if key not in self._images and len(self._images) >= 3 * _MOST:
            raise ValueError(f"a script can filter the pictures of at most {_MOST} sensors")
        self._images[key] = image


def _add(name: str, doc: str, result: Callable[[ImageFilters, int], None]) -> None:
    """Add a function that takes a sensor alone."""

    def call(self: ImageFilters, handle: Handle) -> None:
        result(self, handle)

    simVision.add(ImageFilters, call, name, doc, "45")


def _copies(source: str, target: str) -> Callable[[ImageFilters, int], None]:
    return lambda self, handle: self._keep(handle, self._image(handle, source), target)


def _swaps(one: str, other: str) -> Callable[[ImageFilters, int], None]:
    def swap(self: ImageFilters, handle: int) -> None:
        first, second = self._image(handle, one), self._image(handle, other)
        self._keep(handle, second, one)
        self._keep(handle, first, other)

    return swap


def _joins(target: str, other: str, join: Callable[[Any, Any], Any]) -> Callable[[ImageFilters, int], None]:
    return lambda self, handle: self._keep(
        handle, np.clip(join(self._image(handle, target), self._image(handle, other)), 0.0, 1.0), target
    )


_add("workImgToBuffer1", "Copy the work image to buffer 1.", _copies(_WORK, _BUFFER1))
_add("workImgToBuffer2", "Copy the work image to buffer 2.", _copies(_WORK, _BUFFER2))
_add("buffer1ToWorkImg", "Copy buffer 1 to the work image.", _copies(_BUFFER1, _WORK))
_add("buffer2ToWorkImg", "Copy buffer 2 to the work image.", _copies(_BUFFER2, _WORK))
_add("swapBuffers", "Exchange the buffers.", _swaps(_BUFFER1, _BUFFER2))
_add("swapWorkImgWithBuffer1", "Exchange the work image and buffer 1.", _swaps(_WORK, _BUFFER1))
_add("addBuffer1ToWorkImg", "Add buffer 1 to the work image.", _joins(_WORK, _BUFFER1, np.add))
_add("addWorkImgToBuffer1", "Add the work image to buffer 1.", _joins(_BUFFER1, _WORK, np.add))
_add("subtractBuffer1FromWorkImg", "Take buffer 1 from the work image.", _joins(_WORK, _BUFFER1, np.subtract))
_add("subtractWorkImgFromBuffer1", "Take the work image from buffer 1.", _joins(_BUFFER1, _WORK, np.subtract))
_add("multiplyWorkImgWithBuffer1", "Multiply the work image by buffer 1.", _joins(_WORK, _BUFFER1, np.multiply))
_add("horizontalFlipWorkImg", "Turn the work image over, left to right.", lambda s, h: s._keep(h, s._image(h)[:, ::-1]))
_add("verticalFlipWorkImg", "Turn the work image over, top to bottom.", lambda s, h: s._keep(h, s._image(h)[::-1]))


def _packed(values: Sequence[Any]) -> bytes:
    return np.array(values, "<f4").tobytes()


def _hsl(image: np.ndarray) -> np.ndarray:
    """Return hue, saturation and lightness from 0 to 1."""
    found = cv2.cvtColor(image.astype(np.float32), cv2.COLOR_RGB2HLS)
    return np.dstack([found[:, :, 0] / 360, found[:, :, 2], found[:, :, 1]])


def _shape_of(white: np.ndarray) -> list[float]:
    """Return the share of white, its centre, its orientation and its roundness."""
    rows, columns = np.nonzero(white)
    if not len(rows):
        return [0.0, 0.5 / white.shape[1], 0.5 / white.shape[0], 0.0, 1.0]
    x, y = columns - columns.mean(), rows - rows.mean()
    a, b, c = float((x * x).sum()), 2 * float((x * y).sum()), float((y * y).sum())
    apart = math.hypot(b, a - c)
    roundness = (a + c - apart) / (a + c + apart) if apart else 1.0
    angle = 0.5 * math.atan2(b, a - c) if apart else 0.0
    return [len(rows) / white.size, columns.mean() / white.shape[1], rows.mean() / white.shape[0], angle, roundness]


def _triggers(found: Sequence[float], share: Sequence[float], expected: Sequence[Any]) -> bool:
    if len(expected) < 8 or not expected[7]:
        return False
    wanted = numbers(expected[:7], 7)
    turn = math.remainder(wanted[4] - found[3], math.tau)
    return (
        abs(share[0] - found[0]) < share[1]
        and abs(wanted[0] - found[1]) < wanted[1]
        and abs(wanted[2] - found[2]) < wanted[3]
        and abs(turn) < wanted[5]
        and found[4] <= wanted[6]
    )


def _box(blob: np.ndarray) -> tuple[float, float, float, float, float]:
    """Return orientation (rad), centre and size, from 0 to 1, of the smallest box around a blob's pixels."""
    rows, columns = np.nonzero(blob)
    corners = np.column_stack([columns, rows]).astype(np.float32)
    (x, y), (wide, high), degrees = cv2.minAreaRect(corners)
    quarters = round(degrees / 90)  # of a turn: the sides are called so that it lies as nearly upright as can be
    if quarters % 2:
        wide, high = high, wide
    height, width = blob.shape
    return math.radians(degrees - 90 * quarters), (x + 0.5) / width, (y + 0.5) / height, wide / width, high / height


def _angles(eye: Eye) -> tuple[float, float]:
    """Return the angles of view along x and y, rad."""
    other = 2 * math.atan(math.tan(eye.angle / 2) * min(eye.width, eye.height) / max(eye.width, eye.height))
    return (eye.angle, other) if eye.width >= eye.height else (other, eye.angle)


def _directions(eye: Eye, columns: int, rows: int, evenly: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return where columns and rows of points lie in the picture, from -1 to 1: x to the left, y up."""
    found = []
    for angle, count in zip(_angles(eye), (columns, rows)):
        at = np.linspace(-angle / 2, angle / 2, count) if count > 1 else np.zeros(1)
        found.append(np.tan(at) / math.tan(angle / 2) if evenly else at / (angle / 2))
    return found[0], found[1]
