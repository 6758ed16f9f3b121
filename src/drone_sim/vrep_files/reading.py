"""A whole file: its objects in a tree, its scripts, its settings."""

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
    VrepFile,
    VrepFileError,
    VrepObject,
    VrepScript,
    VrepSettings,
    within,
)
from drone_sim.vrep_files.object_collections import read_collection
from drone_sim.vrep_files.objects import SCRIPT, is_object, read_object, script_of
from drone_sim.vrep_files.scripts import read_script
from drone_sim.vrep_files.shapes import Pools

_PRESET_STEPS = (0.2, 0.1, 0.05, 0.025, 0.01)  # s, of `Spi` 0 to 4
_PRESETS = 5  # modes of the dynamics below this have a step of their own
_PRESET_DYNAMICS_STEP = 0.005  # s


def with_simulation(settings: VrepSettings, data: bytes) -> VrepSettings:
    """Return the settings with what a `SIM` says. Raises VrepFileError."""
    own = level(data)
    preset = own.integer("Spi", default=-1)
    step = own.numbers("_t3", "St3", 1)
    if step is not None:
        return replace(settings, time_step=step[0])
    if 0 <= preset < len(_PRESET_STEPS):
        return replace(settings, time_step=_PRESET_STEPS[preset])
    micro = own.find("St2")
    if micro is not None:
        return replace(settings, time_step=unpack("<Q", micro, "St2")[0] / 1e6)
    seconds = own.find("Sts")
    if seconds is not None:
        return replace(settings, time_step=finite(singles("<f", seconds, "Sts"), "Sts")[0])
    return settings


def with_dynamics(settings: VrepSettings, data: bytes) -> VrepSettings:
    """Return the settings with what a `DYN` says. Raises VrepFileError."""
    own = level(data)
    width = "d" if own.find("_n3") is not None else "f"
    found = own.find("_n3", "En3", "En2", "Eng")
    if found is None:
        return settings
    engine, x, y, z, mode = unpack(f"<i3{width}i", found, "_n3")
    if own.find("_n3", "En3") is None:
        mode += 1
    gravity = finite((x, y, z) if width == "d" else tuple(float(str(np.float32(one))) for one in (x, y, z)), "_n3")
    step = own.numbers("_tp", "Stp", 1)
    seconds = step[0] if step is not None else _PRESET_DYNAMICS_STEP if mode < _PRESETS else None
    return replace(settings, engine=engine, gravity=(gravity[0], gravity[1], gravity[2]), dynamics_step=seconds)


MAX_OBJECTS = 20_000
_DEEPEST = 200  # objects below each other
_SETTINGS = {"SIM": with_simulation, "DYN": with_dynamics}


def read_file(path: str | Path) -> VrepFile:
    """Return what is in a file. Raises VrepFileError, in one line that names it."""
    with within(str(path)):
        try:
            content = read_bytes(path, MAX_SIZE)
        except OSError as error:
            raise VrepFileError(str(error.strerror or error)) from None
        except ValueError as error:
            raise VrepFileError(str(error)) from None
        return read(content)


def read(content: bytes) -> VrepFile:
    """Return what a file's bytes hold. Raises VrepFileError."""
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
            raise VrepFileError(f"holds more than {MAX_OBJECTS} objects")
    program = f"{container.program // 10000}.{container.program // 100 % 100}.{container.program % 100}"
    return VrepFile(container.version, program, _tree(objects), tuple(scripts), settings, tuple(collections))


def _script_in(tag: str, data: bytes, one: VrepObject) -> list[VrepScript]:
    """Return the script of a script object, which acts on the object's parent."""
    found = script_of(data) if tag == SCRIPT else None
    if found is None:
        return []
    with within(f"object {one.name}"):
        return [replace(read_script(found, owner=one.parent), own_object=one.handle)]


def _tree(objects: list[VrepObject]) -> tuple[VrepObject, ...]:
    """Return the objects, a parent before its children, which it is given. Raises VrepFileError."""
    by_handle = {one.handle: one for one in objects}
    if len(by_handle) != len(objects):
        twice = next(handle for handle, count in Counter(one.handle for one in objects).items() if count > 1)
        raise VrepFileError(f"object {by_handle[twice].name}: another object has the same handle {twice}")
    roots = []
    for one in objects:
        if one.parent == -1:
            roots.append(one)
        elif one.parent in by_handle:
            by_handle[one.parent].children.append(one)
        else:
            raise VrepFileError(f"object {one.name}: its parent {one.parent} is not in the file")
    ordered: list[VrepObject] = []
    for root in roots:
        _add_below(root, ordered, 0)
    if len(ordered) != len(objects):
        there = {one.handle for one in ordered}
        lost = next(one for one in objects if one.handle not in there)
        raise VrepFileError(f"object {lost.name}: is its own ancestor")
    return tuple(ordered)


def _add_below(one: VrepObject, ordered: list[VrepObject], depth: int) -> None:
    if depth > _DEEPEST:
        raise VrepFileError(f"object {one.name}: has more than {_DEEPEST} ancestors")
    ordered.append(one)
    for child in one.children:
        _add_below(child, ordered, depth + 1)
