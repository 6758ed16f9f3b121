"""Pictures as an MP4 file, with what the drone does written over them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from drone_sim.files import writing
from drone_sim.offline import hud

if TYPE_CHECKING:
    from drone_sim.offline.mp4 import Mp4

_SMALLEST = 240  # px, of width and height; smaller pictures are enlarged, or nobody could read the display
_LARGEST = 4096  # px, that it makes of their sides
_HALF = 3.0  # m, at which depth is shown half as bright as right in front
MAX_RATE = 240.0  # pictures per second


class VideoError(OSError):
    """The video cannot be written on; what there is of it is not kept."""


class Video:
    """An MP4 file that is being written; made by `writing_to`."""

    def __init__(self, path: str, rate: float):
        """Take the file, and how many pictures a second it has."""
        self.pictures = 0
        self.size = 0, 0  # px, width and height
        self.rate = rate
        self._path = path
        self._writer: Mp4 | None = None

    def add(self, picture: np.ndarray, flight: hud.Flight | None, times: int = 1) -> None:
        """Add a picture, BGR (height, width, 3), so many times, with the display over it where there is a flight.

        All are of the first one's size. Raises OSError.
        """
        shown = _enlarged(picture)
        if flight is not None:
            hud.draw(shown, flight)
        if self._writer is None:
            self.size = shown.shape[1], shown.shape[0]
            self._writer = self._opened()
        elif self.size != (shown.shape[1], shown.shape[0]):
            shown = cv2.resize(shown, self.size)
        for _ in range(times):
            self._writer.add(shown)
            self.pictures += 1

    def _opened(self) -> Mp4:
        from drone_sim.offline.mp4 import Mp4  # PyAV takes a while to import, and most flights are not filmed

        return Mp4(self._path, self.rate, *self.size)

    def close(self) -> None:
        """Write what is left. Raises OSError."""
        if self._writer is not None:
            self._writer.close()

    def finish(self) -> None:
        """Close it. Raises OSError without a picture, and where not all could be written."""
        if self._writer is None:
            raise OSError(0, "no picture came, nothing is written")
        self.close()
        there = self._writer.count()
        if there != self.pictures:
            raise OSError(0, f"{there} of {self.pictures} pictures could be written; is the disk full?")

    def __str__(self) -> str:
        """Return what it is, in words."""
        width, height = self.size
        return f"{width} x {height}, {self.pictures} pictures, {self.pictures / self.rate:.2f} s, H.264"


def check(path: str) -> None:
    """Raise OSError, in one line, where `path` cannot become a video, and ValueError where it is not to be an MP4."""
    if Path(path).suffix.lower() != ".mp4":
        raise ValueError(f"{path}: must end in .mp4")
    writing.check(path)


@contextlib.contextmanager
def writing_to(path: str, rate: float) -> Iterator[Video]:
    """Give a video to write, `rate` pictures per second, which takes the place of `path` at the end.

    Without a picture there is no file, and the last one stays. Raises OSError, in one line that names the file.
    """
    with writing.replacing(path, binary=True) as file:
        video = Video(file.name, rate)
        try:
            yield video
        except BaseException as error:  # Ctrl-C among them
            video.close()  # what there is of it can be played
            if not video.pictures:
                raise OSError(0, str(error) or "interrupted") from error
            raise
        video.finish()


def to_color(picture: np.ndarray) -> np.ndarray:
    """Return a camera's picture, RGB or depth (m), as BGR; depth is the darker the farther, black where it is none."""
    if picture.ndim == 3:
        return cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    return depth_to_grey(picture)


def depth_to_grey(depth: np.ndarray) -> np.ndarray:
    """Return depth (height, width) in m as a grey picture, BGR: the darker the farther, black where there is none."""
    with np.errstate(invalid="ignore"):
        grey = 255 / (1 + np.maximum(np.nan_to_num(depth.astype(float), nan=np.inf), 0) / _HALF)
    return cv2.cvtColor(grey.astype(np.uint8), cv2.COLOR_GRAY2BGR)


def _enlarged(picture: np.ndarray) -> np.ndarray:
    """Return a copy, a whole number of times as large where it is small, and with even sides, as codecs want them."""
    shortest, longest = sorted(picture.shape[:2])
    factor = max(1, min(-(-_SMALLEST // shortest), _LARGEST // longest))
    large = np.repeat(np.repeat(picture, factor, axis=0), factor, axis=1)
    missing = [max(side % 2, _SMALLEST - side) for side in large.shape[:2]]
    return cv2.copyMakeBorder(large, 0, missing[0], 0, missing[1], cv2.BORDER_REPLICATE)
