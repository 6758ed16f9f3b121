"""The object tree as rows for windows, and the rows that changed since the last call."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypedDict

from drone_sim.config.types import Checked
from drone_sim.editing.properties import Part, part_named
from drone_sim.editing.vehicle_edits import FLOOR
from drone_sim.mechanics import frames
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.run.scene_document import PLACE, vehicles_in
from drone_sim.run.simulation import Simulation
from drone_sim.run.simulation_setup import own_script
from drone_sim.scene.entry import EntryParameters, place_of, rounded
from drone_sim.scene.scene_parameters import AttachedScriptParameters
from drone_sim.vehicles.vehicle import Vehicle

_ROW_KEYS = ("name", "alias", "model", "parent", "position", "rpy", "shape", "kind")  # with own fields in a row
_DECIMALS = 4  # of the poses (m) by which a row has changed: a hovering vehicle moves by less in each step
Of = Literal["scene", "vehicle", "floor"]


class RowContent(TypedDict):
    """An object as windows show it."""

    handle: int
    name: str
    alias: str
    kind: str
    type: str  # the `shape` or `kind` of its entry, floor, vehicle, or the type of a vehicle's camera or sensor
    parent: int  # -1: the world
    model: bool
    script: str  # '' if it has none
    pose: list[float]  # in the world: x, y, z in m, and a quaternion x, y, z, w
    position: list[float]  # as in its entry
    rpy: list[float]  # as in its entry
    values: Mapping[str, Any]  # the other keys of its entry
    vehicle: str  # of which it is a part; '' for none
    of: Of


class Row(RowContent, total=False):
    """A row; only that of a vehicle itself has these keys."""

    root: bool
    own_script: str  # that the scene names for the vehicle; '' if it names none


class SceneRows:
    """One row for each object, rebuilt when its content changes."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._known: dict[int, tuple[Any, ...]] = {}  # content from which each row was made
        self.rows: dict[int, Row] = {}

    def follow(self) -> tuple[list[Row], list[int]]:
        """Return the rows that changed since the last call, and the handles of removed objects."""
        simulation, changed = self._simulation, list[Row]()
        tree = simulation.tree
        records = {record.entry.name: record for record in simulation.scene.records.values()}
        owners = {handle: item for item in simulation.vehicles.values() for handle in item.handles}
        written = vehicles_in(simulation.document.settings, simulation.parameters) if owners else {}
        written = {name: {key: value for key, value in it.items() if key not in PLACE} for name, it in written.items()}
        scripts = simulation.scene.scripts
        handles = {id(tree[handle]): handle for handle in tree}
        for handle in tree:
            item = tree[handle]
            record = records.get(item.name)
            entry = record.entry if record is not None else None
            vehicle = owners.get(handle)
            parent = -1 if item.parent is None else handles[id(item.parent)]
            script = scripts.get(item.name)
            content = self._other_content(item, vehicle, written) if entry is None else entry
            state = (
                item.name, item.alias, item.is_model, parent, rounded(item.matrix(), _DECIMALS), content, script,
                vehicle.name if vehicle else "", getattr(item, "value", 0.0), getattr(item, "is_static", None),
            )  # fmt: skip
            if self._known.get(handle) != state:
                self._known[handle] = state
                if record is not None:
                    content = record.present
                of: Of = "vehicle" if vehicle else "scene" if entry is not None else "floor"
                self.rows[handle] = row = _row(handle, item, parent, content, script, vehicle, of)
                if vehicle is not None and item is vehicle.object:
                    own = own_script(vehicle.parameters, simulation.parameters)
                    row |= {"root": True, "type": "vehicle", "script": vehicle.parameters.script, "own_script": own}
                changed.append(row)
        removed = [handle for handle in self._known if handle not in tree.by_handle]
        for handle in removed:
            del self._known[handle], self.rows[handle]
        return changed, removed

    def _other_content(self, item: SceneObject, vehicle: Vehicle | None, vehicle_entries: Mapping[str, Any]) -> Any:
        """Return the content of the floor, a vehicle or its part; `vehicle_entries` are as in the scene file."""
        if vehicle is None:
            return _simple(self._simulation.parameters.scene.floor)
        if item is not vehicle.object:
            return part_named(vehicle.parameters, item.name)
        return {**_simple(vehicle.parameters), **vehicle_entries.get(vehicle.name, {})}


def _row(
    handle: int,
    item: SceneObject,
    parent: int,
    content: Any,
    script: AttachedScriptParameters | None,
    vehicle: Vehicle | None,
    of: Of,
) -> Row:
    place = place_of(item)
    values: Mapping[str, Any] = content if isinstance(content, Mapping) else {}
    kind = getattr(content, "shape", "") or getattr(content, "kind", "")
    if isinstance(content, EntryParameters):
        keys = content.model_dump(mode="json", exclude_defaults=True)
        values = {key: value for key, value in keys.items() if key not in _ROW_KEYS}
        place = {key: list(getattr(content, key)) for key in ("position", "rpy")}
    if isinstance(content, Part):
        values, kind = content.values, content.word
    if script is not None and script.parameters:
        values = {**values, "script_parameters": dict(script.parameters)}
    matrix = item.matrix()
    return {
        "handle": handle,
        "name": item.name,
        "alias": item.alias,
        "kind": item.kind,
        "type": kind or ("floor" if item.name == FLOOR else item.kind),
        "parent": parent,
        "model": item.is_model,
        "script": script.script if script else "",
        "pose": [round(value, 6) for value in (*frames.position(matrix), *frames.to_quaternion(matrix))],
        "position": place["position"],
        "rpy": place["rpy"],
        "values": values,
        "vehicle": vehicle.name if vehicle else "",
        "of": of,
    }


def _simple(parameters: Checked) -> dict[str, Any]:
    """Return the numbers, texts and switches of some parameters, file names as written by the author."""
    values = {key: getattr(parameters, key) for key in type(parameters).model_fields}
    return {key: getattr(it, "given", it) for key, it in values.items() if isinstance(it, (bool, int, float, str))}
