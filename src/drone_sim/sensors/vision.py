"""Renders the images of all cameras."""

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
from drone_sim.render.renderer import FrameState, Renderer
from drone_sim.render.shutter import Shutter, gathered, moved
from drone_sim.sensors.truth import Numbered, ObjectLabel, PictureTruth
from drone_sim.shapes.visual import Visual

_LOG = logging.getLogger(__name__)
TINY = "TinyRenderer"
_OUT_OF_SIGHT = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1e9], [0, 0, 0, 1]])
_DISTANCE = 1.0  # m, assumed distance of objects, for their speed in the image


class Subject(Protocol):
    """The bodies that images show."""

    changes: int  # changes whenever an image may look different

    def visuals(self) -> list[Visual]:
        """Return all visuals."""

    def visual_poses(self) -> np.ndarray:
        """Return the poses world-from-visual (N, 4, 4), in the order of `visuals`."""

    def visual_velocities(self) -> np.ndarray:
        """Return linear (m/s) and angular (rad/s) velocities in the world, (N, 6)."""

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return RGB (height, width, 3) and depth (height, width), rendered without OpenGL."""


class TurningBlades(Protocol):
    """The blades of a vehicle's propellers, which rotate only in images."""

    turned: bool  # whether a script has rotated them since the last `show`

    def show(self) -> None:
        """Update the rotation of their visuals."""


