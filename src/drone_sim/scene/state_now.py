"""Where the objects of a scene are now, in the words of a scene file."""

from __future__ import annotations

import math
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.joint import FORCE, POSITION, SPHERICAL, VELOCITY, Joint
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.scene import Scene


def of_all(scene: Scene) -> list[dict[str, Any]]:
    """Return for each entry the keys that say where it is, what it hangs on, and how a joint stands."""
    objects, bodies = scene.objects_now(), scene.bodies_by_entry()
    found = []
    for index, _ in enumerate(scene.parameters.objects):
        one = objects.get(index)
        found.append(_place(bodies[index].matrix, "") if one is None else _of(one))
    return found


def _of(one: SceneObject) -> dict[str, Any]:
    above = one.parent
    matrix = one.matrix() if above is None else frames.relative(above.below(), one.matrix())
    values = _place(matrix, "" if above is None else above.name)
    return {**values, **_joint(one)} if isinstance(one, Joint) else values


def _place(matrix: Matrix, parent: str) -> dict[str, Any]:
    turn = [angle + 0.0 for angle in frames.to_rpy(matrix)]  # without a -0.0
    return {"position": list(frames.position(matrix)), "rpy": turn, "parent": parent}


def _joint(joint: Joint) -> dict[str, Any]:
    control = joint.control
    values: dict[str, Any] = {"mode": control.mode, "max_force": control.max_force}
    targets = {POSITION: control.position, VELOCITY: control.velocity, FORCE: control.force}
    if control.mode in targets:
        values["target"] = targets[control.mode]
    if joint.limits is not None:
        values["limits"] = list(joint.limits)
    low, high = joint.limits or (-math.inf, math.inf)
    if joint.motion != SPHERICAL:
        values["value"] = min(max(joint.value, low), high)
    return values
