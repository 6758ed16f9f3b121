"""Decoding of image messages for display, and tiling of several images."""

from __future__ import annotations

import contextlib
import math

import cv2
import numpy as np
from sensor_msgs.msg import CompressedImage, Image

from drone_sim.files import images
from drone_sim.offline.pictures import depth_to_grey
from drone_sim.ros.core import image_messages

_GREY, _WHITE = (60, 60, 60), (255, 255, 255)
_BLANK_SHAPE = (240, 320)  # px, height and width
_CAPTION = 24  # px, height
_DEPTH_ENCODINGS = ("32FC1", "16UC1")
_MILLIMETRES = 1e-3  # ROS's unit of depth in 16UC1

Size = tuple[int, int]


def decode(message: Image | CompressedImage) -> np.ndarray:
    """Return a message's image as BGR (height, width, 3). Greater depth is darker; unknown depth is black.

    Raises ValueError, in one line, for an image that cannot be shown.
    """
    if hasattr(message, "encoding"):
        try:
            if message.encoding not in _DEPTH_ENCODINGS:
                return image_messages.bgr(message)
            depth = image_messages.pixels(message).astype(float)
        except (ValueError, cv2.error) as error:
            raise ValueError(f"encoding '{message.encoding[:40]}': {' '.join(str(error).split())}") from None
        if message.encoding == "16UC1":
            depth = np.where(depth == 0, np.nan, depth * _MILLIMETRES)
        return depth_to_grey(depth)
    if "compressedDepth" in message.format:
        raise ValueError("compressedDepth is not shown")
    if message.data:
        with contextlib.suppress(OSError):  # PIL does not know the format; OpenCV may
            images.check(message.data)
    picture = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR) if message.data else None
    if picture is None:
        raise ValueError(f"not a picture: format '{message.format}'")
    return picture


def blank(text: str) -> np.ndarray:
    """Return a grey BGR image with a text."""
    picture = np.full((*_BLANK_SHAPE, 3), _GREY, np.uint8)
    _write(picture, text, _BLANK_SHAPE[0] // 2)
    return picture


def tile(pictures: list[tuple[str, np.ndarray]], largest: Size | None = None) -> np.ndarray:
    """Return BGR images with captions in a grid, which is at most as large as `largest` (width, height)."""
    columns = math.ceil(math.sqrt(len(pictures)))
    width = max(picture.shape[1] for _, picture in pictures)
    height = max(picture.shape[0] for _, picture in pictures)
    cells = [_cell(name, picture, width, height) for name, picture in pictures]
    cells += [np.zeros_like(cells[0])] * (-len(cells) % columns)
    rows = [np.hstack(cells[first : first + columns]) for first in range(0, len(cells), columns)]
    grid = np.vstack(rows)
    factor = min(largest[0] / grid.shape[1], largest[1] / grid.shape[0]) if largest else 1.0
    if factor >= 1:
        return grid
    size = max(1, int(grid.shape[1] * factor)), max(1, int(grid.shape[0] * factor))
    return cv2.resize(grid, size, interpolation=cv2.INTER_AREA)


def _cell(name: str, picture: np.ndarray, width: int, height: int) -> np.ndarray:
    """Return an image scaled to fit into width x height, in the middle, below its caption."""
    cell = np.zeros((_CAPTION + height, width, 3), np.uint8)
    _write(cell, name, _CAPTION - 7)
    factor = min(width / picture.shape[1], height / picture.shape[0])
    size = max(1, round(picture.shape[1] * factor)), max(1, round(picture.shape[0] * factor))
    left, top = (width - size[0]) // 2, _CAPTION + (height - size[1]) // 2
    fitted = picture if factor == 1 else cv2.resize(picture, size, interpolation=cv2.INTER_NEAREST)
    cell[top : top + size[1], left : left + size[0]] = fitted
    return cell


def _write(picture: np.ndarray, text: str, row: int) -> None:
    cv2.putText(picture, text, (6, row), cv2.FONT_HERSHEY_SIMPLEX, 0.45, _WHITE, 1, cv2.LINE_AA)
