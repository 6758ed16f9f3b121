"""Operations on vehicles, their parts, and the floor: what the scene file says of them."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.config.types import ParameterError, merged
from drone_sim.editing import records
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.editing.vehicle_parts import Part, part_named, parts_of, with_part
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.run.rearrangement import put
from drone_sim.run.scene_settings import keep_names, say_place, vehicles_in, with_floor, with_vehicles
from drone_sim.vehicles.quadricopter_objects import REMOVABLE
from drone_sim.vehicles.vehicle import Vehicle

FLOOR = "Floor"
TYPES: dict[str, dict[str, Any]] = {  # what an entry says of a vehicle that is no quadricopter
    "quadricopter": {},
    "hexacopter": {
        "type": "hexacopter",
        "urdf": "package://drone_sim/urdf/hexacopter.urdf",
        "script": "hexacopter",
        "control": {"thrust_gravity": 4.92},
    },
}


class VehicleEdits:
    """Operations that derive new settings from the present ones. All raise ValueError."""

    def __init__(self, scene: SceneAccess):
        """Take the scene."""
        self._scene = scene

    def _say(self, said: dict[str, dict[str, Any]]) -> None:
        scene = self._scene
        scene.arrange(with_vehicles(scene.settings, said, scene.simulation.parameters))

    def _said(self) -> dict[str, dict[str, Any]]:
        return vehicles_in(self._scene.settings, self._scene.simulation.parameters)

    def add(self, op: records.AddVehicle) -> list[int]:
        """Add a vehicle under a name that none has."""
        if op.type not in TYPES:
            raise ParameterError(f"type = '{op.type}': must be one of {', '.join(TYPES)}")
        said = self._said()
        name = _free(op.name or op.type, said)
        x, y, z = op.position
        place = {"position": _rounded([x, y, z + op.height]), **({"yaw": op.yaw} if op.yaw else {})}
        self._say({**said, name: merged({**TYPES[op.type], **place}, op.values)})
        return [self.root(self._scene.simulation.vehicles[name])]

    def copy(self, handle: int, places: Sequence[Vector]) -> list[int]:
        """Add vehicles like one, each so far (m, world) from it; what hangs on it is not copied."""
        name, like = self.described(handle)
        said, made = self._said(), []
        for place in places:
            new = _free(name, said)
            moved = [one + by for one, by in zip(like["position"], place)]
            said[new] = {**copy.deepcopy(like), "position": _rounded(moved)}
            made.append(new)
        self._say(said)
        return [self.root(self._scene.simulation.vehicles[one]) for one in made]

    def described(self, handle: int) -> tuple[str, dict[str, Any]]:
        """Return the name of a vehicle, and the entry that a copy of it would have."""
        vehicle = self._vehicle(handle)
        if not self._scene.is_root(handle):
            raise ValueError(f"'{self._scene.tree[handle].name}' is a part of a vehicle: copy the vehicle instead")
        own = self._said()[vehicle.name]
        return vehicle.name, {key: value for key, value in own.items() if key not in ("suffix", "objects")}

    def root(self, vehicle: Vehicle) -> int:
        """Return the handle of a vehicle's root."""
        return self._scene.tree.handle_of(vehicle.object)

    def remove(self, handle: int) -> None:
        """Remove a vehicle by its root, with what hangs on it; or a camera of one."""
        scene = self._scene
        vehicle = self._vehicle(handle)
        said = self._said()
        if scene.is_root(handle):
            own = [one for one in scene.operations.model(handle) if scene.vehicle_of(one) is None]
            if own:
                scene.operations.remove(own)
            del said[vehicle.name]
            keep_names(said, scene.simulation.vehicles)
        else:
            self._remove_part(said[vehicle.name], vehicle, plain(scene.tree[handle].name))
        self._say(said)

    def _remove_part(self, said: dict[str, Any], vehicle: Vehicle, name: str) -> None:
        part = part_named(vehicle.parameters, name)
        if part is not None:
            said[part.among] = {**said.get(part.among, {}), part.key: None}
            return
        if name not in REMOVABLE:
            raise ValueError(f"'{name}' is a part of '{vehicle.name}', which cannot fly without it")
        said["objects"] = {**said.get("objects", {}), name: None}

    def rename(self, handle: int, name: str) -> list[int]:
        """Give a vehicle another name, which is that of its topics; or one of its parts."""
        scene, said = self._scene, self._said()
        vehicle = self._vehicle(handle)
        part = self._part(handle)
        if part is not None:
            self._set_camera_or_sensor(vehicle, part, {"object": name})
            return [scene.tree.handle(f"{name}{vehicle.suffix}")]
        if not scene.is_root(handle):
            self._set_part(handle, name=name, alias=name)
            return [handle]
        if name != vehicle.name and name in said:
            raise ParameterError(f"a vehicle named '{name}' already exists")
        self._say({name if one == vehicle.name else one: values for one, values in said.items()})
        return [self.root(scene.simulation.vehicles[name])]

    def move(self, handle: int, relative_to: int, matrix: Matrix) -> None:
        """Put a vehicle somewhere, or a part of it."""
        scene = self._scene
        tree, vehicle = scene.tree, self._vehicle(handle)
        if not scene.is_root(handle):
            self._move_part(handle, relative_to, matrix)
            return
        if relative_to not in (WORLD, PARENT):
            matrix = frames.multiply(tree[relative_to].below(), matrix)
        said = self._said()
        say_place(said[vehicle.name], matrix)
        self._say(said)
        if scene.simulation.running:  # where it may be elsewhere than is said
            put(scene.simulation.vehicles[vehicle.name], matrix)

    def _move_part(self, handle: int, relative_to: int, matrix: Matrix) -> None:
        tree = self._scene.tree
        before = tree.matrix(handle)
        tree.set_matrix(handle, relative_to, matrix)
        if self._scene.simulation.running:
            return
        local = tree.matrix(handle, PARENT)
        tree.set_matrix(handle, WORLD, before)
        self._set_part(handle, position=_rounded(frames.position(local)), rpy=_rounded(frames.to_rpy(local)))

    def reparent(self, handle: int, parent: int, keep: str) -> None:
        """Hang a part of a vehicle on another object."""
        tree = self._scene.tree
        if self._scene.is_root(handle):
            raise ValueError("a vehicle cannot have a parent")
        tree.check_parent(handle, parent)
        above = None if parent == WORLD else tree[parent]
        local = tree.matrix(handle, PARENT)
        if keep == "pose":
            local = tree.matrix(handle) if above is None else frames.relative(above.below(), tree.matrix(handle))
        self._set_part(
            handle,
            parent="" if above is None else above.name,
            position=_rounded(frames.position(local)),
            rpy=_rounded(frames.to_rpy(local)),
        )

    def _set_part(self, handle: int, **values: Any) -> None:
        vehicle, said = self._vehicle(handle), self._said()
        own, name = said[vehicle.name], plain(self._scene.tree[handle].name)
        part = self._part(handle)
        if part is not None:
            where = f"{part.among}/{part.key}/mount"
            raise ValueError(
                f"'{name}' is a part of '{vehicle.name}': change its pose in the text of the scene, at {where}"
            )
        own["objects"] = merged(own.get("objects") or {}, {name: values})
        self._say(said)

    def set(self, handle: int, values: Mapping[str, Any]) -> None:
        """Let the floor, or the entry of a vehicle, say something else."""
        scene = self._scene
        if scene.tree[handle].name == FLOOR:
            scene.arrange(with_floor(scene.settings, values))
            return
        vehicle, said = self._vehicle(handle), self._said()
        part = self._part(handle)
        if part is not None:
            self._set_camera_or_sensor(vehicle, part, values)
            return
        if not scene.is_root(handle):
            raise ValueError(f"'{scene.tree[handle].name}' is a part of '{vehicle.name}': set the vehicle's own keys")
        own = merged(said[vehicle.name], dict(values))
        said[vehicle.name] = {key: value for key, value in own.items() if value is not None or key not in values}
        self._say(said)

    def _part(self, handle: int) -> Part | None:
        return part_named(self._vehicle(handle).parameters, self._scene.tree[handle].name)

    def _set_camera_or_sensor(self, vehicle: Vehicle, part: Part, values: Mapping[str, Any]) -> None:
        said = self._said()
        own = said[vehicle.name]
        self._say({**said, vehicle.name: with_part(own, part, self._usual(vehicle, part, said), values)})

    def _usual(self, vehicle: Vehicle, part: Part, said: dict[str, dict[str, Any]]) -> Part | None:
        """Return a part as it is by default, if nothing is said of it; None where there is none by default."""
        own = said[vehicle.name]
        others = {key: one for key, one in (own.get(part.among) or {}).items() if key != part.key}
        without = {**said, vehicle.name: {**own, part.among: others}}
        scene = self._scene
        try:
            fleet = scene.checked(with_vehicles(scene.settings, without, scene.simulation.parameters)).fleet
        except ParameterError:  # something else needs it
            return None
        (usual,) = (one for one in fleet if one.name == vehicle.name)
        return next((one for one in parts_of(usual).values() if one[:2] == part[:2]), None)

    def _vehicle(self, handle: int) -> Vehicle:
        found = self._scene.vehicle_of(handle)
        if found is None:
            raise ValueError(f"'{self._scene.tree[handle].name}' is the floor: only its size can be changed")
        return found


def _free(wanted: str, said: Mapping[str, Any]) -> str:
    """Return a name that no vehicle has: drone, drone2, drone3, ..."""
    bare = wanted.rstrip("0123456789") or wanted
    names = itertools.chain([wanted], (f"{bare}{number}" for number in itertools.count(2)))
    return next(one for one in names if one not in said)


def _rounded(numbers: Sequence[float]) -> list[float]:
    return [round(one, 9) + 0.0 for one in numbers]
