"""Files for the simulator: the scene with the start conditions of a seed, and the timeline of a plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import cache_path
from drone_sim.files.yaml_writing import dump
from drone_sim.grading.plan import Plan
from drone_sim.run.parameters import Parameters


def scene_file(plan: Plan, seed: int) -> str:
    """Return a scene file with the start conditions of a seed; for seed 0 the plan's own. Raises OSError."""
    if not seed:
        return plan.parameters().scene_file
    return _write(f"{plan.name}-{seed}.yaml", _content(plan.parameters(seed)))


def timeline_file(plan: Plan) -> str:
    """Return a file with the timeline of a plan, '' if it has none. Raises OSError."""
    return _write(f"{plan.name}-timeline.yaml", plan.timeline) if plan.timeline else ""


def _write(name: str, content: Any) -> str:
    folder = cache_path() / "grading" / "seeds"
    folder.mkdir(parents=True, exist_ok=True)
    path = Path(folder, name)  # is not removed, because the simulator may be restarted with it
    writing.write(path, dump(content))
    return str(path)


def _content(parameters: Parameters) -> dict[str, Any]:
    values = parameters.model_dump(
        mode="json", include={"scene", "weather", "physics", "time_step", "sub_step", "gravity"}
    )
    own = parameters.in_scene_file.get("vehicles") or {}  # a vehicle with a script of its own keeps it
    vehicles = {
        vehicle.name: {
            **vehicle.model_dump(mode="json", exclude={"name", "script"}),
            **{key: value for key, value in own.get(vehicle.name, {}).items() if key == "script"},
        }
        for vehicle in parameters.fleet
    }
    return {**values.pop("scene"), **values, "vehicles": vehicles}