class Vision:
    """Renders images of a subject with OpenGL or, without EGL, with the subject's `tiny_picture`."""

    def __init__(self, samples: int = 0):
        """Create it; call `look_at` next. The renderer is created for the first image, since not every run needs it.

        `samples`: per pixel, for smooth edges; TinyRenderer ignores them.
        """
        self._samples = samples
        self._renderer: Renderer | None = None
        self._fallback = False
        self.pictures, self.seconds = 0, 0.0  # number of images so far, and their total rendering time (wall clock)

    def look_at(
        self, subject: Subject, blades: Collection[TurningBlades], identify: Callable[[], list[ObjectLabel]] = list
    ) -> None:
        """Set the subject. Its blades are rotated only when an image is rendered.

        `identify` returns the object of each visual, in the order of the visuals.
        """
        self._subject, self._blades, self._identify = subject, blades, identify
        self._shown = -1  # the subject's `changes` at the last rotation of the blades

    def picture(self, kind: str, intrinsics: Lens, pose: np.ndarray, shown: np.ndarray | None = None) -> np.ndarray:
        """Return the image from `pose` (4, 4), world-from-optical.

        `kind` "color": (height, width, 3) uint8 RGB. "depth": (height, width) float32, metres along the optical z, NaN
        beyond the far plane. `shown` (N,): mask of the visuals to render, None: all. Without OpenGL, raises ValueError
        for an orthographic camera, a distorted lens, or `shown`.
        """
        with self.taking() as renderer:
            if renderer is None:
                if shown is not None:
                    raise ValueError("an image of only some objects needs OpenGL, but EGL is not available")
                return self._tiny_picture(kind, intrinsics, pose)
            render = renderer.render if kind == COLOR else renderer.render_depth
            return render(intrinsics, pose, self._poses(shown))

    def _poses(self, shown: np.ndarray | None) -> np.ndarray:
        poses = self._subject.visual_poses()
        return poses if shown is None else np.where(shown[:, None, None], poses, _OUT_OF_SIGHT)

    def numbers(
        self, intrinsics: Lens, pose: np.ndarray, numbers: np.ndarray, shown: np.ndarray | None = None
    ) -> np.ndarray:
        """Return for each pixel the number of its visual in `numbers`, (height, width) uint16; 0 for no surface.

        `shown` as for `picture`. Raises ValueError without OpenGL.
        """
        renderer = self._prepared()
        if renderer is None:
            raise ValueError("an image of the object of each pixel needs OpenGL, but EGL is not available")
        drawn = renderer.render_outputs(("instance",), intrinsics, pose, self._poses(shown), instances=numbers)
        return drawn["instance"]

    def light(self, lens: Intrinsics, pose: np.ndarray, velocity: np.ndarray, shutter: Shutter) -> np.ndarray:
        """Return the linear light of the image from `pose`, (height, width, 3) float32; white is 1.

        `velocity` is the linear (m/s) and angular (rad/s) velocity of the optical frame in the world, (6,). Camera and
        bodies keep their velocities during the exposure. Without OpenGL the exposure is instantaneous.
        """
        speed = lens.fx * (np.linalg.norm(velocity[3:]) + np.linalg.norm(velocity[:3]) / _DISTANCE)
        with self.taking() as renderer:
            if renderer is None:
                return decoded(self._tiny_picture(COLOR, lens, pose))
            poses, velocities = self._subject.visual_poses(), self._subject.visual_velocities()
            speed += lens.fx * np.linalg.norm(velocities[:, :3], axis=1).max(initial=0.0) / _DISTANCE

            def draw(after: float, first: int, end: int) -> np.ndarray:
                now = moved(pose, velocity, after), moved(poses, velocities, after)
                return renderer.render_rows(lens, *now, (first, end))

            return gathered(shutter.moments(lens.height, speed), (lens.width, lens.height), draw)

    @contextmanager
    def taking(self) -> Iterator[Renderer | None]:
        """Count an image and its rendering time, unless it fails; yield the renderer, None without OpenGL."""
        self._open()
        start = time.perf_counter()
        yield self._prepared()
        self.pictures += 1
        self.seconds += time.perf_counter() - start

    def truth(self, intrinsics: Intrinsics, pose: np.ndarray, before: FrameState | None) -> PictureTruth | None:
        """Return the ground truth of the image from `pose`, with the flow since `before`; None without OpenGL."""
        renderer = self._prepared()
        if renderer is None:
            return None
        visuals, poses = self._subject.visuals(), np.array(self._subject.visual_poses())
        numbered = Numbered.of(self._identify())
        since = before if before is not None and len(before.poses) == len(poses) else FrameState(pose, poses)

        def draw(names: Sequence[str]) -> Mapping[str, np.ndarray]:
            return renderer.render_outputs(names, intrinsics, pose, poses, instances=numbered.instances, before=since)

        def alone() -> np.ndarray:
            return renderer.count_alone(intrinsics, pose, poses, numbered.instances)

        return PictureTruth(draw, alone, intrinsics, FrameState(pose, poses), visuals, numbered)

    def _tiny_picture(self, kind: str, intrinsics: Lens, pose: np.ndarray) -> np.ndarray:
        if isinstance(intrinsics, (Orthographic, Distorted)):
            raise ValueError("an orthographic camera or a distorted lens needs OpenGL, but EGL is not available")
        vertical_fov = 2 * np.arctan(intrinsics.height / 2 / intrinsics.fy)
        color, depth = self._subject.tiny_picture(
            pose, intrinsics.width, intrinsics.height, vertical_fov, intrinsics.near, intrinsics.far
        )
        return color if kind == COLOR else depth

    @property
    def renderer(self) -> str:
        """OpenGL's name of the renderer, "TinyRenderer", or '' before the first image."""
        if self._renderer is not None:
            return self._renderer.description
        return TINY if self._fallback else ""

    def _prepared(self) -> Renderer | None:
        """Return the renderer with the present visuals and rotated blades, None without OpenGL."""
        self._open()
        self._rotate_blades()
        if self._renderer is not None:
            self._renderer.set_visuals(self._subject.visuals())
        return self._renderer

    def _open(self) -> None:
        if self._renderer is not None or self._fallback:
            return
        try:
            self._renderer = Renderer(samples=self._samples)
        except RendererUnavailable as error:
            self._fallback = True
            _LOG.warning("%s; images are rendered by PyBullet's TinyRenderer, at a few frames per second", error)

    @property
    def changes(self) -> int:
        """A number that changes whenever an image may look different."""
        self._rotate_blades()
        return self._subject.changes

    def _rotate_blades(self) -> None:
        """Rotate the blades' visuals, once per change for all cameras."""
        if self._shown != self._subject.changes or any(blades.turned for blades in self._blades):
            for blades in self._blades:
                blades.show()
            self._shown = self._subject.changes

    def close(self) -> None:
        """Free the renderer; may be called twice."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
