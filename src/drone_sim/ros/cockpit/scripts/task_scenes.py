"""What a task's plan says of the flight, as a scene file, which is all that a running simulation can be given."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from drone_sim.config.types import merged, named_in, read_yaml
from drone_sim.files import writing
from drone_sim.files.resources import resolve
from drone_sim.grading.plan import Plan
from drone_sim.scene import scene_parameters
from drone_sim.scene.scene_parameters import BESIDE
from drone_sim.vehicles.parameters import EquipmentParameters

_FOLDER = Path("~/.ros/drone_sim/tasks")
_DRONE = "drone"
_KNOWN = ("scene", *BESIDE, *EquipmentParameters.model_fields)  # what a scene file can hold


def scene_of(plan: Plan, folder: Path | None = None) -> str:
    """Return the scene file of a plan: its own where that says everything, or one that is written to `folder`.

    Raises ParameterError and OSError, in one line.
    """
    config = _config(plan)
    scene = str(named_in(plan.folder, plan.scene)) if plan.scene else ""
    if not config and scene:
        return scene
    content = _content(config, scene_parameters.read(scene) if scene else {})
    file = (folder or _FOLDER.expanduser()) / f"{plan.name}.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    # Through JSON: what is a special kind of text to us is none to YAML.
    text = yaml.safe_dump(json.loads(json.dumps(content)), sort_keys=False)
    writing.write(file, f"# Made of {plan.path}\n{text}", through_links=False)
    return str(file)


def told(plan: Plan) -> str:
    """Return what the scene of a plan is, in one line. Raises ParameterError and FileNotFoundError."""
    config = _config(plan)
    lacks = [key for key in config if key not in _KNOWN]
    said = [f"in the scene of the task {plan.name}", *_flat({key: config[key] for key in config if key in _KNOWN})]
    said += [f"but without {', '.join(lacks)}, which only a launch can set"] if lacks else []
    said += ["and sends what its plan says happens"] if plan.timeline else []
    return ", ".join(said)


def _config(plan: Plan) -> dict[str, Any]:
    if isinstance(plan.config, str):
        path = resolve(named_in(plan.folder, plan.config))
        values, folder = read_yaml(path), path.parent
    else:
        values, folder = copy.deepcopy(dict(plan.config)), plan.folder
    scene_parameters.find_files_beside(folder, values)
    return values


def _content(config: Mapping[str, Any], scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a scene file can say of both.

    What vehicles carry stands among the vehicles; a vehicle with the drone's name alone is the drone.
    """
    whole = merged({key: value for key, value in config.items() if key in ("scene", *BESIDE)}, dict(scene))
    carried = {key: value for key, value in config.items() if key in EquipmentParameters.model_fields}
    vehicles = whole.get("vehicles") or {}
    if carried and isinstance(vehicles, Mapping):
        drone = whole.get("drone")
        alone = str(drone.get("name", _DRONE)) if isinstance(drone, Mapping) else _DRONE
        entries = vehicles or {alone: {}}
        whole = {**whole, "vehicles": {name: merged(carried, entry) for name, entry in entries.items()}}
    inside = whole.pop("scene", {})
    return {**inside, **whole}


def _flat(values: Any, above: str = "") -> list[str]:
    """Return values by name, such as `weather/wind = [2, 0, 0]`."""
    if isinstance(values, Mapping):
        return [one for key, value in values.items() for one in _flat(value, f"{above}{key}/")]
    return [f"{above.rstrip('/')} = {json.dumps(values, default=str)}"]
