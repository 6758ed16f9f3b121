"""A vision sensor of the scene: a camera that renders when a script requests an image."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Annotated, Any, Literal

import numpy as np

from drone_sim.config.types import Finite, Length, ParameterError, Unit, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.render.intrinsics import Intrinsics, Lens, Orthographic
from drone_sim.scene.entry import KindParameters, Place
from drone_sim.scripting.api.sensors import EVERYTHING
from drone_sim.scripting.api.vision import Detected

MAX_SIDE = 2048  # px
_OPTICAL = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi))  # sensor from optical frame (y down, x right)


class VisionSensorParameters(KindParameters):
    """A camera with image size (px) and field of view of the larger side (rad); V-REP axes: z ahead, y up, x left.

    With a `size` (m, of the larger side) it is orthographic.
    """

    kind: Literal["vision_sensor"]
    width: Annotated[int, Within(1, MAX_SIDE), Unit("px")] = 256
    height: Annotated[int, Within(1, MAX_SIDE), Unit("px")] = 256
    fov: Annotated[Finite, Within(0.01, 3.1), Unit("rad")] = math.pi / 3
    size: Length | None = None
    near: Annotated[Finite, Within(1e-4, 1e4), Unit("m")] = 0.01
    far: Annotated[Finite, Within(1e-3, 1e5), Unit("m")] = 100.0

    def model_post_init(self, context: Any) -> None:
        """Raise ParameterError unless near < far."""
        super().model_post_init(context)
        if not self.near < self.far:
            raise ParameterError(f"must be less than far = {self.far:g}", ("near",), f"{self.near:g}")

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return VisionSensor(place, self, context)


class VisionSensor(SceneObject):
    """Renders images on request."""

    def __init__(self, place: Place, parameters: VisionSensorParameters, context: SimulationContext):
        super().__init__(*place, kind="vision_sensor")
        self.width, self.height = parameters.width, parameters.height
        self.near, self.far = parameters.near, parameters.far
        self.angle = parameters.fov  # rad, of the larger side
        self.orthographic_size = parameters.size  # m, of the larger side; None: perspective
        self.detected = Detected()
        self.entity = EVERYTHING
        self.color_coded = False
        self._context = context

    def save_state(self) -> Restore:
        return in_turn(super().save_state(), saved(self, "detected", "entity", "color_coded"))

    def picture(self, kind: str = "color", only: Collection[str] | None = None) -> np.ndarray:
        """Return an image ("color", "depth" or "handles") of `only` these objects or of all. Raises ValueError."""
        self._context.carried.follow()
        pose = np.reshape((*frames.multiply(self.matrix(), _OPTICAL), 0, 0, 0, 1), (4, 4))
        return self._context.picture(kind, self._lens(), pose, only)

    def _lens(self) -> Lens:
        larger = max(self.width, self.height)
        if self.orthographic_size is not None:
            width = self.orthographic_size * self.width / larger
            return Orthographic(self.width, self.height, width, self.near, self.far)
        angle = self.angle
        if self.height > self.width:
            angle = 2 * math.atan(math.tan(self.angle / 2) * self.width / self.height)
        return Intrinsics(self.width, self.height, angle, self.near, self.far)
