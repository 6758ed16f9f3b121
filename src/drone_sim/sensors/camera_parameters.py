"""Parameters of cameras."""

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
MAX_PIXELS = 4096 * 4096  # of all cameras of a vehicle together


TRUTH = (
    *("labels", "instances", "categories", "depth", "normals", "points", "flow", "flow_known", "boxes", "box_markers"),
    "overlay",
    *("detections", "detections_3d"),  # if vision_msgs is installed
)
_lens = lru_cache(maxsize=MAX_CAMERAS)(Distorted)  # the rays are computed once per lens
WIDEST = 3.1  # rad, for other lenses than equidistant


class LensParameters(Checked):
    """A distorted lens with a model of sensor_msgs/CameraInfo; docs/sensors.md explains the coefficients."""

    model: Literal["plumb_bob", "rational_polynomial", "equidistant"]
    coefficients: Annotated[tuple[Finite, ...], Field(max_length=8)] = ()


class CameraParameters(Imperfections):
    """Mount, optics and imperfections of a camera."""

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
    baseline: Annotated[Finite, Within(0, 100), Unit("m")] = 0.0  # of a stereo pair's right camera, from the left
    truth: Switch = False  # whether it also publishes ground truth

    @model_validator(mode="after")
    def _check_optics(self) -> CameraParameters:
        if self.horizontal_fov > WIDEST and not (self.lens and self.lens.model == "equidistant"):
            raise ValueError(f"horizontal_fov: must be from 0.01 to {WIDEST} unless the lens is equidistant")
        if self.lens is not None:
            self.intrinsics()
        if self.kind == "depth":
            for name in Imperfections.model_fields:
                if getattr(self, name).is_on:
                    raise ParameterError("is allowed only for cameras of kind color", (name,))
        return self

    def intrinsics(self) -> Intrinsics:
        fields = self.width, self.height, self.horizontal_fov, self.near, self.far
        if self.lens is None:
            return Intrinsics(*fields, baseline=self.baseline)
        return _lens(*fields, self.lens.model, self.lens.coefficients, baseline=self.baseline)

    def topics(self) -> Iterator[tuple[str, str]]:
        """Yield each topic, and a word for its content."""
        yield self.topic, "image"
        folder, slash, _ = self.topic.rpartition("/")
        yield f"{folder}{slash}camera_info", "camera_info"
        for transport in ("compressed", "compressed/parameter_descriptions", "compressed/parameter_updates"):
            yield f"{self.topic}/{transport}", transport
        if self.truth:
            yield from ((f"{self.topic}/truth/{name}", name) for name in TRUTH)
