"""The tree of objects as rows, and which of them differ from those that were told last."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drone_sim.config.types import Checked
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.editing.vehicle_edits import FLOOR
from drone_sim.editing.vehicle_parts import Part, part_named
from drone_sim.mechanics import frames
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.run.scene_settings import PLACE, vehicles_in
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.entry import EntryParameters, place_of
from drone_sim.vehicles.vehicle import Vehicle

Row = dict[str, Any]
_ASIDE = ("name", "alias", "model", "parent", "position", "rpy", "shape", "kind")  # which stand in the row itself


class SceneRows:
    """One row for each object, made anew where anything of it is otherwise."""

    def __init__(self, scene: SceneAccess):
        """Take the scene; no row is made yet."""
        self._scene = scene
        self._known: dict[int, tuple[Any, ...]] = {}  # what each row was made of
        self.rows: dict[int, Row] = {}

    def follow(self) -> tuple[list[Row], list[int]]:
        """Return the rows that differ from what they were at the last call, and the handles that are gone."""
        scene, changed = self._scene, []
        tree = scene.tree
        entries = {one.name: (index, one) for index, one in scene.simulation.scene.entries.items()}
        whose = {handle: one for one in scene.simulation.vehicles.values() for handle in one.handles}
        said = vehicles_in(scene.settings, scene.simulation.parameters) if whose else {}
        said = {name: {key: value for key, value in one.items() if key not in PLACE} for name, one in said.items()}
        scripts = scene.simulation.scene.scripts
        handles = {id(tree[handle]): handle for handle in tree}
        for handle in tree:
            one = tree[handle]
            index, entry = entries.get(one.name, (-1, None))
            vehicle = whose.get(handle)
            parent = -1 if one.parent is None else handles[id(one.parent)]
            script = scripts.get(one.name)
            own = self._beside(one, vehicle, said) if entry is None else entry
            made_of = (
                one.name, one.alias, one.is_model, parent, one.matrix(), own, script,
                vehicle.name if vehicle else "", getattr(one, "value", 0.0),
            )  # fmt: skip
            if self._known.get(handle) != made_of:
                self._known[handle] = made_of
                if entry is not None:
                    own = scene.simulation.scene.entry_now(index)
                self.rows[handle] = row = _row(handle, one, parent, own, script)
                row["vehicle"] = vehicle.name if vehicle else ""
                row["of"] = "vehicle" if vehicle else "scene" if entry is not None else "floor"
                if vehicle is not None and one is vehicle.object:
                    row.update(root=True, type="vehicle", script=vehicle.parameters.script)
                changed.append(row)
        gone = [handle for handle in self._known if tree.get(handle) is None]
        for handle in gone:
            del self._known[handle], self.rows[handle]
        return changed, gone

    def _beside(self, one: SceneObject, vehicle: Vehicle | None, said: Mapping[str, Any]) -> Any:
        """Return the content of an object that is no entry of the scene; `said` has what is said of the vehicles."""
        if vehicle is None:
            return _simple(self._scene.simulation.parameters.scene.floor)
        if one is not vehicle.object:
            return part_named(vehicle.parameters, one.name)
        return {**_simple(vehicle.parameters), **said.get(vehicle.name, {})}


def _row(handle: int, one: SceneObject, parent: int, own: Any, script: AttachedScriptParameters | None) -> Row:
    place = place_of(one)
    values: Mapping[str, Any] = own if isinstance(own, Mapping) else {}
    if isinstance(own, EntryParameters):
        said = own.model_dump(mode="json", exclude_defaults=True)
        values = {key: value for key, value in said.items() if key not in _ASIDE}
        place = {key: list(getattr(own, key)) for key in ("position", "rpy")}
    if isinstance(own, Part):
        values = own.values
    if script is not None and script.parameters:
        values = {**values, "script_parameters": dict(script.parameters)}
    matrix = one.matrix()
    return {
        "handle": handle,
        "name": one.name,
        "alias": one.alias,
        "kind": one.kind,
        "type": _type_of(own) or ("floor" if one.name == FLOOR else one.kind),
        "parent": parent,
        "model": one.is_model,
        "script": script.script if script else "",
        "pose": [round(value, 6) for value in (*frames.position(matrix), *frames.to_quaternion(matrix))],
        "position": place["position"],
        "rpy": place["rpy"],
        "values": values,
    }


def _simple(parameters: Checked) -> dict[str, Any]:
    """Return what is a number, a text or a switch, as somebody would write it."""
    values = {key: getattr(parameters, key) for key in type(parameters).model_fields}
    return {key: getattr(one, "given", one) for key, one in values.items() if isinstance(one, (bool, int, float, str))}


def _type_of(own: Any) -> str:
    return own.word if isinstance(own, Part) else getattr(own, "shape", "") or getattr(own, "kind", "")
