"""Cameras on a vehicle, colour or depth."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.outputs import COLOR
from drone_sim.render.renderer import FrameState
from drone_sim.render.shutter import Shutter
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.imperfections.photography import Photography
from drone_sim.sensors.sensor import Failure, Reading, Sensor
from drone_sim.sensors.truth import PictureTruth
from drone_sim.sensors.vision import Vision


class CameraMounting(NamedTuple):
    name: str  # unique, such as drone/front; seeds the noise
    pose: Callable[[], Matrix]  # transform world-from-optical
    velocity: Callable[[], tuple[Vector, Vector]]  # of the optical frame, linear (m/s) and angular (rad/s), world
    clock: Clock


class Camera(Sensor):
    """A vision sensor. Its period counts simulation steps; it renders only if a viewer wants the image."""

    def __init__(self, parameters: CameraParameters, mounting: CameraMounting, vision: Vision):
        super().__init__(parameters.every)
        self.kind = parameters.kind
        self.photography = Photography(mounting.name, mounting.clock)
        self.change(parameters)
        self.viewers: set[Callable[[], bool]] = set()  # each returns whether it wants images now
        self.shown = 0  # number of images delivered to the viewers
        self.image: np.ndarray | None = None  # the last delivered image; None without viewers
        self.pose, self._velocity = mounting.pose, mounting.velocity
        self.failure: Failure = "ok"
        self.is_linked = False  # whether images are delayed or lost by a simulated link
        self.age = 0.0  # s, of `image` at its delivery
        self._vision = vision

    def watched(self) -> bool:
        """Return whether any viewer wants images now."""
        return any(wants_images() for wants_images in self.viewers)

    def change(self, parameters: CameraParameters) -> None:
        """Apply the rate, optics and imperfections of `parameters`."""
        self.period = parameters.every
        self.intrinsics = parameters.intrinsics()
        self.photography.change(parameters)
        self._moment: FrameState | None = None  # of the last ground truth
        self._truth: PictureTruth | None = None  # requested since the last image
        self._drawn: tuple[int, Matrix, PictureTruth] | None = None  # scene changes, pose, truth of the last image
        self._last: dict[str, tuple[int, Matrix, np.ndarray]] = {}  # by kind: scene changes, pose, image

    def take(self, kind: str = "") -> np.ndarray:
        """Render an image of the camera's or another kind, as `Vision.picture` does.

        Colour images have the camera's imperfections. Outputs that were used of the previous image's ground truth are
        rendered in the same pass.
        """
        kind = kind or self.kind
        if kind != COLOR:
            return self._vision.picture(kind, self.intrinsics, self._matrix())
        if not self.photography.is_perfect:
            return self.photography.take(self.intrinsics, self._light)
        requested, self._truth = self._truth, None
        truth = requested and self._vision.truth(self.intrinsics, self._matrix(), self._moment)
        if requested is None or truth is None:
            return self._vision.picture(kind, self.intrinsics, self._matrix())
        with self._vision.taking():
            truth.want((COLOR, *requested.drawn))  # which `truth` then finds ready
        self._drawn = self._vision.changes, self.pose(), truth
        return truth.output(COLOR)

    def meter(self) -> None:
        """Measure the brightness for automatic exposure."""
        self.photography.meter(self.intrinsics, self._light)

    def _light(self, lens: Intrinsics, shutter: Shutter) -> np.ndarray:
        return self._vision.light(lens, self._matrix(), np.concatenate(self._velocity()), shutter)

    def _matrix(self) -> np.ndarray:
        return np.reshape((*self.pose(), 0, 0, 0, 1), (4, 4))

    def look(self, kind: str = "") -> np.ndarray:
        """Return the present image: the last one if neither scene nor pose has changed since, else a new one.

        A frozen camera returns its last image, a silent one a black image.
        """
        kind = kind or self.kind
        changes, pose = self._vision.changes, self.pose()
        if self.failure == "silent":
            shape = self.intrinsics.height, self.intrinsics.width
            return np.zeros((*shape, 3), np.uint8) if kind == COLOR else np.zeros(shape, np.float32)
        last = self._last.get(kind)
        if last is None or (self.failure != "frozen" and last[:2] != (changes, pose)):
            last = self._last[kind] = changes, pose, self.take(kind)
        return last[2]

    def truth(self) -> PictureTruth | None:
        """Return the ground truth of the present image, with the motion since the last call.

        None without OpenGL, and for a silent camera.
        """
        if self.failure == "silent":
            return None
        if self._drawn is not None and self._drawn[:2] == (self._vision.changes, self.pose()):
            truth: PictureTruth | None = self._drawn[2]
        else:
            truth = self._vision.truth(self.intrinsics, self._matrix(), self._moment)
        self._truth, self._drawn = truth, None
        self._moment = truth.moment if truth is not None else None
        return truth

    def show(self, steps: int, image: np.ndarray | None, age: float = 0.0) -> None:
        """Deliver an image at step `steps`, `age` seconds after it was taken; None removes the present one."""
        self.image, self.age = image, age
        if image is not None:
            self.shown += 1
            self.latest = Reading(steps, image)

    def reset(self) -> None:
        """Forget all images, and reset the exposure."""
        self.image = self.latest = self._moment = self._truth = self._drawn = None
        self._last.clear()
        self.photography.reset()
        self.age = 0.0

    def save_state(self) -> Restore:
        image = saved(self, "image", "age", "latest", "_last", "period", "intrinsics")
        return in_turn(image, self.photography.save_state())
