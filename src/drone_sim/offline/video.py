"""MP4 video of camera images, with a head-up display."""

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
# Half the size of MPEG-4 Part 2 at the same quality; slower presets take twice the time and save a tenth. The matrix is
# that of FFmpeg's conversion from RGB to YUV; without this entry, players guess it from the size.
_ENCODER_OPTIONS = {"preset": "veryfast", "crf": "20", "x264-params": "colormatrix=smpte170m"}
_PIXEL_FORMAT = "yuv420p"  # the only one that all browsers play
_CONTAINER_OPTIONS = {"movflags": "faststart"}  # the index comes first, so that a browser can play it while loading
_MAX_DENOMINATOR = 1000  # of the frame rate
_MIN_SIDE = 240  # px; smaller images are enlarged to make the display readable
_MAX_SIDE = 4096  # px, of an enlarged image
MAX_RATE = 240.0  # pictures per second


class Video:
    """An MP4 file with H.264, which all players and browsers support; created by `writing_to`."""

    def __init__(self, path: str, rate: float):
        """Create a video at `path` with `rate` images per second; the file is created with the first image."""
        self.pictures = 0
        self.size = 0, 0  # px, width and height
        self.rate = rate
        self._path = path
        self._file: Any = None  # of PyAV; None before the first image
        self._stream: Any = None

    def add(self, picture: np.ndarray, flight: hud.HudState | None, times: int = 1) -> None:
        """Add an image, BGR (height, width, 3), `times` times, with the display drawn over it unless `flight` is None.

        Images are scaled to the first one's size. Raises OutputError.
        """
        shown = _enlarged(picture)
        if flight is not None:
            hud.draw(shown, flight)
        if self._file is None:
            self.size = shown.shape[1], shown.shape[0]
            with _ffmpeg_errors():
                self._file = av.open(self._path, "w", format="mp4", options=_CONTAINER_OPTIONS)
                rate = Fraction(self.rate).limit_denominator(_MAX_DENOMINATOR)
                self._stream = self._file.add_stream(_CODEC, rate, options=_ENCODER_OPTIONS)
            self._stream.width, self._stream.height = self.size
            self._stream.pix_fmt = _PIXEL_FORMAT
        elif self.size != (shown.shape[1], shown.shape[0]):
            shown = cv2.resize(shown, self.size)
        for _ in range(times):
            with _ffmpeg_errors():
                self._file.mux(self._stream.encode(av.VideoFrame.from_ndarray(shown, format="bgr24")))
            self.pictures += 1

    def close(self) -> None:
        """Write the remaining data. Raises OutputError."""
        if self._file is not None:
            with _ffmpeg_errors(), self._file:
                self._file.mux(self._stream.encode())

    def finish(self) -> None:
        """Close the file. Raises OSError if it has no image or could not be written completely."""
        if self._file is None:
            raise OSError(0, "no picture was received: no video is written")
        self.close()
        written = 0
        with contextlib.suppress(av.error.FFmpegError, IndexError), av.open(self._path) as file:
            written = file.streams.video[0].frames
        if written != self.pictures:
            raise OSError(0, f"only {written} of {self.pictures} pictures were written; is the disk full?")

    def __str__(self) -> str:
        width, height = self.size
        return f"{width} x {height}, {self.pictures} pictures, {self.pictures / self.rate:.2f} s, H.264"


def check(path: str) -> None:
    """Raise OSError, in one line, if `path` cannot be written, and ValueError if it does not end in .mp4."""
    if Path(path).suffix.lower() != ".mp4":
        raise ValueError(f"{path}: must end in .mp4")
    writing.check_writable(path)


@contextlib.contextmanager
def writing_to(path: str, rate: float) -> Iterator[Video]:
    """Yield a video to write, with `rate` images per second, which replaces `path` at the end.

    Without an image, an existing file is kept. Raises OSError, in one line that names the file.
    """
    with writing.replacing(path, binary=True) as file:
        video = Video(file.name, rate)
        try:
            yield video
        except BaseException as error:  # including Ctrl-C
            video.close()  # the part written so far can be played
            if not video.pictures:
                raise OSError(0, str(error) or "interrupted") from error
            raise
        video.finish()


def _enlarged(picture: np.ndarray) -> np.ndarray:
    """Return a copy, scaled by an integer if small, padded to even sides as codecs require."""
    shortest, longest = sorted(picture.shape[:2])
    factor = max(1, min(-(-_MIN_SIDE // shortest), _MAX_SIDE // longest))
    enlarged = np.repeat(np.repeat(picture, factor, axis=0), factor, axis=1)
    missing = [max(side % 2, _MIN_SIDE - side) for side in enlarged.shape[:2]]
    return cv2.copyMakeBorder(enlarged, 0, missing[0], 0, missing[1], cv2.BORDER_REPLICATE)


@contextlib.contextmanager
def _ffmpeg_errors() -> Iterator[None]:
    """Convert FFmpeg's errors into OutputError."""
    try:
        yield
    except (av.error.FFmpegError, ValueError) as error:  # ValueError: unknown codec
        raise OutputError(0, f"FFmpeg: {getattr(error, 'strerror', None) or error}") from error


# ---- recording of a flight without ROS, with the images that the camera's topic would have


def rate_of(camera: CameraParameters, time_step: float) -> float:
    """Return a camera's images per second of simulated time. Raises ValueError if there are too many."""
    rate = 1 / (time_step * camera.every)
    if rate > MAX_RATE:
        raise ValueError(f"--video: {rate:g} pictures a second; at most {MAX_RATE:g} can be shown")
    return rate


class CameraRecorder:
    def __init__(self, video: Video, simulation: Simulation, vehicle: str, camera: str):
        """Enable a camera of a vehicle, and record its images in `video`."""
        self._video = video
        self._vehicle = simulation.vehicles[vehicle]
        self._camera = self._vehicle.cameras[camera]
        self._camera.viewers.add(lambda: True)

    def add(self, simulation: Simulation) -> None:
        """Add the camera's image of the last step, if it took one. Raises OSError."""
        if self._camera.image is not None:
            row = (simulation.time, *(number for part in self._vehicle.body.state for number in part))
            state = doing(self._vehicle) if simulation.running else "stopped"
            self._video.add(to_color(self._camera.image), hud.HudState.of(row, state))

    def __str__(self) -> str:
        return str(self._video)


@contextlib.contextmanager
def filming(path: str, simulation: Simulation, vehicle: str, camera: str) -> Iterator[CameraRecorder]:
    """Yield the recorder of a flight; the video replaces `path` at the end. Raises OSError."""
    parameters = next(item for item in simulation.parameters.fleet if item.name == vehicle).cameras[camera]
    with writing_to(path, rate_of(parameters, simulation.parameters.time_step)) as video:
        yield CameraRecorder(video, simulation, vehicle, camera)
