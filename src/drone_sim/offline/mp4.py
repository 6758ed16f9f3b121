"""An MP4 file with H.264, which plays everywhere, browsers among it; through PyAV's FFmpeg."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from fractions import Fraction
from typing import Final

import av
import numpy as np

from drone_sim.offline.video import VideoError

_CODEC: Final = "libx264"
# Half the size of MPEG-4 Part 2 of the same quality; slower presets take twice the time for a tenth less. The matrix is
# the one by which FFmpeg makes YUV of RGB: where the file does not say so, players guess it from the size.
_QUALITY = {"preset": "veryfast", "crf": "20", "x264-params": "colormatrix=smpte170m"}
_PIXELS = "yuv420p"  # the only ones that all browsers play
_INDEX_FIRST = {"movflags": "faststart"}  # a browser then need not have all of it before it plays
_FINEST = 1000  # of a rate's denominator


class Mp4:
    """A file that is being written."""

    def __init__(self, path: str, rate: float, width: int, height: int):
        """Begin it: so many pictures a second, of such a size (px, even). Raises VideoError."""
        self._path = path
        with _told():
            self._file = av.open(path, "w", format="mp4", options=_INDEX_FIRST)
            self._stream = self._file.add_stream(_CODEC, Fraction(rate).limit_denominator(_FINEST), options=_QUALITY)
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, _PIXELS

    def add(self, picture: np.ndarray) -> None:
        """Add a picture, BGR (height, width, 3). Raises VideoError."""
        with _told():
            self._file.mux(self._stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))

    def close(self) -> None:
        """Write what is left. Raises VideoError."""
        with _told(), self._file:
            self._file.mux(self._stream.encode())

    def count(self) -> int:
        """Return how many pictures the file has, now that it is closed; 0 where it is no video."""
        try:
            with av.open(self._path) as made:
                return made.streams.video[0].frames
        except (av.error.FFmpegError, IndexError):
            return 0


@contextlib.contextmanager
def _told() -> Iterator[None]:
    """Turn what FFmpeg finds wrong into a VideoError."""
    try:
        yield
    except (av.error.FFmpegError, ValueError) as error:  # ValueError: it has no such codec
        raise VideoError(0, f"FFmpeg: {getattr(error, 'strerror', None) or error}") from error
