"""Conversion of a V-REP file into a folder: scene file, meshes, URDFs, scripts, and a report of differences."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.files.yaml_writing import dump
from drone_sim.importing.entries import Entries, collection_entries
from drone_sim.importing.folder import LIST, Folder, Report, label, number, pose_keys
from drone_sim.importing.placing import Placed, floor_parts, floor_size, placed
from drone_sim.importing.quadricopters import find, plain_name
from drone_sim.importing.scripts import ScriptFiles, asked_for, bring, values
from drone_sim.importing.shapes import MeshWriter
from drone_sim.importing.vehicles import ImportedVehicle, suffixes, vehicle_names
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY
from drone_sim.mechanics.object_names import shifted, suffixed
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.message_text import MAX_NAME
from drone_sim.scene.scene_parameters import MAX_OBJECTS
from drone_sim.vehicles.quadricopter_objects import QuadricopterObjects
from drone_sim.vrep_files.model import BULLET, Other, VrepCamera, VrepDummy, VrepFile, VrepScript
from drone_sim.vrep_files.reading import read_file

_CAMERAS = ("FrontVision", "DepthVision", "TrackCam", "FloorVision")
_FLOOR = ("Floor", "ResizableFloor_5_25")


def reserved_names(suffixes: Sequence[int]) -> set[str]:
    """Return the names of drone_sim's floor and of the objects and cameras of vehicles (none: one without suffix)."""
    names = set(_FLOOR)
    for suffix in suffixes or (-1,):
        tree = ObjectTree()
        QuadricopterObjects(tree, suffixed("", suffix), []).add(None, {}, [IDENTITY] * 4, {}, {})  # type: ignore[arg-type]
        names |= {*tree.names, *(suffixed(camera, suffix) for camera in _CAMERAS)}
    return names


class UniqueNames:
    """Gives objects unique names."""

    def __init__(self, taken: Iterable[str] = ()):
        """Treat the names `taken` as used."""
        self._taken = set(taken)

    def give(self, objects: Iterable[Placed], report: Report) -> None:
        """Give each object its name in the file, or a similar one if that is taken."""
        for node in objects:
            node.name = self.free(node.wanted_name)
            if node.name != node.wanted_name:
                report.add(node.wanted_name, f"is called {node.name} here")

    def give_in_trees(self, objects: Iterable[Placed], report: Report) -> None:
        """Name each tree's objects as in the file; if one name is taken, give all a copy's suffix."""
        trees: dict[int, list[Placed]] = defaultdict(list)
        for node in objects:
            trees[id(node.top)].append(node)
        for tree in trees.values():
            wanted = [label(node.wanted_name) or "object" for node in tree]
            for node, name in zip(tree, shifted(wanted, self._taken)):
                node.name = self.free(name)
                if node.name != node.wanted_name:
                    report.add(node.wanted_name, f"is called {node.name} here")

    def free(self, wanted: str) -> str:
        """Return an unused name similar to `wanted`, and reserve it."""
        plain = label(wanted) or "object"
        name, number = plain, 2
        while name in self._taken:
            end = f"_{number}"
            name, number = plain[: MAX_NAME - len(end)] + end, number + 1
        self._taken.add(name)
        return name


SCENE = "scene.yaml"
_TIME_STEP, _SUB_STEP, _GRAVITY = 0.05, 0.005, -9.81  # s, s, m/s²: defaults of a scene file
_MAX_COORDINATE = 1e5  # m
_IDLE_KINDS = ("light", "graph")


class Imported(NamedTuple):
    """The result of an import: the scene file, counts, and the report."""

    scene: Path
    objects: int
    vehicles: int
    scripts: int
    report: Report


def import_file(path: Path, out: Path) -> Imported:
    """Import the file at `path` into the folder `out`. Raises VrepFileError and OSError."""
    process = _Import(read_file(path), path.name, Folder(out))
    imported = process.run()
    bring(path.parent, out, process.script_files.lua_names)
    return imported


