"""What draws the pictures of all cameras."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from drone_sim.render.context import RendererUnavailable
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics, Lens, Orthographic
from drone_sim.render.light import decoded
from drone_sim.render.outputs import COLOR
from drone_sim.render.renderer import Moment, Renderer
from drone_sim.render.shutter import Shutter, gathered, moved
from drone_sim.sensors.truth import Identity, Numbered, PictureTruth
from drone_sim.shapes.visual import Visual

_LOG = logging.getLogger(__name__)
TINY = "TinyRenderer"
_OUT_OF_SIGHT = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1e9], [0, 0, 0, 1]])
_AWAY = 1.0  # m, of what is seen: how far it moves in a picture


class Subject(Protocol):
    """What a picture is taken of."""

    changes: int  # another number than before whenever a picture of it may look different

    def visuals(self) -> list[Visual]:
        """Return everything that can be drawn."""

    def visual_poses(self) -> np.ndarray:
        """Return the poses world from visual (N, 4, 4), in the same order."""

    def visual_velocities(self) -> np.ndarray:
        """Return the velocities of their origins and of their turns, (N, 6), m/s and rad/s in the world."""

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

        `identify` returns for each of the subject's visuals, in their order, which object it belongs to.
        """
        self._subject, self._blades, self._identify = subject, blades, identify
        self._shown = -1  # the subject's changes, when its blades were turned

    def picture(self, kind: str, intrinsics: Lens, pose: np.ndarray, shown: np.ndarray | None = None) -> np.ndarray:
        """Return the picture from `pose` (4, 4), world from optical frame.

        `kind` "color": (height, width, 3) uint8 RGB. "depth": (height, width) float32, metres along the
        optical z, NaN beyond the far plane. `shown` (N,) says which visuals there are, None: all. Raises ValueError for
        an orthographic one, or one of some visuals, where there is no OpenGL.
        """
        with self.taking() as renderer:
            if renderer is None:
                if shown is not None:
                    raise ValueError("a picture of only some objects needs OpenGL, and there is no EGL here")
                return self._tiny_picture(kind, intrinsics, pose)
            render = renderer.render if kind == COLOR else renderer.render_depth
            return render(intrinsics, pose, self._poses(shown))

    def _poses(self, shown: np.ndarray | None) -> np.ndarray:
        poses = self._subject.visual_poses()
        return poses if shown is None else np.where(shown[:, None, None], poses, _OUT_OF_SIGHT)

    def numbers(
        self, intrinsics: Lens, pose: np.ndarray, numbers: np.ndarray, shown: np.ndarray | None = None
    ) -> np.ndarray:
        """Return for each pixel the number of its visual, one of `numbers`, (height, width) uint16; 0 for none.

        `shown` as for `picture`. Raises ValueError where there is no OpenGL.
        """
        self._open()
        if self._renderer is None:
            raise ValueError("a picture of the object of each pixel needs OpenGL, and there is no EGL here")
        self._turn_blades()
        self._renderer.set_visuals(self._subject.visuals())
        drawn = self._renderer.render_outputs(("instance",), intrinsics, pose, self._poses(shown), instances=numbers)
        return drawn["instance"]

    def light(self, lens: Intrinsics, pose: np.ndarray, velocity: np.ndarray, shutter: Shutter) -> np.ndarray:
        """Return the light of the picture from `pose`, (height, width, 3) float32; white is 1.

        `velocity` is that of the optical frame's origin and of its turn, (6,), m/s and rad/s in the world. Camera and
        bodies keep their velocities while the shutter is open. Without OpenGL the exposure takes no time.
        """
        speed = lens.fx * (np.linalg.norm(velocity[3:]) + np.linalg.norm(velocity[:3]) / _AWAY)
        with self.taking() as renderer:
            if renderer is None:
                return decoded(self._tiny_picture(COLOR, lens, pose))
            poses, velocities = self._subject.visual_poses(), self._subject.visual_velocities()
            speed += lens.fx * np.linalg.norm(velocities[:, :3], axis=1).max(initial=0.0) / _AWAY

            def draw(after: float, first: int, end: int) -> np.ndarray:
                now = moved(pose, velocity, after), moved(poses, velocities, after)
                return renderer.render_rows(lens, *now, (first, end))

            return gathered(shutter.moments(lens.height, speed), (lens.width, lens.height), draw)

    @contextmanager
    def taking(self) -> Iterator[Renderer | None]:
        """Count a picture, and the time that it takes; give what draws it, None where there is no OpenGL."""
        self._open()
        began = time.perf_counter()
        self._turn_blades()
        if self._renderer is not None:
            self._renderer.set_visuals(self._subject.visuals())
        yield self._renderer
        self.pictures += 1
        self.seconds += time.perf_counter() - began

    def truth(self, intrinsics: Intrinsics, pose: np.ndarray, before: Moment | None) -> PictureTruth | None:
        """Return the truth of the picture from `pose`, with the flow since `before`; None where there is no OpenGL."""
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
        return color if kind == COLOR else depth

    @property
    def renderer(self) -> str:
        """What draws: OpenGL's name for it, "TinyRenderer", or '' before the first picture."""
        if self._renderer is not None:
            return self._renderer.description
        return TINY if self._fallback else ""

    def _open(self) -> None:
        if self._renderer is not None or self._fallback:
            return
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
