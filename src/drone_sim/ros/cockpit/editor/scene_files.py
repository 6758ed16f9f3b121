"""The scene files that can be flown in: those on offer, a task's plan as one, and the switch from one to another."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_sim.config.types import merged, named_in, read_yaml
from drone_sim.files import writing
from drone_sim.files.resources import package_path, resolve
from drone_sim.files.yaml_writing import dump
from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.grading.plan import Plan
from drone_sim.ros.cockpit.editor.lessons import Lesson
from drone_sim.ros.core.simulator import Simulator, script_failure
from drone_sim.scene import scene_parameters
from drone_sim.scene.scene_parameters import BESIDE
from drone_sim.vehicles.parameters import EquipmentParameters
from drone_sim.vrep_files.model import SUFFIXES

_TASK_SCENES = Path("~/.ros/drone_sim/tasks")
_DRONE = "drone"
_KNOWN = ("scene", *BESIDE, *EquipmentParameters.model_fields)  # what a scene file can hold
_KEY = "scene_file"
_NONE = "none"  # as the launch file says it
_MINE = "mine/"
_SHIPPED = "config/scenes"
_MOST = 200  # of the user's
_KINDS = {".yaml", ".yml", *SUFFIXES}


def scene_of(plan: Plan, folder: Path | None = None) -> str:
    """Return the scene file of a plan: its own where that says everything, or one that is written to `folder`.

    Raises ParameterError and OSError, in one line.
    """
    config = _config(plan)
    scene = str(named_in(plan.folder, plan.scene)) if plan.scene else ""
    if not config and scene:
        return scene
    content = _content(config, scene_parameters.read(scene) if scene else {})
    file = (folder or _TASK_SCENES.expanduser()) / f"{plan.name}.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    text = dump(json.loads(json.dumps(content)))  # JSON turns FoundFile into str, which PyYAML can write
    writing.write(file, f"# Made of {plan.path}\n{text}", through_links=False)
    return str(file)


def describe_scene_of(plan: Plan) -> str:
    """Return what the scene of a plan is, in one line. Raises ParameterError and FileNotFoundError."""
    config = _config(plan)
    lacks = [key for key in config if key not in _KNOWN]
    said = [f"in the scene of the task {plan.name}", *_flat({key: config[key] for key in config if key in _KNOWN})]
    said += [f"but without {', '.join(lacks)}, which can only be set at launch"] if lacks else []
    said += ["with the events of its plan"] if plan.timeline else []
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
    """Return the content of a scene file made from both, as far as a scene file can hold it.

    Equipment goes into the entry of each vehicle; without vehicles, into a single entry with the drone's name, which
    means the drone.
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


class SceneSwitcher:
    """Remembers the scene that the user has chosen, while tasks and stages bring theirs."""

    def __init__(self, simulator: Simulator):
        """Switch the scene of `simulator`."""
        self._simulator = simulator
        self._brought = ""  # the scene that a lesson has brought
        self._before = ""  # the user's, to come back to

    def describe(self, lesson: Lesson) -> str:
        """Return the scene in which a lesson is flown, in one line; '' for no change. Raises ValueError, OSError."""
        if lesson.task:
            return describe_scene_of(plan_of(lesson))
        if lesson.scene:
            return f"in {lesson.scene.rpartition('/')[2]}, as the tutorial's command says"
        return self._back() if self._is_brought(self._now()) else ""

    def fly(self, lesson: Lesson | None) -> tuple[bool, str]:
        """Start the simulation anew where a lesson is flown; return whether that was done, and one line.

        Raises ValueError and OSError, in one line.
        """
        now = self._now()
        is_brought = self._is_brought(now)
        wanted = _scene(lesson)
        if wanted:
            self._before = self._before if is_brought else now
            return self._load(wanted, now, f"started in {_name(lesson, wanted)}")
        if is_brought:
            return self._load(self._before, now, f"started {self._back()}")
        return self._simulator.call("restart")

    def _now(self) -> str:
        return str(self._simulator.parameter(_KEY, ""))

    def _is_brought(self, scene: str) -> bool:
        return bool(self._brought) and scene == self._brought

    def _back(self) -> str:
        return f"back in {'the scene of the launch' if self._before in ('', 'none') else self._before}"

    def _load(self, file: str, now: str, said: str) -> tuple[bool, str]:
        _, cleanup = self._simulator.call("stop")  # an error in the cleanup of what flew must not hinder what comes
        self._simulator.set_parameter(_KEY, file)
        done, answer = self._simulator.call("load_scene")
        if not done and script_failure(answer) is None:  # the scene was not there
            self._simulator.set_parameter(_KEY, now)
            return False, answer
        self._brought = file if file != self._before else ""
        failed = f"; the one before: {cleanup}" if script_failure(cleanup) else ""
        return done, f"{said if done else answer}{failed}"


def plan_of(lesson: Lesson) -> Plan:
    """Return the plan of a task. Raises PlanError."""
    return plans.read(tasks.find(lesson.task))


def _name(lesson: Lesson | None, file: str) -> str:
    return f"the scene of the task {lesson.task}" if lesson and lesson.task else file.rpartition("/")[2]


def _scene(lesson: Lesson | None) -> str:
    if lesson is None:
        return ""
    return scene_of(plan_of(lesson)) if lesson.task else lesson.scene


class SceneList:
    """Names of scenes, and what the parameter `scene_file` is for each."""

    def __init__(self, folder: Path):
        """Offer the scenes in `folder`, the user's, which need not be there, after those of the package."""
        self._folder = folder
        shipped = sorted((package_path() / _SHIPPED).glob("*.yaml"))
        # Named so that a simulation on another machine finds its own.
        self._shipped = {one.stem: f"package://drone_sim/{_SHIPPED}/{one.name}" for one in shipped}

    def offered(self, flown: str) -> tuple[tuple[str, ...], str]:
        """Return the names, and that of the scene that is flown: one of them, or the file where it is another."""
        files = self._files()
        place = _place(flown)
        name = next((name for name, file in files.items() if _place(file) == place), place)
        return tuple(dict.fromkeys((*files, name))), name

    def file(self, name: str) -> str:
        """Return what `scene_file` must be for a name that was offered."""
        return self._files().get(name, name)

    def _files(self) -> dict[str, str]:
        own = (one for one in self._folder.glob("*") if one.suffix.lower() in _KINDS and one.is_file())
        mine = {f"{_MINE}{one.name}": str(one) for one in sorted(own)[:_MOST]}
        return {_NONE: _NONE, **self._shipped, **mine}


def _place(flown: str) -> str:
    """Return a scene's file as its path, however it was named."""
    if flown in ("", _NONE):
        return _NONE
    try:
        return str(resolve(flown))
    except (OSError, ValueError):
        return flown
