"""A file of V-REP's as a folder of ours: the scene file, its meshes, URDFs and scripts, and what stayed behind."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.files import yaml_files
from drone_sim.importing import object_collections
from drone_sim.importing.entries import Entries
from drone_sim.importing.folder import LIST, Folder, Report, label, number, pose_keys
from drone_sim.importing.placing import Placed, floor_parts, floor_size, placed
from drone_sim.importing.quadricopters import find, plain_name
from drone_sim.importing.scripts import ScriptFiles, asked_for, bring, values, without_comments
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
    """Return the names of our floor, and of the objects and cameras of vehicles with these suffixes (none: our own)."""
    names = set(_FLOOR)
    for suffix in suffixes or (-1,):
        tree = ObjectTree()
        QuadricopterObjects(tree, suffixed("", suffix), []).add(None, {}, [IDENTITY] * 4, {}, {})  # type: ignore[arg-type]
        names |= {*tree.names, *(suffixed(camera, suffix) for camera in _CAMERAS)}
    return names


class UniqueNames:
    """Gives every object a name of its own."""

    def __init__(self, taken: Iterable[str] = ()):
        """Take the names that are not free."""
        self._taken = set(taken)

    def give(self, objects: Iterable[Placed], report: Report) -> None:
        """Name every object as in the file, where that can be."""
        for one in objects:
            one.name = self.free(one.wanted_name)
            if one.name != one.wanted_name:
                report.add(one.wanted_name, f"is called {one.name} here")

    def give_in_trees(self, objects: Iterable[Placed], report: Report) -> None:
        """Name the objects of each tree as in the file, or, where one of these names is taken, all as a copy's."""
        trees: dict[int, list[Placed]] = defaultdict(list)
        for placed_one in objects:
            trees[id(placed_one.top)].append(placed_one)
        for tree in trees.values():
            wanted = [label(one.wanted_name) or "object" for one in tree]
            for one, name in zip(tree, shifted(wanted, self._taken)):
                one.name = self.free(name)
                if one.name != one.wanted_name:
                    report.add(one.wanted_name, f"is called {one.name} here")

    def free(self, wanted: str) -> str:
        """Return a name like the one wanted, and take it."""
        plain = label(wanted) or "object"
        name, number = plain, 2
        while name in self._taken:
            end = f"_{number}"
            name, number = plain[: MAX_NAME - len(end)] + end, number + 1
        self._taken.add(name)
        return name


SCENE = "scene.yaml"
_STEP, _SUB_STEP, _GRAVITY = 0.05, 0.005, -9.81  # which a scene file need not say
_FARTHEST = 1e5  # m
_ONLY_LOOKED_THROUGH = ("light", "graph")


# In a customization script, which also has phases in which no simulation runs.
_ACTS = re.compile(
    r"\bsysCall_(?:actuation|sensing|thread|threadmain)\b|\bcustomizationscriptcall_simulation(?:actuation|sensing)\b"
)
_LINKS = re.compile(r"\bsim(?:\.s|S)etLinkDummy\b")


def _is_on_a_body(dummy: Placed) -> bool:
    return dummy.above is not None and dummy.above.is_dynamic


class Imported(NamedTuple):
    """What an import made."""

    scene: Path
    objects: int
    vehicles: int
    scripts: int
    report: Report


def import_file(path: Path, out: Path) -> Imported:
    """Write what is in a file into the folder `out`. Raises VrepFileError and OSError."""
    work = _Import(read_file(path), path.name, Folder(out))
    imported = work.run()
    bring(path.parent, out, work.script_files.lua_names)
    return imported


