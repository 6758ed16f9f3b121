"""The operations of an edit, on objects of the scene, vehicles and the floor."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any

from drone_sim.config.types import Checked
from drone_sim.editing import records, scripts, signs
from drone_sim.editing.object_edits import ObjectEdits
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.editing.vehicle_edits import FLOOR, VehicleEdits
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Quaternion
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.mechanics.state import Pose

_SHORTEST = 0.1  # of a quaternion


class EditOperations:
    """Carries out records, each on what its object is."""

    def __init__(self, scene: SceneAccess):
        """Take the scene."""
        self._scene = scene
        self._objects, self._vehicles = ObjectEdits(scene), VehicleEdits(scene)

    def do(self, op: Any) -> list[int]:
        """Carry out one operation; return the handles of what it has made or touched."""
        does: Mapping[type[Checked], Callable[[Any], list[int] | None]] = {
            records.Add: self._objects.add,
            records.AddModel: self._objects.add_model,
            records.AddSign: lambda one: signs.add(self._scene, one),
            records.AddVehicle: self._vehicles.add,
            records.Remove: self._remove,
            records.Move: self._move,
            records.Rename: self._rename,
            records.Reparent: self._reparent,
            records.Set: self._set,
            records.Scale: lambda one: self._objects.scale(self._handles(one.objects), one.factors),
            records.Copy: self._copy,
            records.Group: lambda one: self._objects.group(self._handles(one.objects), one.name, one.as_),
            records.Ungroup: lambda one: self._objects.ungroup(self._scene.handle(one.object)),
            records.AttachScript: self._attach_script,
            records.DetachScript: lambda one: scripts.detach(self._scene, self._scene.handle(one.object)),
        }
        touched = [self._scene.handle(op.object)] if hasattr(op, "object") else self._touched(op)
        made = does[type(op)](op)
        return touched if made is None else made

    def _touched(self, op: Any) -> list[int]:
        return self._handles(op.objects) if isinstance(op, (records.Scale, records.Reparent)) else []

    def _handles(self, objects: list[Any]) -> list[int]:
        return [self._scene.handle(one) for one in objects]

    def _is_of_scene(self, handle: int) -> bool:
        return self._scene.vehicle_of(handle) is None and self._scene.tree[handle].name != FLOOR

    def _remove(self, op: records.Remove) -> list[int]:
        handles = self._handles(op.objects)
        own = [one for one in handles if self._is_of_scene(one)]
        if own:
            self._objects.remove(own, op.below)
        for one in handles:
            if one not in own:
                self._vehicles.remove(one)
        return []

    def _copy(self, op: records.Copy) -> list[int]:
        handles = self._handles(op.objects)
        counted = [*itertools.product(*map(range, op.counts))][1:] or [(0, 0, 0)]
        (dx, dy, dz) = op.steps
        places = [(x * dx, y * dy, z * dz) for x, y, z in counted]
        own = [one for one in handles if self._is_of_scene(one)]
        made = self._objects.copy(own, places) if own else []
        return made + [new for one in handles if one not in own for new in self._vehicles.copy(one, places)]

    def _move(self, op: records.Move) -> None:
        tree, handle = self._scene.tree, self._scene.handle(op.object)
        words = {"world": WORLD, "parent": PARENT}
        known = isinstance(op.relative_to, str) and op.relative_to in words
        frame = words[str(op.relative_to)] if known else self._scene.handle(op.relative_to)
        matrix = _placed(op, tree.matrix(handle, frame))
        if self._is_of_scene(handle):
            self._objects.put(handle, frame, matrix)
        else:
            self._vehicles.move(handle, frame, matrix)

    def _rename(self, op: records.Rename) -> list[int]:
        handle = self._scene.handle(op.object)
        of_scene = self._is_of_scene(handle)
        return self._objects.rename(handle, op.name) if of_scene else self._vehicles.rename(handle, op.name)

    def _reparent(self, op: records.Reparent) -> None:
        parent = WORLD if op.parent == WORLD else self._scene.handle(op.parent)
        for one in self._scene.tops(self._handles(op.objects)):
            edits = self._objects if self._is_of_scene(one) else self._vehicles
            edits.reparent(one, parent, op.keep)

    def _set(self, op: records.Set) -> None:
        handle = self._scene.handle(op.object)
        (self._objects if self._is_of_scene(handle) else self._vehicles).set(handle, op.values)

    def _attach_script(self, op: records.AttachScript) -> None:
        handle = self._scene.handle(op.object)
        if self._scene.is_root(handle):
            if not op.script:
                raise ValueError("a vehicle's script is its key `script`: attach_script needs the file")
            self._vehicles.set(handle, {"script": op.script})
        else:
            scripts.attach(self._scene, handle, op.script, op.language, op.parameters)


def _unit(quaternion: Quaternion) -> Quaternion:
    length = math.hypot(*quaternion)
    if length < _SHORTEST:
        raise ValueError(f"quaternion: has the length {length:g}: must be about 1")
    x, y, z, w = (one / length for one in quaternion)
    return x, y, z, w


def _placed(op: records.Move, now: Matrix) -> Matrix:
    position = frames.position(now) if op.position is None else op.position
    if op.quaternion is not None:
        return Pose(position, _unit(op.quaternion)).matrix
    rpy = frames.to_rpy(now) if op.rpy is None else op.rpy
    turned = frames.from_rpy(position, rpy)
    if op.rpy is None:  # as it is, to the last bit
        x, y, z = position
        m0, m1, m2, _, m4, m5, m6, _, m8, m9, m10, _ = now
        turned = (m0, m1, m2, x, m4, m5, m6, y, m8, m9, m10, z)
    return turned
