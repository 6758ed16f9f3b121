"""`simVision`: filters for pictures. Each vision sensor has a work image and two buffers.

An image is (height, width, 3), red, green and blue from 0 to 1, bottom row first, as in V-REP.
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
_MOST = 100  # sensors with images in one script
_MOST_POINTS = 100_000
_EDGES = 27.0 * np.eye(9)[4].reshape(3, 3) - 3.0  # kernel: a pixel minus the mean of its neighbourhood


class ImageFilters(Functions):
    """Image filters for pictures of vision sensors."""

    def __init__(self, *arguments: Any):
        """Create it without images; `arguments` are those of Functions."""
        super().__init__(*arguments)
        self._sensors = VisionSensors(*arguments)
        self._images: dict[tuple[int, str], np.ndarray] = {}

    # ---- from and to sensors

    @simVision("45")
    def sensorImgToWorkImg(self, handle: Handle) -> None:
        """Copy a sensor's picture to the work image."""
        self._store(handle, self._picture_of(handle))

    @simVision("45")
    def sensorDepthMapToWorkImg(self, handle: Handle) -> None:
        """Copy a sensor's depths to the work image, as grey values: 0 at the near plane, 1 at the far plane."""
        depths = self._sensors._depths(self._handle(handle), (0, 0), (0, 0))
        self._store(handle, np.repeat(depths[:, :, None], 3, axis=2))

    @simVision("45", workImgToSensorDepthMap="45")
    def workImgToSensorImg(self, handle: Handle, _removeBuffer: bool = True) -> None:
        """Do nothing: a script cannot change a sensor's picture."""
        self._image(handle)
        self._ignored.log(
            "workImgToSensorImg", "a script cannot change the sensor's picture; accepted and ignored", "simVision"
        )

    @simVision("45")
    def uniformImgToWorkImg(self, handle: Handle, color: ThreeNumbers) -> None:
        """Fill the work image with a color."""
        self._store(handle, np.broadcast_to(np.array(numbers(color, 3)), self._picture_of(handle).shape).copy())

    # ---- operations on all pixels

    @simVision("45")
    def intensityScaleOnWorkImg(self, handle: Handle, start: Number, end: Number, greyScale: bool) -> None:
        """Make the work image grey, and scale its brightness: 0 becomes `start`, and 1 becomes `end`."""
        if not greyScale:
            raise ValueError("color scales are not supported: greyScale must be true")
        low, high = numbers((start, end), 2)
        grey = low + (high - low) * self._image(handle).mean(2)
        self._store(handle, np.repeat(grey[:, :, None], 3, axis=2))

    @simVision("45")
    def normalizeWorkImg(self, handle: Handle) -> None:
        """Scale the work image to the range from 0 to 1."""
        image = self._image(handle)
        low, high = image.min(), image.max()
        self._store(handle, (image - low) / (high - low) if high > low else np.zeros_like(image))

    @simVision("45")
    def selectiveColorOnWorkImg(
        self, handle: Handle, color: ThreeNumbers, colorTolerance: ThreeNumbers, rgb: bool, keep: bool, toBuffer1: bool
    ) -> None:
        """Make the pixels within a tolerance of a color black, in RGB or HSL; with `keep`, all others.

        `toBuffer1`: copy the pixels that become black to buffer 1.
        """
        image, tolerance = self._image(handle), np.array(numbers(colorTolerance, 3))
        difference = np.abs((image if rgb else _hsl(image)) - numbers(color, 3))
        if not rgb:
            difference[:, :, 0] = np.minimum(difference[:, :, 0], 1 - difference[:, :, 0])  # hues are cyclic
        removed = (difference > tolerance + 1e-6).any(2) == bool(keep)
        if toBuffer1:
            self._store(handle, np.where(removed[:, :, None], image, 0.0), _BUFFER1)
        self._store(handle, np.where(removed[:, :, None], 0.0, image))

    @simVision("45")
    def edgeDetectionOnWorkImg(self, handle: Handle, threshold: Number) -> None:
        """Make edges white and all other pixels black."""
        found = cv2.filter2D(self._image(handle), -1, _EDGES, borderType=cv2.BORDER_REPLICATE)
        edges = found.mean(2) > numbers((threshold,), 1)[0]
        self._store(handle, np.repeat(edges[:, :, None], 3, axis=2).astype(float))

    # ---- detection

    @simVision("45")
    def binaryWorkImg(
        self, handle: Handle, threshold: Number, oneProportion: Number, oneTol: Number, *expected: Any
    ) -> tuple[bool, bytes]:
        """Make pixels at least as bright as a threshold white, others black; return whether it triggers, and a packet.

        The packet has the proportion of white, its centre (x, y from 0 to 1), its orientation (rad) and its roundness.
        The other arguments are xCenter, xCenterTol, yCenter, yCenterTol, orient, orientTol, roundness, enableTrigger.
        """
        white = self._image(handle).mean(2) >= numbers((threshold,), 1)[0]
        self._store(handle, np.repeat(white[:, :, None], 3, axis=2).astype(float))
        found = _shape_of(white)
        return _triggers(found, numbers((oneProportion, oneTol), 2), expected), _packed(found)

    @simVision("45")
    def blobDetectionOnWorkImg(
        self, handle: Handle, threshold: Number, minBlobSize: Number, modifyWorkImage: bool = False, *_overlay: Any
    ) -> tuple[bool, bytes]:
        """Find blobs with at least a brightness; return false and a packet: their number, 6, and 6 numbers for each.

        These are its proportion of the picture, its orientation (rad), its centre and its size (from 0 to 1). Blobs
        smaller than `minBlobSize` become black.
        """
        image = self._image(handle)
        least, smallest = numbers((threshold, minBlobSize), 2)
        count, labels, stats, _ = cv2.connectedComponentsWithStats((image.mean(2) >= least).astype(np.uint8))
        areas = stats[:, cv2.CC_STAT_AREA] / labels.size
        large = [label for label in range(1, count) if areas[label] >= smallest]
        lost = (labels > 0) & ~np.isin(labels, large) | (labels == 0) & bool(modifyWorkImage)
        self._store(handle, np.where(lost[:, :, None], 0.0, image))
        blobs = [one for label in large for one in (areas[label], *_box(labels == label))]
        return False, _packed([len(large), 6, *blobs])

    @simVision("45")
    def changedPixelsOnWorkImg(self, handle: Handle, threshold: Number) -> tuple[bool, bytes]:
        """Compare the work image with that of the last call; return whether pixels have changed, and a packet.

        The packet has the proportion of pixels that have changed by at least a threshold. These become white in the
        work image.
        """
        image, (least,) = self._image(handle), numbers((threshold,), 1)
        before = self._images.get((self._handle(handle), _BUFFER1), image)
        changed = np.abs(image.mean(2) - before.mean(2)) >= least
        self._store(handle, image, _BUFFER1)
        self._store(handle, np.repeat(changed[:, :, None], 3, axis=2).astype(float))
        return bool(changed.any()), _packed([changed.mean()])

    @simVision("45")
    def coordinatesFromWorkImg(
        self,
        handle: Handle,
        xyPointCount: Sequence[int],
        evenlySpacedInAngularSpace: bool,
        returnColorData: bool = False,
    ) -> tuple[bool, bytes, bytes]:
        """Return false, and a packet with the points for the depths in a perspective sensor's work image.

        The packet has the numbers of points along x and y, and for each x, y, z (m, in the sensor's frame, or with
        sim.handleflag_abscoords in the world frame) and the distance (m). Then follow their colors, from buffer 1.
        """
        eye, image = self._eye(handle), self._image(handle)
        columns, rows = map(int, numbers(xyPointCount, 2))
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

    # ---- images

    def save_state(self) -> Restore:
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
        """Return an image of a sensor. Raises ValueError if it does not exist yet."""
        number = self._handle(handle)
        if (number, which) not in self._images:
            raise ValueError(f"'{self._objects[number].name}' has no {which} yet: call sensorImgToWorkImg first")
        return self._images[number, which]

    def _store(self, handle: int, image: np.ndarray, which: str = _WORK) -> None:
        key = self._handle(handle), which
        if key not in self._images and len(self._images) >= 3 * _MOST:
            raise ValueError(f"a script can filter the pictures of at most {_MOST} sensors")
        self._images[key] = image