class _Import:
    def __init__(self, file: VrepFile, name: str, folder: Folder):
        self._file = file
        self._name = name
        self._folder = folder
        self._report = Report()
        folder.keep_free(name for script in file.scripts for names in asked_for(script.text) for name in names)
        self._writer = MeshWriter(folder)
        self.script_files = ScriptFiles(folder)
        self._objects = placed(file)
        self._by_handle = {node.object.handle: node for node in self._objects}
        self._floor = floor_parts(self._objects)
        self._customizations: dict[int, VrepScript] = {}  # by the handle of their object
        self._scripts = self._child_scripts()
        quads = find(self._objects, self._scripts)
        self._vehicles = [ImportedVehicle(*pair) for pair in zip(quads, [self._scripts] * len(quads), suffixes(quads))]
        self._vehicle_names = vehicle_names(quads)
        self._words = set(re.findall(r"\w+", "\n".join(script.text for script in file.scripts)))
        self._of_vehicles = {id(node) for vehicle in self._vehicles for node in vehicle.objects.values()}
        taken: set[str] = set()
        for vehicle in self._vehicles:  # its objects must not get the names of another vehicle's standard objects
            suffixes_of_others = [other.suffix for other in self._vehicles if other is not vehicle]
            taken_by_others = taken | reserved_names(suffixes_of_others) if suffixes_of_others else set()
            UniqueNames(taken_by_others).give(vehicle.objects.values(), self._report)
            taken |= {node.name for node in vehicle.objects.values()}
        taken |= reserved_names([vehicle.suffix for vehicle in self._vehicles])
        excluded = self._of_vehicles | {id(node) for node in self._floor}
        others = [node for node in self._objects if id(node) not in excluded]
        vehicle_roots = {id(vehicle.root.top) for vehicle in self._vehicles}
        names = UniqueNames(taken)
        names.give((node for node in others if id(node.top) in vehicle_roots), self._report)
        names.give_in_trees((node for node in others if id(node.top) not in vehicle_roots), self._report)

    def run(self) -> Imported:
        content: dict[str, Any] = {**self._world()}
        tools = self._folder, self._writer, self.script_files, self._report
        vehicles = {name: vehicle.entry(*tools) for name, vehicle in zip(self._vehicle_names, self._vehicles)}
        content["vehicles"] = vehicles
        if not vehicles:
            self._report.notes.append("The file has no quadricopter: nothing flies unless you add `vehicles`")
        entries = list(self._entries())
        content["objects"] = entries
        scripts = list(self._attached())
        if scripts:
            content["scripts"] = scripts
        imported_ids = self._kept | self._of_vehicles
        names = {node.object.handle: node.name for node in self._objects if id(node) in imported_ids}
        collections = list(collection_entries(self._file.collections, names, self._report))
        if collections:
            content["collections"] = collections
        self._write(content)
        return Imported(self._folder.path / SCENE, len(entries), len(vehicles), len(scripts), self._report)

    # ---- the world

    def _world(self) -> dict[str, Any]:
        settings = self._file.settings
        world: dict[str, Any] = {}
        step = settings.time_step or _TIME_STEP
        step = number(min(max(step, 1e-3), 1.0))
        if step != _TIME_STEP:
            world["time_step"] = step
        file_sub_step = settings.dynamics_step or _SUB_STEP
        sub_step = step / max(1, round(step / min(max(file_sub_step, 1e-4), step)))
        if abs(sub_step - _SUB_STEP) > 1e-9:
            world["sub_step"] = number(sub_step, 12)
        if settings.engine != BULLET:
            world["physics"] = {"gyroscopic": True}  # of all V-REP's engines, only Bullet omits this term
        if settings.gravity is not None and abs(settings.gravity[2] - _GRAVITY) > 1e-6:
            world["gravity"] = number(settings.gravity[2])
        if settings.gravity is not None and any(settings.gravity[:2]):
            self._report.add("", "gravity is not vertical in the file: only its vertical part is imported")
        if self._floor:
            world["floor"] = {"size": max(number(floor_size(self._floor), 3), 0.01)}
        elif settings.time_step is not None:
            self._report.add("", "the file has no floor at z = 0: drone_sim's floor is added")
        return world

    # ---- scripts

    def _child_scripts(self) -> Mapping[int, list[VrepScript]]:
        """Return the enabled child scripts, by the handle of their object; collect the customization scripts."""
        by_object: dict[int, list[VrepScript]] = defaultdict(list)
        for script in self._file.scripts:
            owner = self._by_handle.get(script.object)
            if owner in self._floor:
                continue
            name = owner.object.name if owner is not None else ""
            if script.kind == "main":
                if not script.is_stock_main:
                    self._report.add(
                        "",
                        "its own main script is not imported: the phases run in V-REP's default order",
                    )
            elif script.kind not in ("child", "customization") or owner is None:
                self._report.add(name, f"its {script.kind} script is not imported")
            elif not script.is_enabled or not owner.runs_scripts:
                self._report.add(name, f"its {script.kind} script is disabled in the file, and is not imported")
            elif script.kind == "customization":
                self._customizations.setdefault(script.object, script)
            else:
                by_object[script.object].append(script)
        return by_object

    def _attached(self) -> Iterator[dict[str, Any]]:
        """Yield the entries of `scripts:`, without those of vehicles' bodies and of built-in propeller scripts."""
        built_in = {
            id(propeller.body)
            for vehicle in self._vehicles
            for propeller in vehicle.quadricopter.propellers
            if vehicle.law is not None
        }
        roots = {id(vehicle.root) for vehicle in self._vehicles}
        imported_ids = self._kept | self._of_vehicles
        scripted: set[int] = set()
        for node in self._objects:
            customization = self._customizations.get(node.object.handle)
            scripts = [] if id(node) in built_in else self._scripts.get(node.object.handle, [])
            if (scripts or customization) and id(node) not in imported_ids:
                self._report.add(node.name, "its script is not imported, because the object is not")
                continue
            entries: dict[str, dict[str, Any]] = {}  # by object
            for script in scripts:
                candidates = (node, self._by_handle.get(script.own_object))  # the first may have a script already
                target = next((place for place in candidates if place is not None and id(place) not in scripted), None)
                if target is None:
                    self._report.add(node.name, "has a second child script: not imported")
                    continue
                scripted.add(id(target))
                if target is not node or id(node) not in roots:
                    entries[target.name] = self._entry_of(script, target, target is not node or script.is_embedded)
            if customization is not None:
                entry = self._entry_of(customization, node, customization.is_embedded, "customization")
                entries[node.name] = {**entry, **entries.get(node.name, {})}
            yield from entries.values()

    def _entry_of(self, script: VrepScript, target: Placed, embedded: bool, key: str = "script") -> dict[str, Any]:
        entry: dict[str, Any] = {"object": target.name, key: self.script_files.write(target.name, script)}
        if embedded:
            entry["embedded"] = True
        parameters = values(script.parameters or target.object.parameters)
        return {**entry, "parameters": parameters} if parameters else entry

    # ---- objects

    def _entries(self) -> Iterator[dict[str, Any]]:
        entries = Entries(self._writer, self._report)
        by_vehicle = {id(node): vehicle for vehicle in self._vehicles for node in vehicle.quadricopter.inside()}
        self._kept = self._objects_to_import()
        linked: set[int] = set()  # handles of dummies whose link is written
        for node in self._objects:
            if id(node) not in self._kept:
                continue
            parent, pose = self._parent_and_pose(node)
            vehicle = by_vehicle.get(id(node))
            if vehicle is not None and vehicle.carries(node) and node.object.shape is not None:
                yield {**entries.frame(node, parent), "position": [0.0, 0.0, 0.0], **pose_keys(pose)}
            else:
                yield {**entries.make(node, parent, pose), **self._link(node, linked)}

    def _link(self, node: Placed, linked: set[int]) -> dict[str, str]:
        """Return the key of an overlap constraint between two imported dummies, once for the two."""
        content = node.object.of
        if not isinstance(content, VrepDummy) or not content.holds or len(content.path) > 1:
            return {}
        other = self._by_handle.get(content.linked)
        if other is None or id(other) not in self._kept or not isinstance(other.object.of, VrepDummy):
            return {}
        handles = {node.object.handle, other.object.handle}
        if len(other.object.of.path) > 1 or len(handles) == 1 or handles & linked:
            return {}
        linked |= handles
        return {"linked": other.name}

    def _objects_to_import(self) -> set[int]:
        """Return ids of the objects that get an entry: no objects of vehicles or the floor, nor unused idle ones."""
        excluded = {id(node) for node in self._floor} | self._of_vehicles
        excluded |= {id(node) for vehicle in self._vehicles for node in vehicle.cameras}
        drawn = {id(node) for vehicle in self._vehicles for node in (*vehicle.parts, *vehicle.looks)}
        second = {self._by_handle.get(item.own_object) for items in self._scripts.values() for item in items[1:]}
        chosen: set[int] = set()
        for node in reversed(self._objects):  # children first
            if id(node) in excluded:
                continue
            if not all(abs(value) < _MAX_COORDINATE for value in frames.position(node.matrix)):
                self._report.add(node.name, f"is left out: it is more than {_MAX_COORDINATE / 1e3:g} km away")
                continue
            has_chosen_child = any(id(child) in chosen for child in node.children)
            has_script = node.object.handle in self._customizations or bool(self._scripts.get(node.object.handle))
            is_used = self._is_mentioned(node) or has_script or node in second
            if has_chosen_child or is_used or not (id(node) in drawn or self._is_idle(node)):
                chosen.add(id(node))
        return self._limited(chosen)

    def _limited(self, wanted: set[int]) -> set[int]:
        chosen: set[int] = set()
        for node in self._objects:
            if id(node) in wanted and len(chosen) < MAX_OBJECTS:
                chosen.add(id(node))
            elif id(node) in wanted:
                self._report.add(node.name, f"is left out: a scene has {MAX_OBJECTS} objects at most")
        return chosen

    def _is_idle(self, node: Placed) -> bool:
        """Return whether an object without scripts, mentions and children makes no difference to the scene."""
        content = node.object.of
        if isinstance(content, VrepDummy):
            return bool(node.children) and not content.path  # all of its children are left out
        return (isinstance(content, VrepCamera) and content.resolution is None) or (
            isinstance(content, Other) and content.kind in (*_IDLE_KINDS, "force sensor")
        )

    def _is_mentioned(self, node: Placed) -> bool:
        names = (plain_name(node), node.object.alias)
        return any(name in self._words for name in names if name)

    def _parent_and_pose(self, node: Placed) -> tuple[str, frames.Matrix]:
        """Return the nearest imported ancestor's name, '' for the world, and the pose in its frame."""
        parent = node.above
        while parent is not None and id(parent) not in self._kept and id(parent) not in self._of_vehicles:
            parent = parent.above
        if parent is None:
            return "", node.matrix
        if parent is node.above:
            return parent.name, node.local
        return parent.name, frames.relative(parent.below, node.matrix)

    # ---- files

    def _write(self, content: dict[str, Any]) -> None:
        lines = list(self._report.lines())
        origin = f"From {self._name}, {self._file.program} (format {self._file.version})."
        if lines:
            self._folder.write(LIST, "\n".join([origin, "", *lines, ""]))
        header = f"# {origin}{f' Differences from the file: see {LIST}.' if lines else ''}\n"
        header += "".join(f"# {note}.\n" for note in self._report.notes)
        self._folder.write(SCENE, header + dump(content, "compact"))
