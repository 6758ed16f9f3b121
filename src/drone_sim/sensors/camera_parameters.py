"""What a vision sensor may be."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from drone_sim.config.types import TOPIC, Checked, Finite, Name, Within
from drone_sim.sensors.sensor import MountParameters

MAX_CAMERAS = 16
MAX_PIXELS = 4096 * 4096  # of all cameras together


class CameraParameters(Checked):
    """A vision sensor: where it sits, what it sees."""

    object: Name
    topic: Annotated[str, Field(pattern=TOPIC, max_length=128)]
    kind: Literal["color", "depth"]
    frame: Name
    mount: MountParameters | None = None
    every: Annotated[int, Within(1, 1_000_000)]
    width: Annotated[int, Within(1, 4096)]
    height: Annotated[int, Within(1, 4096)]
    horizontal_fov: Annotated[Finite, Within(0.01, 3.1)]
    near: Annotated[Finite, Within(1e-4, 1e4)]
    far: Annotated[Finite, Within(1e-3, 1e5)]

    def topics(self) -> Iterator[tuple[str, str]]:
        """Yield what it publishes, and what each topic is."""
        yield self.topic, "image"
        folder, slash, _ = self.topic.rpartition("/")
        yield f"{folder}{slash}camera_info", "camera_info"
        for transport in ("compressed", "compressed/parameter_descriptions", "compressed/parameter_updates"):
            yield f"{self.topic}/{transport}", transport
