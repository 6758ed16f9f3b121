"""Reads a whole file: its tree of objects, scripts, collections and settings."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from drone_sim.files.resources import read_bytes
from drone_sim.vrep_files.chunks import finite, level, singles, top, unpack
from drone_sim.vrep_files.container import MAX_SIZE, open_container
from drone_sim.vrep_files.model import (
    VrepCollection,
    VrepCollectionItem,
    VrepFile,
    VrepFileError,
    VrepObject,
    VrepScript,
    VrepSettings,
    within,
)
from drone_sim.vrep_files.objects import SCRIPT, is_object, read_object, read_script, script_of
from drone_sim.vrep_files.shapes import Pools

_PRESET_STEPS = (0.2, 0.1, 0.05, 0.025, 0.01)  # s, of `Spi` 0 to 4
_PRESETS = 5  # dynamics modes below this number are presets with a fixed step
_PRESET_DYNAMICS_STEP = 0.005  # s
_MAX_COLLECTION_ITEMS = 10_000
_COLLECTION_ITEMS = {  # kind of item, and whether the object itself is left out
    0: ("single", False),
    1: ("tree", False),
    2: ("tree", True),
    3: ("chain", False),
    4: ("chain", True),
    5: ("all", False),
}
_ADDS_ITEM = 1


def read_collection(data: bytes) -> VrepCollection:
    """Return a collection. Raises VrepFileError."""
    collection = level(data)
    chunks = [chunk.data for chunk in collection.chunks if chunk.tag == "Asg"]
    if len(chunks) > _MAX_COLLECTION_ITEMS:
        raise VrepFileError(f"Asg: {len(chunks)} items; at most {_MAX_COLLECTION_ITEMS} are allowed")
    items = []
    for chunk in chunks:
        item = level(chunk)
        number = item.bits("Gty")
        if number not in _COLLECTION_ITEMS:
            raise VrepFileError(f"Gty: an item of type {number}; only 0 to {max(_COLLECTION_ITEMS)} are known")
        what, without = _COLLECTION_ITEMS[number]
        removes = not item.bits("Var", default=_ADDS_ITEM) & _ADDS_ITEM
        items.append(VrepCollectionItem(what, item.integer("Obj", default=-1), removes, without))
    return VrepCollection(collection.text("Grn"), tuple(items))


def with_simulation(settings: VrepSettings, data: bytes) -> VrepSettings:
    """Return the settings updated from a `SIM` chunk. Raises VrepFileError."""
    simulation = level(data)
    preset = simulation.integer("Spi", default=-1)
    step = simulation.numbers("_t3", "St3", 1)
    if step is not None:
        return replace(settings, time_step=step[0])
    if 0 <= preset < len(_PRESET_STEPS):
        return replace(settings, time_step=_PRESET_STEPS[preset])
    micro = simulation.find("St2")
    if micro is not None:
        return replace(settings, time_step=unpack("<Q", micro, "St2")[0] / 1e6)
    seconds = simulation.find("Sts")
    if seconds is not None:
        return replace(settings, time_step=finite(singles("<f", seconds, "Sts"), "Sts")[0])
    return settings


def with_dynamics(settings: VrepSettings, data: bytes) -> VrepSettings:
    """Return the settings updated from a `DYN` chunk. Raises VrepFileError."""
    dynamics = level(data)
    width = "d" if dynamics.find("_n3") is not None else "f"
    engine_data = dynamics.find("_n3", "En3", "En2", "Eng")
    if engine_data is None:
        return settings
    engine, x, y, z, mode = unpack(f"<i3{width}i", engine_data, "_n3")
    if dynamics.find("_n3", "En3") is None:
        mode += 1
    gravity = finite((x, y, z) if width == "d" else tuple(float(str(np.float32(value))) for value in (x, y, z)), "_n3")
    step = dynamics.numbers("_tp", "Stp", 1)
    seconds = step[0] if step is not None else _PRESET_DYNAMICS_STEP if mode < _PRESETS else None
    return replace(settings, engine=engine, gravity=(gravity[0], gravity[1], gravity[2]), dynamics_step=seconds)


MAX_OBJECTS = 20_000
_MAX_DEPTH = 200  # of the object tree
_SETTINGS = {"SIM": with_simulation, "DYN": with_dynamics}


def read_file(path: str | Path) -> VrepFile:
    """Read a file. Raises VrepFileError, in one line that names the file."""
    with within(str(path)):
        try:
            content = read_bytes(path, MAX_SIZE)
        except OSError as error:
            raise VrepFileError(str(error.strerror or error)) from None
        except ValueError as error:
            raise VrepFileError(str(error)) from None
        return read(content)


def read(content: bytes) -> VrepFile:
    """Read the bytes of a file. Raises VrepFileError."""
    container = open_container(content)
    pools, settings = Pools(), VrepSettings()
    objects: list[VrepObject] = []
    scripts: list[VrepScript] = []
    collections: list[VrepCollection] = []
    for tag, data in top(container.payload):
        if is_object(tag):
            objects.append(read_object(tag, data, pools))
            scripts += _script_in(tag, data, objects[-1])
        elif tag in ("VIN", "TEX"):
            with within(tag):
                pools.add(data, tag)
        elif tag == "LST":
            with within(f"script {len(scripts) + 1}"):
                scripts.append(read_script(data))
        elif tag == "GRP":
            with within(f"collection {len(collections) + 1}"):
                collections.append(read_collection(data))
        elif tag in _SETTINGS:
            with within(tag):
                settings = _SETTINGS[tag](settings, data)
        if len(objects) > MAX_OBJECTS:
            raise VrepFileError(f"has more than {MAX_OBJECTS} objects")
    program = f"{container.program // 10000}.{container.program // 100 % 100}.{container.program % 100}"
    return VrepFile(container.version, program, _tree(objects), tuple(scripts), settings, tuple(collections))


def _script_in(tag: str, data: bytes, script_object: VrepObject) -> list[VrepScript]:
    """Return the script of a script object, attached to that object's parent; [] for other objects."""
    script = script_of(data) if tag == SCRIPT else None
    if script is None:
        return []
    with within(f"object {script_object.name}"):
        return [replace(read_script(script, owner=script_object.parent), own_object=script_object.handle)]


