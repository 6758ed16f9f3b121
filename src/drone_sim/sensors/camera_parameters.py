"""What a vision sensor may be."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Literal

from pydantic import Field, model_validator

from drone_sim.config.types import TOPIC, Checked, Finite, Name, ParameterError, Switch, Unit, Within
from drone_sim.render.distortion import WIDEST as WIDEST_FISHEYE
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.sensors.imperfections import Imperfections
from drone_sim.sensors.sensor import MountParameters

MAX_CAMERAS = 16
MAX_PIXELS = 4096 * 4096  # of all cameras together


TRUTH = (
    *("labels", "instances", "categories", "depth", "normals", "points", "flow", "flow_known", "boxes", "box_markers"),
    "overlay",
    *("detections", "detections_3d"),  # where vision_msgs is installed
)
_lens = lru_cache(maxsize=MAX_CAMERAS)(Distorted)  # whose rays are found once
WIDEST = 3.1  # rad, without an equidistant lens


class LensParameters(Checked):
    """A lens that is no pinhole, as sensor_msgs/CameraInfo has it: docs/sensors.md says what the coefficients are."""

    model: Literal["plumb_bob", "rational_polynomial", "equidistant"]
    coefficients: Annotated[tuple[Finite, ...], Field(max_length=8)] = ()


class CameraParameters(Imperfections):
    """A vision sensor: where it sits, what it sees, and how well."""

    object: Name
    topic: Annotated[str, Field(pattern=TOPIC, max_length=128)]
    kind: Literal["color", "depth"]
    frame: Name
    mount: MountParameters | None = None
    every: Annotated[int, Within(1, 1_000_000), Unit("steps")]
    width: Annotated[int, Within(1, 4096), Unit("px")]
    height: Annotated[int, Within(1, 4096), Unit("px")]
    horizontal_fov: Annotated[Finite, Within(0.01, WIDEST_FISHEYE), Unit("rad")]
    lens: LensParameters | None = None
    near: Annotated[Finite, Within(1e-4, 1e4), Unit("m")]
    far: Annotated[Finite, Within(1e-3, 1e5), Unit("m")]
    baseline: Annotated[Finite, Within(0, 100), Unit("m")] = 0.0  # of the right camera of a pair, from the left one
    truth: Switch = False  # whether it publishes what is behind its pictures, too

    @model_validator(mode="after")
    def _can_be(self) -> CameraParameters:
        if self.horizontal_fov > WIDEST and not (self.lens and self.lens.model == "equidistant"):
            raise ValueError(f"horizontal_fov: must be from 0.01 to {WIDEST}, without an equidistant lens")
        if self.lens is not None:
            self.intrinsics()
        if self.kind == "depth":
            self._refuse_imperfections()
        return self

    def _refuse_imperfections(self) -> None:
        for name in Imperfections.model_fields:
            if getattr(self, name).is_on:
                raise ParameterError("only works with cameras of kind color", (name,))

    def intrinsics(self) -> Intrinsics:
        """Return how it makes pixels of the world."""
        own = self.width, self.height, self.horizontal_fov, self.near, self.far
        if self.lens is None:
            return Intrinsics(*own, baseline=self.baseline)
        return _lens(*own, self.lens.model, self.lens.coefficients, baseline=self.baseline)

    def topics(self) -> Iterator[tuple[str, str]]:
        """Yield what it publishes, and what each topic is."""
        yield self.topic, "image"
        folder, slash, _ = self.topic.rpartition("/")
        yield f"{folder}{slash}camera_info", "camera_info"
        for transport in ("compressed", "compressed/parameter_descriptions", "compressed/parameter_updates"):
            yield f"{self.topic}/{transport}", transport
        if self.truth:
            yield from ((f"{self.topic}/truth/{name}", name) for name in TRUTH)
