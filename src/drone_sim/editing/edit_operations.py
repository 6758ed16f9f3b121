"""The operations of an edit, on objects of the scene, vehicles and the floor."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked
from drone_sim.editing import clipboard, records, scripts, signs
from drone_sim.editing.object_edits import ObjectEdits
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.editing.vehicle_edits import FLOOR, VehicleEdits
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Quaternion, Vector
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.mechanics.state import Pose

_SHORTEST = 0.1  # of a quaternion
_ASIDE = 0.5  # m along x and y, from what is pasted to what stands there


class EditOperations:
    """Carries out records, each on what its object is."""

    def __init__(self, scene: SceneAccess):
        """Take the scene."""
        self._scene = scene
        self._objects, self._vehicles = ObjectEdits(scene), VehicleEdits(scene)

    def do(self, operations: Iterable[Any]) -> list[int]:
        """Carry out operations, one after the other; return the handles of what they have made or touched."""
        handles: list[int] = []
        for is_set, several in itertools.groupby(operations, lambda one: isinstance(one, records.Set)):
            group = [*several]
            handles += self._set(group) if is_set else [one for op in group for one in self._do(op)]
        return handles

    def _do(self, op: Any) -> list[int]:
        does: Mapping[type[Checked], Callable[[Any], list[int] | None]] = {
            records.Add: self._objects.add,
            records.AddModel: self._objects.add_model,
            records.AddSign: lambda one: signs.add(self._scene, one),
            records.AddVehicle: self._vehicles.add,
            records.Remove: self._remove,
            records.Move: self._move,
            records.Rename: self._rename,
            records.Reparent: self._reparent,
            records.Scale: lambda one: self._objects.scale(self._handles(one.objects), one.factors),
            records.Copy: self._copy,
            records.Paste: self._paste,
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

    def text_of(self, said: records.TextOf) -> str:
        """Return objects as a text that can be pasted; what hangs on vehicles comes only where it is named."""
        handles = self._handles(said.text_of)
        own = [one for one in handles if self._is_of_scene(one)]
        vehicles = dict(self._vehicles.described(one) for one in handles if one not in own)
        entries, on = self._objects.described(own)
        return clipboard.written(entries, on, vehicles, self._scene.folder)

    def _paste(self, op: records.Paste) -> list[int]:
        said = clipboard.read(op.text, self._scene.folder)
        there = {self._place(one) for one in self._scene.tree if self._is_of_scene(one) or self._scene.is_root(one)}
        made: list[int] = []
        for name, values in said["vehicles"].items():
            place = {key: values[key] for key in ("position", "yaw") if key in values}
            vehicle = {"do": "add_vehicle", "name": name, "position": [0, 0, 0], **place, "values": values}
            made += self._vehicles.add(checked(records.AddVehicle, vehicle))
        if said["objects"]:
            add = {"do": "add", "objects": said["objects"], "scripts": said["scripts"]}
            made += self._objects.add(checked(records.Add, add))
        self._put_aside(self._scene.tops(made), there)
        return made

    def _put_aside(self, handles: list[int], there: Collection[Vector]) -> None:
        """Move what stands just where something stood before."""
        places = [self._place(one) for one in handles]
        steps = (step * _ASIDE for step in itertools.count())
        by = next(by for by in steps if not any((x + by, y + by, z) in there for x, y, z in places))
        for one, (x, y, z) in zip(handles, places) if by else ():
            self._move(records.Move(do="move", object=one, position=(x + by, y + by, z)))

    def _place(self, handle: int) -> Vector:
        x, y, z = (round(one, 6) for one in frames.position(self._scene.tree.matrix(handle)))
        return x, y, z

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

    def _set(self, operations: Sequence[records.Set]) -> list[int]:
        """Carry out several as one."""
        said: dict[int, dict[str, Any]] = {}
        for op in operations:
            said.setdefault(self._scene.handle(op.object), {}).update(op.values)
        self._objects.set({handle: values for handle, values in said.items() if self._is_of_scene(handle)})
        for handle, values in said.items():
            if not self._is_of_scene(handle):
                self._vehicles.set(handle, values)
        return [*said]

    def _attach_script(self, op: records.AttachScript) -> None:
        handle = self._scene.handle(op.object)
        if self._scene.is_root(handle):
            if not op.script:
                raise ValueError("attach_script to a vehicle needs a file, which becomes its key `script`")
            self._vehicles.set(handle, {"script": op.script})
        else:
            scripts.attach(self._scene, handle, op.script, op.language, op.parameters)


def _unit(quaternion: Quaternion) -> Quaternion:
    length = math.hypot(*quaternion)
    if length < _SHORTEST:
        raise ValueError(f"quaternion: its length is {length:g}: must be about 1")
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
