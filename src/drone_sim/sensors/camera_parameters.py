"""What a vision sensor may be: one by one, and all of them beside each other and the drone's own topics."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field

from drone_sim.config.types import TOPIC, Angles, Checked, Finite, Label, Name, ParameterError, Point, Within
from drone_sim.mechanics.frames import Matrix, from_rpy, multiply

MAX_CAMERAS = 16
MAX_PIXELS = 4096 * 4096  # of all cameras together
# What the drone publishes and hears in its namespace, beside its cameras.
RESERVED_TOPICS = (
    *("cmd_vel", "set_pose", "initialpose", "push", "target_pose", "odom", "propellers", "joint_states"),
    *("command", "scene", "drawing", "markers/update", "markers/update_full", "markers/feedback"),
    *(f"view/{what}" for what in ("surroundings", "bodies", "path", "height", "command", "state")),
)


class MountParameters(Checked):
    """Where a camera sits that has no link in the URDF: in the frame of an object, looking along its +x."""

    parent: Label
    position: Point
    rpy: Angles

    @property
    def matrix(self) -> Matrix:
        """Parent from optical frame (z forward, x right, y down)."""
        return multiply(from_rpy(self.position, self.rpy), from_rpy((0, 0, 0), (-math.pi / 2, 0, -math.pi / 2)))


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


def check_together(cameras: Mapping[str, CameraParameters]) -> None:
    """Raise ParameterError where cameras stand in each other's way."""
    pixels = sum(camera.width * camera.height for camera in cameras.values())
    if pixels > MAX_PIXELS:
        raise ParameterError(f"parameter cameras: {pixels} pixels in all; at most {MAX_PIXELS} are allowed")
    topics = {topic: "the drone's own" for topic in RESERVED_TOPICS}
    objects: dict[str, str] = {}
    for name, camera in cameras.items():
        here = f"parameter cameras/{name}"
        if camera.near >= camera.far:
            raise ParameterError(
                f"{here}/near = {camera.near}: must be less than far = {camera.far}", ("cameras", name, "near")
            )
        if camera.object in objects:
            raise ParameterError(
                f"{here}/object = '{camera.object}': is that of cameras/{objects[camera.object]} too",
                ("cameras", name, "object"),
            )
        objects[camera.object] = name
        for topic, what in _topics(camera):
            if topic in topics:
                raise ParameterError(
                    f"{here}/topic = '{camera.topic}': its {what} would be {topic}, which is {topics[topic]}; "
                    "a topic such as rear/image has a namespace of its own",
                    ("cameras", name, "topic"),
                )
            topics[topic] = f"the {what} of cameras/{name}"


def _topics(camera: CameraParameters) -> Iterator[tuple[str, str]]:
    """Yield what a camera publishes, and what it is."""
    yield camera.topic, "image"
    folder, slash, _ = camera.topic.rpartition("/")
    yield f"{folder}{slash}camera_info", "camera_info"
    for transport in ("compressed", "compressed/parameter_descriptions", "compressed/parameter_updates"):
        yield f"{camera.topic}/{transport}", transport