def _tree(objects: list[VrepObject]) -> tuple[VrepObject, ...]:
    """Fill `children` and return the objects, each parent before its children. Raises VrepFileError."""
    by_handle = {obj.handle: obj for obj in objects}
    if len(by_handle) != len(objects):
        duplicate = next(handle for handle, count in Counter(obj.handle for obj in objects).items() if count > 1)
        raise VrepFileError(f"object {by_handle[duplicate].name}: another object has the same handle {duplicate}")
    roots = []
    for obj in objects:
        if obj.parent == -1:
            roots.append(obj)
        elif obj.parent in by_handle:
            by_handle[obj.parent].children.append(obj)
        else:
            raise VrepFileError(f"object {obj.name}: its parent {obj.parent} is not in the file")
    ordered: list[VrepObject] = []
    for root in roots:
        _add_below(root, ordered, 0)
    if len(ordered) != len(objects):
        reached = {obj.handle for obj in ordered}
        unreached = next(obj for obj in objects if obj.handle not in reached)
        raise VrepFileError(f"object {unreached.name}: is its own ancestor")
    return tuple(ordered)


def _add_below(obj: VrepObject, ordered: list[VrepObject], depth: int) -> None:
    if depth > _MAX_DEPTH:
        raise VrepFileError(f"object {obj.name}: is deeper than {_MAX_DEPTH} levels in the tree")
    ordered.append(obj)
    for child in obj.children:
        _add_below(child, ordered, depth + 1)
