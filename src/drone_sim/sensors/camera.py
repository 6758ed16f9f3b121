"""Vision sensors on a drone, and the renderer that they share."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Protocol

import numpy as np

from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.render.context import RendererUnavailable
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics, Lens, Orthographic
from drone_sim.render.renderer import Moment, Renderer
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.sensor import Failure, Reading, Sensor
from drone_sim.sensors.truth import Identity, Numbered, PictureTruth
from drone_sim.shapes.visual import Visual

_LOG = logging.getLogger(__name__)
TINY = "TinyRenderer"
_OUT_OF_SIGHT = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1e9], [0, 0, 0, 1]])


class Subject(Protocol):
    """What a picture is taken of."""

    changes: int  # another number than before whenever a picture of it may look different

    def visuals(self) -> list[Visual]:
        """Return everything that can be drawn."""

    def visual_poses(self) -> np.ndarray:
        """Return the poses world from visual (N, 4, 4), in the same order."""

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return RGB (height, width, 3) and depth (height, width), drawn without OpenGL."""


class TurningBlades(Protocol):
    """The blades of a vehicle's propellers, which turn in pictures alone."""

    turned: bool  # by a script, since they were shown

    def show(self) -> None:
        """Turn them in the subject's pictures to where they are."""


class Vision:
    """Takes pictures of a subject: with OpenGL where EGL is to be had, with the subject's own renderer elsewhere."""

    def __init__(self, samples: int = 0):
        """Make the renderer when the first picture is asked for, after `look_at`: not every run needs one.

        `samples` per pixel smooth the edges, as far as the renderer can.
        """
        self._samples = samples
        self._renderer: Renderer | None = None
        self._fallback = False
        self.pictures, self.seconds = 0, 0.0  # taken by now, and the real time that they took

    def look_at(
        self, subject: Subject, blades: Collection[TurningBlades], identify: Callable[[], list[Identity]] = list
    ) -> None:
        """Take the pictures of this subject from now on, in which blades turn when somebody looks.

        `identify` returns whose each of the subject's visuals is, in their order.
        """
        self._subject, self._blades, self._identify = subject, blades, identify
        self._shown = -1  # the subject's changes, when its blades were turned

    def picture(self, kind: str, intrinsics: Lens, pose: np.ndarray, shown: np.ndarray | None = None) -> np.ndarray:
        """Return the picture from `pose` (4, 4), world from optical frame.

        `kind` "color": (height, width, 3) uint8 RGB. "depth": (height, width) float32, metres along the
        optical z, NaN beyond the far plane. `shown` (N,) says which visuals there are, None: all. Raises ValueError for
        an orthographic one, or one of some visuals, where there is no OpenGL.
        """
        if self._renderer is None and not self._fallback:
            self._open()
        began = time.perf_counter()
        self._turn_blades()
        taken = self._drawn(kind, intrinsics, pose, shown)
        self.pictures += 1
        self.seconds += time.perf_counter() - began
        return taken

    def _drawn(self, kind: str, intrinsics: Lens, pose: np.ndarray, shown: np.ndarray | None) -> np.ndarray:
        if self._renderer is None:
            if shown is not None:
                raise ValueError("a picture of some objects alone needs OpenGL, and there is no EGL here")
            return self._tiny_picture(kind, intrinsics, pose)
        self._renderer.set_visuals(self._subject.visuals())
        render = self._renderer.render if kind == "color" else self._renderer.render_depth
        return render(intrinsics, pose, self._poses(shown))

    def _poses(self, shown: np.ndarray | None) -> np.ndarray:
        poses = self._subject.visual_poses()
        return poses if shown is None else np.where(shown[:, None, None], poses, _OUT_OF_SIGHT)

    def numbers(
        self, intrinsics: Lens, pose: np.ndarray, numbers: np.ndarray, shown: np.ndarray | None = None
    ) -> np.ndarray:
        """Return for each pixel whose it is, (height, width) uint16, 0 for nobody's: of `numbers`, one for each visual.

        `shown` as for `picture`. Raises ValueError where there is no OpenGL.
        """
        if self._renderer is None and not self._fallback:
            self._open()
        if self._renderer is None:
            raise ValueError("a picture of whose each pixel is needs OpenGL, and there is no EGL here")
        self._turn_blades()
        self._renderer.set_visuals(self._subject.visuals())
        drawn = self._renderer.render_outputs(("instance",), intrinsics, pose, self._poses(shown), instances=numbers)
        return drawn["instance"]

    def truth(self, intrinsics: Intrinsics, pose: np.ndarray, before: Moment | None) -> PictureTruth | None:
        """Return what is true of the picture from `pose`, since the one `before`; None where there is no OpenGL."""
        if self._renderer is None and not self._fallback:
            self._open()
        renderer = self._renderer
        if renderer is None:
            return None
        self._turn_blades()
        visuals, poses = self._subject.visuals(), np.array(self._subject.visual_poses())
        numbered = Numbered.of(self._identify())
        renderer.set_visuals(visuals)
        since = before if before is not None and len(before.poses) == len(poses) else Moment(pose, poses)

        def draw(names: Sequence[str]) -> Mapping[str, np.ndarray]:
            return renderer.render_outputs(names, intrinsics, pose, poses, instances=numbered.instances, before=since)

        def alone() -> np.ndarray:
            return renderer.count_alone(intrinsics, pose, poses, numbered.instances)

        return PictureTruth(draw, alone, intrinsics, Moment(pose, poses), visuals, numbered)

    def _tiny_picture(self, kind: str, intrinsics: Lens, pose: np.ndarray) -> np.ndarray:
        if isinstance(intrinsics, (Orthographic, Distorted)):
            raise ValueError("an orthographic picture, or one through a lens, needs OpenGL, and there is no EGL here")
        vertical_fov = 2 * np.arctan(intrinsics.height / 2 / intrinsics.fy)
        color, depth = self._subject.tiny_picture(
            pose, intrinsics.width, intrinsics.height, vertical_fov, intrinsics.near, intrinsics.far
        )
        return color if kind == "color" else depth

    @property
    def renderer(self) -> str:
        """What draws: OpenGL's name for it, "TinyRenderer", or '' before the first picture."""
        if self._renderer is not None:
            return self._renderer.description
        return TINY if self._fallback else ""

    def _open(self) -> None:
        try:
            self._renderer = Renderer(samples=self._samples)
        except RendererUnavailable as error:
            self._fallback = True
            _LOG.warning("%s; pictures come from PyBullet's TinyRenderer, at a few frames per second", error)

    @property
    def changes(self) -> int:
        """Return another number than before whenever a picture may look different."""
        self._turn_blades()
        return self._subject.changes

    def _turn_blades(self) -> None:
        """Turn the blades, once for all cameras."""
        if self._shown != self._subject.changes or any(one.turned for one in self._blades):
            for one in self._blades:
                one.show()
            self._shown = self._subject.changes

    def close(self) -> None:
        """Free the renderer; may be called twice."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


class Camera(Sensor):
    """One vision sensor: where it is, what it sees, and who looks.

    Its period counts simulation steps, for only after those is there anything to see; and it looks only where
    somebody wants to know.
    """

    def __init__(self, parameters: CameraParameters, pose: Callable[[], Matrix], vision: Vision):
        """Take what it is, from where it looks (world from optical frame), and what draws."""
        super().__init__(parameters.every)
        self.kind = parameters.kind
        self.change(parameters)
        self.viewers: set[Callable[[], bool]] = set()  # each says whether it looks now
        self.shown = 0  # pictures, to those who look
        self.image: np.ndarray | None = None  # what those who look are shown; None while nobody does
        self.pose = pose
        self.failure: Failure = "ok"
        self.is_linked = False  # whether pictures come over a link, late or not at all
        self.age = 0.0  # s, of `image`
        self._vision = vision

    def watched(self) -> bool:
        """Tell whether anybody looks."""
        return bool(self.viewers) and any(looks() for looks in self.viewers)

    def change(self, parameters: CameraParameters) -> None:
        """Look as often, and see as much, as these parameters say."""
        self.period = parameters.every
        self.intrinsics = parameters.intrinsics()
        self._moment: Moment | None = None  # of the last truth
        self._last: dict[str, tuple[int, Matrix, np.ndarray]] = {}  # by kind: the scene's changes, pose, picture

    def take(self, kind: str = "") -> np.ndarray:
        """Return a picture of the scene as it stands, of its own kind or another; as Vision.picture says."""
        return self._vision.picture(kind or self.kind, self.intrinsics, np.reshape((*self.pose(), 0, 0, 0, 1), (4, 4)))

    def look(self, kind: str = "") -> np.ndarray:
        """Return what it sees now: the last picture of a kind where nothing has changed since, else a new one.

        Frozen, it sees what it saw; silent, it is dark.
        """
        kind = kind or self.kind
        changes, pose = self._vision.changes, self.pose()
        if self.failure == "silent":
            shape = self.intrinsics.height, self.intrinsics.width
            return np.zeros((*shape, 3), np.uint8) if kind == "color" else np.zeros(shape, np.float32)
        last = self._last.get(kind)
        if last is None or (self.failure != "frozen" and last[:2] != (changes, pose)):
            last = self._last[kind] = changes, pose, self.take(kind)
        return last[2]

    def truth(self) -> PictureTruth | None:
        """Return what is true of what it sees now, and of the way since it was asked last; None without OpenGL.

        A silent camera has none.
        """
        if self.failure == "silent":
            return None
        pose = np.reshape((*self.pose(), 0, 0, 0, 1), (4, 4))
        found = self._vision.truth(self.intrinsics, pose, self._moment)
        self._moment = found.moment if found is not None else None
        return found

    def show(self, steps: int, image: np.ndarray | None, age: float = 0.0) -> None:
        """Let those who look see a picture, which has come after so many steps, of some age (s); None is none."""
        self.image, self.age = image, age
        if image is not None:
            self.shown += 1
            self.latest = Reading(steps, image)

    def reset(self) -> None:
        """Forget the pictures that were taken."""
        self.image = self.latest = self._moment = None
        self._last.clear()
        self.age = 0.0

    def save_state(self) -> Restore:
        """Return a function that brings back the last picture that was shown, and how it was taken."""
        return saved(self, "image", "age", "latest", "_last", "period", "intrinsics")
