"""Pictures as an MP4 file, with what the drone does written over them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import av
import cv2
import numpy as np

from drone_sim.files import writing
from drone_sim.offline import hud
from drone_sim.offline.pictures import to_color
from drone_sim.offline.recording import OutputError
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.vehicles.situation import doing

_CODEC: Final = "libx264"
# Half the size of MPEG-4 Part 2 of the same quality; slower presets take twice the time for a tenth less. The matrix is
# the one by which FFmpeg makes YUV of RGB: where the file does not say so, players guess it from the size.
_QUALITY = {"preset": "veryfast", "crf": "20", "x264-params": "colormatrix=smpte170m"}
_PIXELS = "yuv420p"  # the only ones that all browsers play
_INDEX_FIRST = {"movflags": "faststart"}  # a browser then need not have all of it before it plays
_FINEST = 1000  # of a rate's denominator
_SMALLEST = 240  # px, of width and height; smaller pictures are enlarged, or nobody could read the display
_LARGEST = 4096  # px, that it makes of their sides
MAX_RATE = 240.0  # pictures per second


class Video:
    """An MP4 file with H.264, which plays everywhere, browsers among it, that FFmpeg writes; made by `writing_to`."""

    def __init__(self, path: str, rate: float):
        """Begin with no picture; the file at `path` has `rate` pictures a second."""
        self.pictures = 0
        self.size = 0, 0  # px, width and height
        self.rate = rate
        self._path = path
        self._file: Any = None  # of PyAV; there is none before the first picture
        self._stream: Any = None

    def add(self, picture: np.ndarray, flight: hud.HudState | None, times: int = 1) -> None:
        """Add a picture, BGR (height, width, 3), so many times, with the display over it where there is a flight.

        All are of the first one's size. Raises OutputError.
        """
        shown = _enlarged(picture)
        if flight is not None:
            hud.draw(shown, flight)
        if self._file is None:
            self.size = shown.shape[1], shown.shape[0]
            self._begin()
        elif self.size != (shown.shape[1], shown.shape[0]):
            shown = cv2.resize(shown, self.size)
        for _ in range(times):
            with _ffmpeg_errors():
                self._file.mux(self._stream.encode(av.VideoFrame.from_ndarray(shown, format="bgr24")))
            self.pictures += 1

    def _begin(self) -> None:
        with _ffmpeg_errors():
            self._file = av.open(self._path, "w", format="mp4", options=_INDEX_FIRST)
            rate = Fraction(self.rate).limit_denominator(_FINEST)
            self._stream = self._file.add_stream(_CODEC, rate, options=_QUALITY)
        self._stream.width, self._stream.height = self.size
        self._stream.pix_fmt = _PIXELS

    def close(self) -> None:
        """Write what is left. Raises OutputError."""
        if self._file is not None:
            with _ffmpeg_errors(), self._file:
                self._file.mux(self._stream.encode())

    def finish(self) -> None:
        """Close it. Raises OSError without a picture, and where not all could be written."""
        if self._file is None:
            raise OSError(0, "no picture was received: no video is written")
        self.close()
        there = 0
        with contextlib.suppress(av.error.FFmpegError, IndexError), av.open(self._path) as made:
            there = made.streams.video[0].frames
        if there != self.pictures:
            raise OSError(0, f"only {there} of {self.pictures} pictures were written; is the disk full?")

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


def _enlarged(picture: np.ndarray) -> np.ndarray:
    """Return a copy, a whole number of times as large where it is small, and with even sides, as codecs want them."""
    shortest, longest = sorted(picture.shape[:2])
    factor = max(1, min(-(-_SMALLEST // shortest), _LARGEST // longest))
    large = np.repeat(np.repeat(picture, factor, axis=0), factor, axis=1)
    missing = [max(side % 2, _SMALLEST - side) for side in large.shape[:2]]
    return cv2.copyMakeBorder(large, 0, missing[0], 0, missing[1], cv2.BORDER_REPLICATE)


@contextlib.contextmanager
def _ffmpeg_errors() -> Iterator[None]:
    """Turn what FFmpeg finds wrong into an OutputError."""
    try:
        yield
    except (av.error.FFmpegError, ValueError) as error:  # ValueError: it has no such codec
        raise OutputError(0, f"FFmpeg: {getattr(error, 'strerror', None) or error}") from error


# ---- of a flight without ROS: what one camera of a vehicle sees, as its topic would show it


def rate_of(camera: CameraParameters, time_step: float) -> float:
    """Return how many pictures it takes in a second of simulated time. Raises ValueError for too many."""
    rate = 1 / (time_step * camera.every)
    if rate > MAX_RATE:
        raise ValueError(f"--video: {rate:g} pictures a second; at most {MAX_RATE:g} can be shown")
    return rate


class CameraRecorder:
    """Adds a picture to a video whenever the camera has taken one."""

    def __init__(self, video: Video, simulation: Simulation, vehicle: str, camera: str):
        """Let a `camera` of a `vehicle` of a `simulation` take pictures, for a `video`."""
        self._video = video
        self._vehicle = simulation.vehicles[vehicle]
        self._camera = self._vehicle.cameras[camera]
        self._camera.viewers.add(lambda: True)

    def add(self, simulation: Simulation) -> None:
        """Take what the camera has seen in the last step, if it was its turn. Raises OSError."""
        if self._camera.image is not None:
            row = (simulation.time, *(number for part in self._vehicle.body.state for number in part))
            state = self._state(simulation)
            self._video.add(to_color(self._camera.image), hud.HudState.of(row, state))

    def _state(self, simulation: Simulation) -> str:
        return doing(self._vehicle) if simulation.running else "stopped"

    def __str__(self) -> str:
        """Return what it has become, in words."""
        return str(self._video)


@contextlib.contextmanager
def filming(path: str, simulation: Simulation, vehicle: str, camera: str) -> Iterator[CameraRecorder]:
    """Give the film of a flight, which takes the place of `path` at the end. Raises OSError."""
    parameters = next(one for one in simulation.parameters.fleet if one.name == vehicle).cameras[camera]
    with writing_to(path, rate_of(parameters, simulation.parameters.time_step)) as made:
        yield CameraRecorder(made, simulation, vehicle, camera)
