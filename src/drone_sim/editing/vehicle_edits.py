"""Operations on vehicles, their parts and the floor, which change the scene file's settings."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.config.types import ParameterError, merged
from drone_sim.editing import records
from drone_sim.editing.properties import Part, part_named, parts_of, with_part
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_names import first_free, plain
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.run.flight_changes import put
from drone_sim.run.scene_document import Settings, keep_names, say_place, vehicles_in, with_floor, with_vehicles
from drone_sim.run.simulation import Simulation
from drone_sim.scene.entry import pose_keys, rounded
from drone_sim.scripting.load import DEFAULT
from drone_sim.vehicles.quadricopter_objects import REMOVABLE
from drone_sim.vehicles.types import TYPES
from drone_sim.vehicles.vehicle import Vehicle

FLOOR = "Floor"
_Entries = dict[str, dict[str, Any]]  # of the vehicles in a scene file, by name


class VehicleEdits:
    """Operations on vehicles and the floor; each applies new settings to the scene. All raise ValueError."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation

    def _entries(self) -> _Entries:
        return vehicles_in(self._simulation.document.settings, self._simulation.parameters)

    def _settings(self, entries: _Entries) -> Settings:
        return with_vehicles(self._simulation.document.settings, entries, self._simulation.parameters)

    def _apply(self, entries: _Entries) -> None:
        self._simulation.apply_settings(self._settings(entries))

    def _vehicle(self, handle: int) -> Vehicle:
        vehicle = self._simulation.vehicle_of(handle)
        if vehicle is None:
            raise ValueError(f"'{self._simulation.tree[handle].name}' is the floor: only its size can be changed")
        return vehicle

    def _part(self, handle: int) -> Part | None:
        return part_named(self._vehicle(handle).parameters, self._simulation.tree[handle].name)

    def add(self, op: records.AddVehicle) -> list[int]:
        """Add a vehicle under an unused name.

        The scene names the pilot as the script of further vehicles, so that only the first one flies what is run.
        """
        if op.type not in TYPES:
            raise ParameterError(f"type = '{op.type}': must be one of {', '.join(TYPES)}")
        entries = self._entries()
        name = _unused_name(op.name or op.type, entries)
        x, y, z = op.position
        place = {"position": rounded([x, y, z + op.height]), **({"yaw": op.yaw} if op.yaw else {})}
        script = {"script": DEFAULT} if entries else {}
        self._apply({**entries, name: merged({**script, **TYPES[op.type].entry(), **place}, op.values)})
        return [self.root(self._simulation.vehicles[name])]

    def copy(self, handle: int, places: Sequence[Vector]) -> list[int]:
        """Copy a vehicle without its children, once for each of `places`: offsets (m, world) from the original."""
        name, original = self.described(handle)
        entries, names = self._entries(), []
        for place in places:
            new = _unused_name(name, entries)
            position = [value + offset for value, offset in zip(original["position"], place)]
            entries[new] = {**copy.deepcopy(original), "position": rounded(position)}
            names.append(new)
        self._apply(entries)
        return [self.root(self._simulation.vehicles[name]) for name in names]

    def described(self, handle: int) -> tuple[str, dict[str, Any]]:
        """Return the name of a vehicle, and its entry for a copy."""
        vehicle = self._vehicle(handle)
        if not self._simulation.is_vehicle(handle):
            raise ValueError(f"'{self._simulation.tree[handle].name}' is a part of a vehicle: copy the vehicle instead")
        entry = self._entries()[vehicle.name]
        return vehicle.name, {key: value for key, value in entry.items() if key not in ("suffix", "objects")}

    def root(self, vehicle: Vehicle) -> int:
        return self._simulation.tree.handle_of(vehicle.object)

    def remove(self, handle: int) -> None:
        """Remove a vehicle with its descendants if `handle` is its root; else a removable part, such as a camera."""
        simulation = self._simulation
        vehicle = self._vehicle(handle)
        entries = self._entries()
        if simulation.is_vehicle(handle):
            descendants = [key for key in simulation.operations.model(handle) if simulation.vehicle_of(key) is None]
            if descendants:
                simulation.operations.remove(descendants)
            del entries[vehicle.name]
            keep_names(entries, simulation.vehicles)
        else:
            name, part = plain(simulation.tree[handle].name), self._part(handle)
            if part is None and name not in REMOVABLE:
                raise ValueError(f"'{name}' is a part of '{vehicle.name}', which cannot fly without it")
            section, key = ("objects", name) if part is None else (part.among, part.key)
            entry = entries[vehicle.name]
            entry[section] = {**entry.get(section, {}), key: None}
        self._apply(entries)

    def rename(self, handle: int, name: str) -> list[int]:
        """Rename a vehicle, and so its topics, or a part of a vehicle."""
        simulation, entries = self._simulation, self._entries()
        vehicle = self._vehicle(handle)
        part = self._part(handle)
        if part is not None:
            self._set_camera_or_sensor(vehicle, part, {"object": name})
            return [simulation.tree.handle(f"{name}{vehicle.suffix}")]
        if not simulation.is_vehicle(handle):
            self._set_part(handle, name=name, alias=name)
            return [handle]
        if name != vehicle.name and name in entries:
            raise ParameterError(f"a vehicle named '{name}' already exists")
        self._apply({name if old == vehicle.name else old: values for old, values in entries.items()})
        return [self.root(simulation.vehicles[name])]

    def move(self, handle: int, relative_to: int, matrix: Matrix) -> None:
        """Move a vehicle or a part of it; during a run, the settings keep the pose of a part."""
        simulation = self._simulation
        tree, vehicle = simulation.tree, self._vehicle(handle)
        if simulation.is_vehicle(handle):
            if relative_to not in (WORLD, PARENT):
                matrix = frames.multiply(tree[relative_to].below(), matrix)
            entries = self._entries()
            say_place(entries[vehicle.name], matrix)
            self._apply(entries)
            if simulation.running:  # its pose may differ from that in the settings
                put(simulation.vehicles[vehicle.name], matrix)
            return
        before = tree.matrix(handle)
        tree.set_matrix(handle, relative_to, matrix)
        if not simulation.running:
            local = tree.matrix(handle, PARENT)
            tree.set_matrix(handle, WORLD, before)
            self._set_part(handle, **pose_keys(local))

    def reparent(self, handle: int, parent: int, keep: str) -> None:
        """Set the parent of a vehicle's part; `keep`: the pose in the world, or relative to the parent."""
        tree = self._simulation.tree
        if self._simulation.is_vehicle(handle):
            raise ValueError("a vehicle cannot have a parent")
        tree.check_parent(handle, parent)
        above = None if parent == WORLD else tree[parent]
        local = tree.matrix(handle, PARENT)
        if keep == "pose":
            local = tree.matrix(handle) if above is None else frames.relative(above.below(), tree.matrix(handle))
        self._set_part(handle, parent="" if above is None else above.name, **pose_keys(local))

    def _set_part(self, handle: int, **values: Any) -> None:
        vehicle, entries, part = self._vehicle(handle), self._entries(), self._part(handle)
        entry, name = entries[vehicle.name], plain(self._simulation.tree[handle].name)
        if part is not None:
            cure = f"change its pose in the text of the scene, at {part.among}/{part.key}/mount"
            raise ValueError(f"'{name}' is a part of '{vehicle.name}': {cure}")
        entry["objects"] = merged(entry.get("objects") or {}, {name: values})
        self._apply(entries)

    def set(self, handle: int, values: Mapping[str, Any]) -> None:
        """Set keys of the floor, of a vehicle's entry, or of a camera or sensor."""
        simulation = self._simulation
        if simulation.tree[handle].name == FLOOR:
            simulation.apply_settings(with_floor(simulation.document.settings, values))
            return
        vehicle, entries = self._vehicle(handle), self._entries()
        part = self._part(handle)
        if part is not None:
            self._set_camera_or_sensor(vehicle, part, values)
            return
        if not simulation.is_vehicle(handle):
            name = simulation.tree[handle].name
            raise ValueError(f"'{name}' is a part of '{vehicle.name}': set the vehicle's own keys")
        entry = merged(entries[vehicle.name], dict(values))
        entries[vehicle.name] = {key: value for key, value in entry.items() if value is not None or key not in values}
        self._apply(entries)

    def _set_camera_or_sensor(self, vehicle: Vehicle, part: Part, values: Mapping[str, Any]) -> None:
        """Set values of a camera or sensor; those that the vehicle has by default are left out of the entry."""
        entries = self._entries()
        entry = entries[vehicle.name]
        others = {key: values for key, values in (entry.get(part.among) or {}).items() if key != part.key}
        without = {**entries, vehicle.name: {**entry, part.among: others}}
        try:
            fleet = self._simulation.with_settings(self._settings(without)).fleet
            parts = next(parts_of(item).values() for item in fleet if item.name == vehicle.name)
            default = next((item for item in parts if item[:2] == part[:2]), None)
        except ParameterError:  # another part needs this one
            default = None
        self._apply({**entries, vehicle.name: with_part(entry, part, default, values)})


def _unused_name(wanted: str, entries: Mapping[str, Any]) -> str:
    """Return an unused vehicle name: drone, drone2, drone3, ..."""
    bare = wanted.rstrip("0123456789") or wanted
    names = itertools.chain([wanted], (f"{bare}{number}" for number in itertools.count(2)))
    return first_free(names, entries)