def _add(name: str, doc: str, result: Callable[[ImageFilters, int], None]) -> None:
    """Add a function whose only argument is a sensor."""

    def call(self: ImageFilters, handle: Handle) -> None:
        result(self, handle)

    simVision.add(ImageFilters, call, name, doc, "45")


def _copies(source: str, target: str) -> Callable[[ImageFilters, int], None]:
    return lambda self, handle: self._store(handle, self._image(handle, source), target)


def _swaps(name1: str, name2: str) -> Callable[[ImageFilters, int], None]:
    def swap(self: ImageFilters, handle: int) -> None:
        first, second = self._image(handle, name1), self._image(handle, name2)
        self._store(handle, second, name1)
        self._store(handle, first, name2)

    return swap


def _joins(target: str, other: str, join: Callable[[Any, Any], Any]) -> Callable[[ImageFilters, int], None]:
    return lambda self, handle: self._store(
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
_add("subtractBuffer1FromWorkImg", "Subtract buffer 1 from the work image.", _joins(_WORK, _BUFFER1, np.subtract))
_add("subtractWorkImgFromBuffer1", "Subtract the work image from buffer 1.", _joins(_BUFFER1, _WORK, np.subtract))
_add("multiplyWorkImgWithBuffer1", "Multiply the work image by buffer 1.", _joins(_WORK, _BUFFER1, np.multiply))
_add("horizontalFlipWorkImg", "Flip the work image left to right.", lambda s, h: s._store(h, s._image(h)[:, ::-1]))
_add("verticalFlipWorkImg", "Flip the work image top to bottom.", lambda s, h: s._store(h, s._image(h)[::-1]))


def _packed(values: Sequence[Any]) -> bytes:
    return np.array(values, "<f4").tobytes()


def _hsl(image: np.ndarray) -> np.ndarray:
    """Return hue, saturation and lightness from 0 to 1."""
    found = cv2.cvtColor(image.astype(np.float32), cv2.COLOR_RGB2HLS)
    return np.dstack([found[:, :, 0] / 360, found[:, :, 2], found[:, :, 1]])


def _shape_of(white: np.ndarray) -> list[float]:
    """Return the proportion of white, its centre, its orientation and its roundness."""
    rows, columns = np.nonzero(white)
    if not len(rows):
        return [0.0, 0.5 / white.shape[1], 0.5 / white.shape[0], 0.0, 1.0]
    x, y = columns - columns.mean(), rows - rows.mean()
    a, b, c = float((x * x).sum()), 2 * float((x * y).sum()), float((y * y).sum())
    difference = math.hypot(b, a - c)  # of the two principal moments
    roundness = (a + c - difference) / (a + c + difference) if difference else 1.0
    angle = 0.5 * math.atan2(b, a - c) if difference else 0.0
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
    """Return orientation (rad), centre and size (0 to 1) of the smallest rectangle around a blob's pixels."""
    rows, columns = np.nonzero(blob)
    corners = np.column_stack([columns, rows]).astype(np.float32)
    (x, y), (wide, high), degrees = cv2.minAreaRect(corners)
    quarters = round(degrees / 90)  # quarter turns, which are removed so that the rectangle is nearly upright
    if quarters % 2:
        wide, high = high, wide
    height, width = blob.shape
    return math.radians(degrees - 90 * quarters), (x + 0.5) / width, (y + 0.5) / height, wide / width, high / height


def _angles(eye: Eye) -> tuple[float, float]:
    """Return the angles of view along x and y, rad."""
    other = 2 * math.atan(math.tan(eye.angle / 2) * min(eye.width, eye.height) / max(eye.width, eye.height))
    return (eye.angle, other) if eye.width >= eye.height else (other, eye.angle)


def _directions(eye: Eye, columns: int, rows: int, evenly: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of columns and rows of points in the picture, from -1 to 1: x to the left, y up."""
    found = []
    for angle, count in zip(_angles(eye), (columns, rows)):
        at = np.linspace(-angle / 2, angle / 2, count) if count > 1 else np.zeros(1)
        found.append(np.tan(at) / math.tan(angle / 2) if evenly else at / (angle / 2))
    return found[0], found[1]
