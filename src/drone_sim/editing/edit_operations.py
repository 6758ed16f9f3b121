"""The operations of an edit, on objects of the scene, vehicles and the floor."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked, ParameterError
from drone_sim.editing import clipboard, records
from drone_sim.editing.object_edits import ObjectEdits
from drone_sim.editing.vehicle_edits import FLOOR, VehicleEdits
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.mechanics.state import Pose
from drone_sim.run.simulation import Simulation

_MIN_LENGTH = 0.1  # of a quaternion
_PASTE_OFFSET = 0.5  # m along x and y, between a pasted object and one at the same position


class EditOperations:
    """Executes operation records on objects of the scene, vehicles or the floor."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._objects, self._vehicles = ObjectEdits(simulation), VehicleEdits(simulation)

    def do(self, operations: Iterable[Any]) -> list[int]:
        """Execute operations in order; return the handles of the objects that they created or changed."""
        handles: list[int] = []
        for is_set, members in itertools.groupby(operations, lambda op: isinstance(op, records.Set)):
            group = [*members]
            handles += self._set(group) if is_set else [handle for op in group for handle in self._do(op)]
        return handles

    def _do(self, op: Any) -> list[int]:
        executors: Mapping[type[Checked], Callable[[Any], list[int] | None]] = {
            records.Add: self._objects.add,
            records.AddModel: self._objects.add_model,
            records.AddSign: self._objects.add_sign,
            records.AddVehicle: self._vehicles.add,
            records.Remove: self._remove,
            records.Move: self._move,
            records.Rename: self._rename,
            records.Reparent: self._reparent,
            records.Scale: lambda op: self._simulation.operations.scale(self._handles(op.objects), op.factors),
            records.Copy: self._copy,
            records.Paste: self._paste,
            records.Group: lambda op: self._objects.group(self._handles(op.objects), op.name, op.as_),
            records.Ungroup: lambda op: self._objects.ungroup(self._simulation.tree.resolve(op.object)),
            records.AttachScript: self._attach_script,
            records.DetachScript: self._objects.detach_script,
        }
        if isinstance(op, (records.Scale, records.Reparent)):
            changed = self._handles(op.objects)
        else:
            changed = [self._simulation.tree.resolve(op.object)] if hasattr(op, "object") else []
        created = executors[type(op)](op)
        return changed if created is None else created

    def _handles(self, objects: list[Any]) -> list[int]:
        return [self._simulation.tree.resolve(item) for item in objects]

    def _is_of_scene(self, handle: int) -> bool:
        return self._simulation.vehicle_of(handle) is None and self._simulation.tree[handle].name != FLOOR

    def _remove(self, op: records.Remove) -> list[int]:
        handles = self._handles(op.objects)
        of_scene = [handle for handle in handles if self._is_of_scene(handle)]
        if of_scene:
            self._objects.remove(of_scene, op.below)
        for handle in handles:
            if handle not in of_scene:
                self._vehicles.remove(handle)
        return []

    def _copy(self, op: records.Copy) -> list[int]:
        handles = self._handles(op.objects)
        cells = [*itertools.product(*map(range, op.counts))][1:] or [(0, 0, 0)]
        (dx, dy, dz) = op.steps
        places = [(x * dx, y * dy, z * dz) for x, y, z in cells]
        of_scene = [handle for handle in handles if self._is_of_scene(handle)]
        created = self._objects.copy(of_scene, places) if of_scene else []
        return created + [new for key in handles if key not in of_scene for new in self._vehicles.copy(key, places)]

    def text_of(self, request: records.TextOf) -> str:
        """Return the text of objects for pasting; children of vehicles are included only if they are listed."""
        handles = self._handles(request.text_of)
        of_scene = [handle for handle in handles if self._is_of_scene(handle)]
        vehicles = dict(self._vehicles.described(handle) for handle in handles if handle not in of_scene)
        entries, scripts_on = self._objects.described(of_scene)
        return clipboard.written(entries, scripts_on, vehicles, self._simulation.document.folder)

    def _paste(self, op: records.Paste) -> list[int]:
        simulation = self._simulation
        content = clipboard.read(op.text, simulation.document.folder)
        occupied = {self._place(it) for it in simulation.tree if self._is_of_scene(it) or simulation.is_vehicle(it)}
        created: list[int] = []
        for name, values in content["vehicles"].items():
            place = {key: values[key] for key in ("position", "yaw") if key in values}
            vehicle = {"do": "add_vehicle", "name": name, "position": [0, 0, 0], **place, "values": values}
            created += self._vehicles.add(checked(records.AddVehicle, vehicle))
        if content["objects"]:
            add = {"do": "add", "objects": content["objects"], "scripts": content["scripts"]}
            created += self._objects.add(checked(records.Add, add))
        # Move the new objects by a common offset so that none is at an occupied position.
        places = {handle: self._place(handle) for handle in simulation.tree.tops(created)}
        steps = (step * _PASTE_OFFSET for step in itertools.count())
        by = next(by for by in steps if not any((x + by, y + by, z) in occupied for x, y, z in places.values()))
        for handle, (x, y, z) in places.items() if by else ():
            self._move(records.Move(do="move", object=handle, position=(x + by, y + by, z)))
        return created

    def _place(self, handle: int) -> Vector:
        x, y, z = (round(value, 6) for value in frames.position(self._simulation.tree.matrix(handle)))
        return x, y, z

    def _move(self, op: records.Move) -> None:
        tree, handle = self._simulation.tree, self._simulation.tree.resolve(op.object)
        fixed_frames: dict[Any, int] = {"world": WORLD, "parent": PARENT}
        frame = fixed_frames[op.relative_to] if op.relative_to in fixed_frames else tree.resolve(op.relative_to)
        matrix = _placed(op, tree.matrix(handle, frame))
        if self._is_of_scene(handle):
            self._objects.put(handle, frame, matrix)
        else:
            self._vehicles.move(handle, frame, matrix)

    def _rename(self, op: records.Rename) -> list[int]:
        tree = self._simulation.tree
        handle = tree.resolve(op.object)
        other = tree.handle(op.name) if op.name in tree else handle
        if other != handle and not self._simulation.is_vehicle(handle):  # a vehicle's name is not that of an object
            vehicle = self._simulation.vehicle_of(other)
            owner = f", a part of the vehicle '{vehicle.name}'" if vehicle else ""
            raise ParameterError(f"an object named '{op.name}' already exists: {tree.path(other)}{owner}")
        edits = self._objects if self._is_of_scene(handle) else self._vehicles
        return edits.rename(handle, op.name)

    def _reparent(self, op: records.Reparent) -> None:
        parent = WORLD if op.parent == WORLD else self._simulation.tree.resolve(op.parent)
        for handle in self._simulation.tree.tops(self._handles(op.objects)):
            edits = self._objects if self._is_of_scene(handle) else self._vehicles
            edits.reparent(handle, parent, op.keep)

    def _set(self, operations: Sequence[records.Set]) -> list[int]:
        values_by_handle: dict[int, dict[str, Any]] = {}
        for op in operations:
            values_by_handle.setdefault(self._simulation.tree.resolve(op.object), {}).update(op.values)
        self._objects.set({handle: values for handle, values in values_by_handle.items() if self._is_of_scene(handle)})
        for handle, values in values_by_handle.items():
            if not self._is_of_scene(handle):
                self._vehicles.set(handle, values)
        return [*values_by_handle]

    def _attach_script(self, op: records.AttachScript) -> None:
        handle = self._simulation.tree.resolve(op.object)
        if self._simulation.is_vehicle(handle):
            if not op.script:
                raise ValueError("attach_script to a vehicle needs a file, which becomes its key `script`")
            self._vehicles.set(handle, {"script": op.script})
        else:
            self._objects.attach_script(op)


def _placed(op: records.Move, present: Matrix) -> Matrix:
    position = frames.position(present) if op.position is None else op.position
    if op.quaternion is not None:
        length = math.hypot(*op.quaternion)
        if length < _MIN_LENGTH:
            raise ValueError(f"quaternion: its length is {length:g}: must be about 1")
        x, y, z, w = (value / length for value in op.quaternion)
        return Pose(position, (x, y, z, w)).matrix
    rpy = frames.to_rpy(present) if op.rpy is None else op.rpy
    matrix = frames.from_rpy(position, rpy)
    if op.rpy is None:  # keep the rotation exactly
        x, y, z = position
        m0, m1, m2, _, m4, m5, m6, _, m8, m9, m10, _ = present
        matrix = (m0, m1, m2, x, m4, m5, m6, y, m8, m9, m10, z)
    return matrix
