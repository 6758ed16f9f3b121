"""What a seed changes, as a scene file: places, wind, moved objects, and the seeds of noise, gusts and faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import cache_path
from drone_sim.files.yaml_writing import dump
from drone_sim.grading.plan import Plan
from drone_sim.run.parameters import Parameters


def scene_file(plan: Plan, seed: int) -> str:
    """Return a scene file in which a flight of a seed begins; of seed 0 the plan's own. Raises OSError."""
    if not seed:
        return plan.parameters().scene_file
    return _written(f"{plan.name}-{seed}.yaml", _content(plan.parameters(seed)))


def timeline_file(plan: Plan) -> str:
    """Return a file with the timeline of a plan, '' for none. Raises OSError."""
    return _written(f"{plan.name}-timeline.yaml", plan.timeline) if plan.timeline else ""


def _written(name: str, content: Any) -> str:
    folder = cache_path() / "grading" / "seeds"
    folder.mkdir(parents=True, exist_ok=True)
    path = Path(folder, name)  # stays: the simulator may be started with it once more
    writing.write(path, dump(content))
    return str(path)


def _content(flown: Parameters) -> dict[str, Any]:
    given = flown.model_dump(mode="json", include={"scene", "weather", "physics", "time_step", "sub_step", "gravity"})
    own = flown.in_scene_file.get("vehicles") or {}  # who has a script of its own; the others fly the simulator's
    vehicles = {
        one.name: {
            **one.model_dump(mode="json", exclude={"name", "script"}),
            **{key: value for key, value in own.get(one.name, {}).items() if key == "script"},
        }
        for one in flown.fleet
    }
    return {**given.pop("scene"), **given, "vehicles": vehicles}
