"""Pictures for scripts: a vehicle's cameras, and the vision sensor that a script is on (sysCall_vision)."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from drone_sim.context import SimulationContext
from drone_sim.scripting.api.packing import as_bytes
from drone_sim.scripting.api.service_servers import Unanswered
from drone_sim.scripting.api.vision import Detected, Eye
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import Script
from drone_sim.scripting.phase_names import VISION
from drone_sim.sensors.camera import Camera

_MAX_PACKETS = 100


def eye_of(context: SimulationContext, camera: Camera) -> Callable[..., np.ndarray]:
    """Return a function that renders a camera's picture: of a `kind` ('': the camera's), with `only` some objects."""

    def look(kind: str = "", only: Collection[str] | None = None) -> np.ndarray:
        if only is None or camera.failure == "silent":
            return camera.look(kind)
        pose = np.reshape((*camera.pose(), 0, 0, 0, 1), (4, 4))
        return context.picture(kind or camera.kind, camera.intrinsics, pose, only)

    return look


def filters_pictures(context: SimulationContext, name: str, script: Script) -> bool:
    """Return whether a script is on a vision sensor of the scene, and defines sysCall_vision."""
    if name not in context.objects or not isinstance(_object(context, name), Eye):
        return False
    try:
        script.check(VISION)
    except ScriptError:
        return False
    return True


def filter_picture(context: SimulationContext, name: str, script: Script) -> None:
    """Call the script's sysCall_vision for a new picture, and store the result in the sensor."""
    eye = _object(context, name)
    arguments = {
        "handle": context.objects.handle(name),
        "resolution": [eye.width, eye.height],
        "clippingPlanes": [eye.near, eye.far],
        "viewAngle": eye.angle,
        "orthoSize": eye.orthographic_size or 0.0,
        "perspectiveOperation": eye.orthographic_size is None,
    }
    try:
        result = script.answer(VISION, arguments)
    except Unanswered:  # the script has failed, which is already logged
        return
    result = result if isinstance(result, dict) else {}
    raw = result.get("packedPackets")
    texts = [text for text in raw[:_MAX_PACKETS] if isinstance(text, (str, bytes))] if isinstance(raw, list) else []
    packets = (as_bytes(text) for text in texts)
    eye.detected = Detected(bool(result.get("trigger")), tuple(packet[: len(packet) // 4 * 4] for packet in packets))


def _object(context: SimulationContext, name: str) -> Any:
    return context.objects[context.objects.handle(name)]
