"""Pictures for scripts: of a vehicle's cameras, and of a vision sensor for its own script (sysCall_vision)."""

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

_MOST = 100  # packets


def eye_of(context: SimulationContext, camera: Camera) -> Callable[..., np.ndarray]:
    """Return a function that takes a camera's picture: of a kind or its own kind, of `only` some objects or all."""

    def look(kind: str = "", only: Collection[str] | None = None) -> np.ndarray:
        if only is None or camera.failure == "silent":
            return camera.look(kind)
        pose = np.reshape((*camera.pose(), 0, 0, 0, 1), (4, 4))
        return context.picture(kind or camera.kind, camera.intrinsics, pose, only)

    return look


def filters_pictures(context: SimulationContext, name: str, script: Script) -> bool:
    """Tell whether a script is on a vision sensor of the scene, and has the function for its pictures."""
    if name not in context.objects or not isinstance(_object(context, name), Eye):
        return False
    try:
        script.check(VISION)
    except ScriptError:
        return False
    return True


def filter_picture(context: SimulationContext, name: str, script: Script) -> None:
    """Let a script see a new picture, and keep what it finds."""
    eye = _object(context, name)
    told = {
        "handle": context.objects.handle(name),
        "resolution": [eye.width, eye.height],
        "clippingPlanes": [eye.near, eye.far],
        "viewAngle": eye.angle,
        "orthoSize": eye.orthographic_size or 0.0,
        "perspectiveOperation": eye.orthographic_size is None,
    }
    try:
        found = script.answer(VISION, told)
    except Unanswered:  # it has failed, which has been told
        return
    found = found if isinstance(found, dict) else {}
    given = found.get("packedPackets")
    texts = [one for one in given[:_MOST] if isinstance(one, (str, bytes))] if isinstance(given, list) else []
    packets = (as_bytes(one) for one in texts)
    eye.detected = Detected(bool(found.get("trigger")), tuple(one[: len(one) // 4 * 4] for one in packets))


def _object(context: SimulationContext, name: str) -> Any:
    return context.objects[context.objects.handle(name)]
