"""Vision sensors on a drone, and the renderer that they share."""

from __future__ import annotations

import logging
from typing import Callable, List, Optional, Protocol

import numpy as np

from drone_sim.camera.context import RendererUnavailable
from drone_sim.camera.intrinsics import Intrinsics
from drone_sim.camera.renderer import Renderer
from drone_sim.visual import Visual

_LOG = logging.getLogger(__name__)


class Scene(Protocol):
    """What a picture is taken of."""

    def visuals(self) -> List[Visual]:
        """Return everything that can be drawn."""

    def visual_poses(self) -> np.ndarray:
        """Return the poses world from visual (N, 4, 4), in the same order."""

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> np.ndarray:
        """Return an RGB picture (height, width, 3), drawn without OpenGL."""


class Vision:
    """Takes pictures of a scene: with OpenGL where EGL is to be had, with the scene's own renderer elsewhere."""

    def __init__(self, scene: Scene):
        """Make the renderer when the first picture is asked for: not every run needs one."""
        self._scene = scene
        self._renderer: Optional[Renderer] = None
        self._fallback = False

    def picture(self, intrinsics: Intrinsics, pose: np.ndarray) -> np.ndarray:
        """Return the RGB picture (height, width, 3) from `pose` (4, 4), world from optical frame."""
        if self._renderer is None and not self._fallback:
            self._open()
        if self._renderer is None:
            vertical_fov = 2 * np.arctan(intrinsics.height / 2 / intrinsics.fy)
            return self._scene.tiny_picture(
                pose, intrinsics.width, intrinsics.height, vertical_fov, intrinsics.near, intrinsics.far
            )
        self._renderer.set_visuals(self._scene.visuals())
        return self._renderer.render(intrinsics, pose, self._scene.visual_poses())

    def _open(self) -> None:
        try:
            self._renderer = Renderer()
        except RendererUnavailable as error:
            self._fallback = True
            _LOG.warning("%s; pictures come from PyBullet's TinyRenderer, at a few frames per second", error)

    def close(self) -> None:
        """Free the renderer; may be called twice."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


class Camera:
    """One vision sensor: where it is, what it sees, and who looks."""

    def __init__(self, intrinsics: Intrinsics, pose: Callable[[], np.ndarray], vision: Vision):
        """Take the pinhole model, a function that gives the pose world from optical frame, and the renderer."""
        self.intrinsics = intrinsics
        self.watched: Callable[[], bool] = lambda: False
        self.image: Optional[np.ndarray] = None  # of the last step, if somebody looked
        self._pose = pose
        self._vision = vision

    def take(self) -> np.ndarray:
        """Return a picture of the scene as it stands, (height, width, 3) uint8 RGB."""
        return self._vision.picture(self.intrinsics, self._pose())