class _Import:
    def __init__(self, file: VrepFile, name: str, folder: Folder):
        self._file = file
        self._name = name
        self._folder = folder
        self._report = Report()
        folder.keep_free(one for script in file.scripts for files in asked_for(script.text) for one in files)
        self._writer = MeshWriter(folder)
        self.script_files = ScriptFiles(folder)
        self._objects = placed(file)
        self._by_handle = {one.object.handle: one for one in self._objects}
        self._floor = floor_parts(self._objects)
        self._scripts = self._child_scripts()
        found = find(self._objects, self._scripts)
        self._vehicles = [ImportedVehicle(*pair) for pair in zip(found, [self._scripts] * len(found), suffixes(found))]
        self._vehicle_names = vehicle_names(found)
        self._words = set(re.findall(r"\w+", "\n".join(script.text for script in file.scripts)))
        self._of_vehicles = {id(one) for vehicle in self._vehicles for one in vehicle.objects.values()}
        taken: set[str] = set()
        for vehicle in self._vehicles:  # whose objects have our names, too, which no other vehicle's may have
            suffixes_of_others = [one.suffix for one in self._vehicles if one is not vehicle]
            taken_by_others = taken | reserved_names(suffixes_of_others) if suffixes_of_others else set()
            UniqueNames(taken_by_others).give(vehicle.objects.values(), self._report)
            taken |= {one.name for one in vehicle.objects.values()}
        taken |= reserved_names([vehicle.suffix for vehicle in self._vehicles])
        ours = self._of_vehicles | {id(one) for one in self._floor}
        others = [one for one in self._objects if id(one) not in ours]
        flown = {id(vehicle.root.top) for vehicle in self._vehicles}
        names = UniqueNames(taken)
        names.give((one for one in others if id(one.top) in flown), self._report)
        names.give_in_trees((one for one in others if id(one.top) not in flown), self._report)

    def run(self) -> Imported:
        content: dict[str, Any] = {**self._world()}
        tools = self._folder, self._writer, self.script_files, self._report
        vehicles = {name: one.entry(*tools) for name, one in zip(self._vehicle_names, self._vehicles)}
        content["vehicles"] = vehicles
        self._find_holes()
        if not vehicles:
            self._report.notes.append("The file has no quadricopter: nothing flies unless you add `vehicles`")
        entries = list(self._entries())
        content["objects"] = entries
        scripts = list(self._attached())
        if scripts:
            content["scripts"] = scripts
        there = self._kept | self._of_vehicles
        brought = {one.object.handle: one.name for one in self._objects if id(one) in there}
        collections = list(object_collections.entries(self._file.collections, brought, self._report))
        if collections:
            content["collections"] = collections
        self._write(content)
        return Imported(self._folder.path / SCENE, len(entries), len(vehicles), len(scripts), self._report)

    # ---- the world

    def _world(self) -> dict[str, Any]:
        settings = self._file.settings
        world: dict[str, Any] = {}
        step = settings.time_step or _STEP
        step = number(min(max(step, 1e-3), 1.0))
        if step != _STEP:
            world["time_step"] = step
        wanted = settings.dynamics_step or _SUB_STEP
        sub_step = step / max(1, round(step / min(max(wanted, 1e-4), step)))
        if abs(sub_step - _SUB_STEP) > 1e-9:
            world["sub_step"] = number(sub_step, 12)
        if settings.engine != BULLET:
            world["physics"] = {"gyroscopic": True}  # CoppeliaSim's Bullet alone leaves that term out
        if settings.gravity is not None and abs(settings.gravity[2] - _GRAVITY) > 1e-6:
            world["gravity"] = number(settings.gravity[2])
        if settings.gravity is not None and any(settings.gravity[:2]):
            self._report.add("", "gravity is not vertical in the file: only its vertical part is imported")
        if self._floor:
            world["floor"] = {"size": max(number(floor_size(self._floor), 3), 0.01)}
        elif settings.time_step is not None:
            self._report.add("", "the file has no floor at z = 0: drone_sim's floor is added")
        return world

    # ---- what will not work

    def _find_holes(self) -> None:
        """Report customization scripts that act in a simulation, and links of dummies that would hold bodies."""
        for script in self._file.scripts:
            on = self._by_handle.get(script.object)
            if on is None or not script.is_enabled:
                continue
            code = without_comments(script)
            if script.kind == "customization" and _ACTS.search(code):
                problem = "its customization script acts in flight, and is not imported: what it drives stays still"
                self._report.holes.append(f"{on.name}: {problem}")
            if script.kind in ("child", "customization") and _LINKS.search(code):
                problem = "its script links dummies (setLinkDummy): links hold nothing here, so the bodies stay apart"
                self._report.holes.append(f"{on.name}: {problem}")
        for one in self._objects:
            of = one.object.of
            other = self._by_handle.get(of.linked) if isinstance(of, VrepDummy) and of.holds else None
            is_second = other is not None and other.object.handle < one.object.handle
            if other is not None and not is_second and (_is_on_a_body(one) or _is_on_a_body(other)):
                problem = "this link of dummies holds two bodies together; it is not imported, so they come apart"
                self._report.holes.append(f"{one.name}, {other.name}: {problem}")

    # ---- scripts

    def _child_scripts(self) -> Mapping[int, list[VrepScript]]:
        """Return the child scripts that run, by the handle of their object."""
        found: dict[int, list[VrepScript]] = defaultdict(list)
        for script in self._file.scripts:
            on = self._by_handle.get(script.object)
            if on in self._floor:
                continue
            name = on.object.name if on is not None else ""
            if script.kind == "main":
                if not script.is_stock_main:
                    self._report.add(
                        "",
                        "its own main script is not imported: the phases run in V-REP's default order",
                    )
            elif script.kind != "child" or on is None:
                self._report.add(name, f"its {script.kind} script is not imported")
            elif not script.is_enabled or not on.runs_scripts:
                self._report.add(name, "its child script is disabled in the file, and is not imported")
            else:
                found[script.object].append(script)
        return found

    def _attached(self) -> Iterator[dict[str, Any]]:
        """Yield the entries of `scripts:`: what is on a vehicle's body, or what its built-in law does, aside."""
        built_in = {
            id(propeller.body)
            for vehicle in self._vehicles
            for propeller in vehicle.quadricopter.propellers
            if vehicle.law is not None
        }
        roots = {id(vehicle.root) for vehicle in self._vehicles}
        kept = self._kept | self._of_vehicles
        scripted: set[int] = set()
        for one in self._objects:
            own = self._scripts.get(one.object.handle, [])
            if id(one) in built_in:
                continue
            if own and id(one) not in kept:
                self._report.add(one.name, "its child script is not imported, because the object is not")
                continue
            for script in own:
                places = (one, self._by_handle.get(script.own_object))  # another script may be on the first already
                on = next((place for place in places if place is not None and id(place) not in scripted), None)
                if on is None:
                    self._report.add(one.name, "has a second child script: not imported")
                    continue
                scripted.add(id(on))
                if on is not one or id(one) not in roots:
                    yield self._entry_of(script, on, on is not one or script.is_embedded)

    def _entry_of(self, script: VrepScript, on: Placed, embedded: bool) -> dict[str, Any]:
        entry: dict[str, Any] = {"object": on.name, "script": self.script_files.write(on.name, script)}
        if embedded:
            entry["embedded"] = True
        parameters = values(script.parameters or on.object.parameters)
        return {**entry, "parameters": parameters} if parameters else entry

    # ---- objects

    def _entries(self) -> Iterator[dict[str, Any]]:
        entries = Entries(self._writer, self._report)
        by_vehicle = {id(one): vehicle for vehicle in self._vehicles for one in vehicle.quadricopter.inside()}
        self._kept = self._chosen()
        for one in self._objects:
            if id(one) not in self._kept:
                continue
            parent, local = self._hangs_on(one)
            vehicle = by_vehicle.get(id(one))
            if vehicle is not None and vehicle.carries(one) and one.object.shape is not None:
                yield {**entries.frame(one, parent), "position": [0.0, 0.0, 0.0], **pose_keys(local)}
            else:
                yield entries.make(one, parent, local)

    def _chosen(self) -> set[int]:
        """Return the objects that get an entry: not those of vehicles and the floor, nor idle ones (`_is_idle`)."""
        without = {id(one) for one in self._floor} | self._of_vehicles
        without |= {id(one) for vehicle in self._vehicles for one in vehicle.cameras}
        seen = {id(one) for vehicle in self._vehicles for one in (*vehicle.parts, *vehicle.looks)}
        seconds = {self._by_handle.get(two.own_object) for several in self._scripts.values() for two in several[1:]}
        kept: set[int] = set()
        for one in reversed(self._objects):  # children first
            if id(one) in without:
                continue
            if not all(abs(value) < _FARTHEST for value in frames.position(one.matrix)):
                self._report.add(one.name, f"is left out: it is more than {_FARTHEST / 1e3:g} km away")
                continue
            has_kept = any(id(child) in kept for child in one.children)
            is_asked_for = self._is_mentioned(one) or bool(self._scripts.get(one.object.handle)) or one in seconds
            if has_kept or is_asked_for or not (id(one) in seen or self._is_idle(one)):
                kept.add(id(one))
        return self._as_many_as_may_be(kept)

    def _as_many_as_may_be(self, kept: set[int]) -> set[int]:
        chosen: set[int] = set()
        for one in self._objects:
            if id(one) in kept and len(chosen) < MAX_OBJECTS:
                chosen.add(id(one))
            elif id(one) in kept:
                self._report.add(one.name, f"is left out: a scene has {MAX_OBJECTS} objects at most")
        return chosen

    def _is_idle(self, one: Placed) -> bool:
        """Tell whether a scene is the same without an object that nothing asks for and nothing hangs on."""
        of = one.object.of
        if isinstance(of, VrepDummy):
            return bool(one.children) and not of.path  # it held nothing but what is left out
        return (isinstance(of, VrepCamera) and of.resolution is None) or (
            isinstance(of, Other) and of.kind in (*_ONLY_LOOKED_THROUGH, "force sensor")
        )

    def _is_mentioned(self, one: Placed) -> bool:
        names = (plain_name(one), one.object.alias)
        return any(name in self._words for name in names if name)

    def _hangs_on(self, one: Placed) -> tuple[str, frames.Matrix]:
        """Return the nearest object above that is there, '' for the world, and the pose in its frame."""
        here = one.above
        while here is not None and id(here) not in self._kept and id(here) not in self._of_vehicles:
            here = here.above
        if here is None:
            return "", one.matrix
        if here is one.above:
            return here.name, one.local
        return here.name, frames.relative(here.below, one.matrix)

    # ---- files

    def _write(self, content: dict[str, Any]) -> None:
        lines = list(self._report.lines())
        said = f"From {self._name}, {self._file.program} (format {self._file.version})."
        if lines:
            self._folder.write(LIST, "\n".join([said, "", *lines, ""]))
        head = f"# {said}{f' What is not as it was there: {LIST}.' if lines else ''}\n"
        head += "".join(f"# {note}.\n" for note in self._report.notes)
        text = yaml_files.dump(content, default_flow_style=None, width=120)
        self._folder.write(SCENE, head + text)
