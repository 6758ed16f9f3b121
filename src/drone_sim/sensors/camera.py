"""Vision sensors on a drone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.outputs import COLOR
from drone_sim.render.renderer import Moment
from drone_sim.render.shutter import Shutter
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.imperfections.photography import Photography
from drone_sim.sensors.sensor import Failure, Reading, Sensor
from drone_sim.sensors.truth import PictureTruth
from drone_sim.sensors.vision import Vision


class CameraFitting(NamedTuple):
    """How one camera is fitted to a vehicle."""

    name: str  # of vehicle and camera, such as drone/front: no other has it, and its noise depends on it
    pose: Callable[[], Matrix]  # world from the optical frame
    velocity: Callable[[], tuple[Vector, Vector]]  # of that frame's origin and of its turn, m/s and rad/s in the world
    clock: Clock


class Camera(Sensor):
    """One vision sensor: where it is, what it sees, and who looks.

    Its period counts simulation steps, for only after those is there anything to see; and it looks only where
    somebody wants to know.
    """

    def __init__(self, parameters: CameraParameters, fitting: CameraFitting, vision: Vision):
        """Take what it is, from where it looks, and what draws."""
        super().__init__(parameters.every)
        self.kind = parameters.kind
        self._photography = Photography(fitting.name, fitting.clock)
        self.change(parameters)
        self.viewers: set[Callable[[], bool]] = set()  # each says whether it looks now
        self.shown = 0  # pictures, to those who look
        self.image: np.ndarray | None = None  # what those who look are shown; None while nobody does
        self.pose, self._velocity = fitting.pose, fitting.velocity
        self.failure: Failure = "ok"
        self.is_linked = False  # whether pictures come over a link, late or not at all
        self.age = 0.0  # s, of `image`
        self._vision = vision

    def watched(self) -> bool:
        """Tell whether anybody looks."""
        return bool(self.viewers) and any(looks() for looks in self.viewers)

    def change(self, parameters: CameraParameters) -> None:
        """Take the rate, the optics and the imperfections of these parameters."""
        self.period = parameters.every
        self.intrinsics = parameters.intrinsics()
        self._photography.change(parameters)
        self._moment: Moment | None = None  # of the last truth
        self._truth: PictureTruth | None = None  # that somebody has asked for since the last picture
        self._drawn: tuple[int, Matrix, PictureTruth] | None = None  # with the last picture
        self._last: dict[str, tuple[int, Matrix, np.ndarray]] = {}  # by kind: the scene's changes, pose, picture

    def take(self, kind: str = "") -> np.ndarray:
        """Return a picture of the scene as it stands, of its own kind or another; as Vision.picture says.

        Colours have the camera's imperfections. Outputs that were asked for in the truth of the last picture are drawn
        together with this one.
        """
        kind = kind or self.kind
        if kind != COLOR:
            return self._vision.picture(kind, self.intrinsics, self._matrix())
        if not self._photography.is_perfect:
            return self._photography.take(self.intrinsics, self._light)
        asked, self._truth = self._truth, None
        if asked is None:
            return self._vision.picture(kind, self.intrinsics, self._matrix())
        return self._taken_with(asked.drawn)

    def _taken_with(self, names: Sequence[str]) -> np.ndarray:
        """Return a picture that is drawn together with outputs, which `truth` then has."""
        truth = self._vision.truth(self.intrinsics, self._matrix(), self._moment)
        if truth is None:
            return self._vision.picture(COLOR, self.intrinsics, self._matrix())
        with self._vision.taking():
            truth.want((COLOR, *names))
        self._drawn = self._vision.changes, self.pose(), truth
        return truth.output(COLOR)

    def meter(self, steps: int) -> None:
        """Look how bright it is, for automatic exposure, if a picture is due after so many steps."""
        if self._photography.is_metering and self.is_due(steps):
            self._photography.meter(self.intrinsics, self._light)

    def _light(self, lens: Intrinsics, shutter: Shutter) -> np.ndarray:
        return self._vision.light(lens, self._matrix(), np.concatenate(self._velocity()), shutter)

    def _matrix(self) -> np.ndarray:
        return np.reshape((*self.pose(), 0, 0, 0, 1), (4, 4))

    def look(self, kind: str = "") -> np.ndarray:
        """Return what it sees now: the last picture of a kind where nothing has changed since, else a new one.

        A frozen camera returns its last picture, a silent one a black picture.
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
        """Return the ground truth of what it sees now, with the motion since the last call; None without OpenGL.

        A silent camera has none.
        """
        if self.failure == "silent":
            return None
        if self._drawn is not None and self._drawn[:2] == (self._vision.changes, self.pose()):
            found: PictureTruth | None = self._drawn[2]
        else:
            found = self._vision.truth(self.intrinsics, self._matrix(), self._moment)
        self._truth, self._drawn = found, None
        self._moment = found.moment if found is not None else None
        return found

    def show(self, steps: int, image: np.ndarray | None, age: float = 0.0) -> None:
        """Hand over a picture that has arrived after so many steps, at an age in s; None for no picture."""
        self.image, self.age = image, age
        if image is not None:
            self.shown += 1
            self.latest = Reading(steps, image)

    def reset(self) -> None:
        """Forget the pictures that were taken."""
        self.image = self.latest = self._moment = self._truth = self._drawn = None
        self._last.clear()
        self._photography.reset()
        self.age = 0.0

    def save_state(self) -> Restore:
        """Return a function that brings back the last picture that was shown, and how it was taken."""
        own = saved(self, "image", "age", "latest", "_last", "period", "intrinsics")
        return in_turn(own, self._photography.save_state())
