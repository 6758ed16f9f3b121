"""The scene file of a lesson or task, and switching between it and the user's scene."""

from __future__ import annotations

import contextlib
import copy
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_sim.config.types import merged, named_in, read_yaml
from drone_sim.files import writing
from drone_sim.files.resources import resolve
from drone_sim.files.yaml_writing import dump
from drone_sim.forces.weather import WeatherParameters
from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.grading.plan import Plan
from drone_sim.grading.randomization import Randomization
from drone_sim.ros.cockpit.editor.lessons import Lesson
from drone_sim.ros.cockpit.editor.lists import NO_SCENE, scene_path
from drone_sim.ros.cockpit.editor.scene_backend import SceneBackend
from drone_sim.ros.core.simulator import Simulator, script_failure
from drone_sim.scene import scene_parameters
from drone_sim.scene.scene_parameters import BESIDE
from drone_sim.vehicles.parameters import EquipmentParameters

_TASK_SCENES = Path("~/.ros/drone_sim/tasks")
_DRONE = "drone"
_SCENE_KEYS = ("scene", *BESIDE, *EquipmentParameters.model_fields)  # of a config, that a scene file can hold
_KEY = "scene_file"


def scene_of(plan: Plan, folder: Path | None = None) -> str:
    """Return the scene file of a plan: its own if it has no config, otherwise one that is written to `folder`.

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
    """Return where a task is flown and what the wind does, in plain words. Raises ParameterError, FileNotFoundError."""
    missing = [key for key in _config(plan) if key not in _SCENE_KEYS]
    without = f", but without {', '.join(missing)}, which can only be set at launch" if missing else ""
    sentences = [f"in the scene of the task {plan.name}{without}", _describe_wind(plan.parameters().weather)]
    if plan.spread != Randomization():
        varied = "start and wind are" if plan.spread.wind and any(plan.spread.wind) else "the start is"
        sentences.append(f"In a grade, {varied} different with every seed but 0")
    return ". ".join(filter(None, sentences))


def _describe_wind(weather: WeatherParameters) -> str:
    """Return what the wind of a scene does, '' without wind."""
    speed, gusts = math.hypot(*weather.wind), max(weather.gusts.deviation)
    if not speed:
        return f"There are gusts of about {gusts:.2g} m/s from all sides" if gusts else ""
    axis = max(range(3), key=lambda axis: abs(weather.wind[axis]))
    way = f"mostly {'along' if weather.wind[axis] > 0 else 'against'} the world's {'xyz'[axis]} axis"
    changed = f", and gusts change it by about {gusts:.2g} m/s" if gusts else ""
    return f"The wind blows with {speed:.2g} m/s, {way}{changed}"


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
    content = merged({key: value for key, value in config.items() if key in ("scene", *BESIDE)}, dict(scene))
    equipment = {key: value for key, value in config.items() if key in EquipmentParameters.model_fields}
    vehicles = content.get("vehicles") or {}
    if equipment and isinstance(vehicles, Mapping):
        drone = content.get("drone")
        name_alone = str(drone.get("name", _DRONE)) if isinstance(drone, Mapping) else _DRONE
        entries = vehicles or {name_alone: {}}
        content = {**content, "vehicles": {name: merged(equipment, entry) for name, entry in entries.items()}}
    scene_values = content.pop("scene", {})
    return {**scene_values, **content}


class SceneSwitcher:
    """Switches to the scene of a lesson, and back to the user's scene afterwards."""

    def __init__(self, simulator: Simulator, scene: SceneBackend):
        self._simulator, self._scene = simulator, scene
        self._lesson_scene = ""  # the scene file that the last lesson loaded
        self._user_scene = ""  # the scene file before that
        self._was_modified = self._named_script = False  # the scene before that: not saved; names the vehicle's script

    def describe(self, lesson: Lesson) -> str:
        """Return the scene in which a lesson is flown, in one line; '' for no change. Raises ValueError, OSError."""
        if lesson.task:
            return describe_scene_of(plan_of(lesson))
        if lesson.scene:
            return f"in {lesson.scene.rpartition('/')[2]}, as the tutorial's command says"
        return self._back() if self._is_of_lesson(self._scene_file()) else ""

    def keeps_scene(self, lesson: Lesson | None) -> bool:
        """Return whether a lesson is flown in the present scene."""
        has_scene = lesson is not None and bool(lesson.task or lesson.scene)
        return not has_scene and not self._is_of_lesson(self._scene_file())

    def leaves_own_scene(self, lesson: Lesson | None) -> str:
        """Return the name of the lesson's scene if flying it leaves a scene of the user's, else ''.

        Raises ValueError and OSError, in one line.
        """
        now, wanted = self._scene_file(), _scene(lesson)
        is_left = wanted not in ("", now) and not self._is_of_lesson(now) and self._scene.is_own
        return _scene_name(lesson, wanted) if is_left else ""

    def fly(self, lesson: Lesson | None) -> tuple[bool, str]:
        """Restart the simulation in the lesson's scene; return whether it started, and one line.

        Raises ValueError and OSError, in one line.
        """
        now = self._scene_file()
        wanted = _scene(lesson)
        if wanted:
            if not self._is_of_lesson(now):
                self._user_scene, self._was_modified = now, self._scene.is_modified
                self._named_script = bool(self._scene.own_script)
            return self._load(wanted, now, f"started in {_scene_name(lesson, wanted)}")
        if self._is_of_lesson(now):
            return self._load(self._user_scene, now, f"started {self._back()}")
        return self._simulator.call("restart")

    def go_back(self, lesson: Lesson | None) -> None:
        """Open the user's scene for a lesson without one, if it was not saved, or names a script; nothing flies then.

        Otherwise, or if that fails, `fly` loads it from its file.
        """
        is_needed = self._was_modified or self._named_script
        if _scene(lesson) or not self._is_of_lesson(self._scene_file()) or not is_needed:
            return
        self._simulator.call("stop")
        with contextlib.suppress(ValueError):  # the draft was opened or dropped, or the file is gone
            self._scene.reopen(scene_path(self._user_scene), self._was_modified)
            self._lesson_scene = ""

    def _scene_file(self) -> str:
        return str(self._simulator.parameter(_KEY, ""))

    def _is_of_lesson(self, scene: str) -> bool:
        return bool(self._lesson_scene) and scene == self._lesson_scene

    def _back(self) -> str:
        file = self._user_scene if self._user_scene != NO_SCENE else ""
        if self._was_modified:
            return f"again in {file or 'your new scene'}, with the changes that are not saved"
        return f"again in {file or 'the scene of the launch'}"

    def _load(self, file: str, now: str, success: str) -> tuple[bool, str]:
        # An error in the cleanup of the old script must not prevent the start.
        _, cleanup = self._simulator.call("stop")
        self._simulator.set_parameter(_KEY, file)
        done, answer = self._simulator.call("load_scene")
        if not done and script_failure(answer) is None:  # the scene could not be loaded
            self._simulator.set_parameter(_KEY, now)
            return False, answer
        self._lesson_scene = file if file != self._user_scene else ""
        failed = f"; the one before: {cleanup}" if script_failure(cleanup) else ""
        return done, f"{success if done else answer}{failed}"


def plan_of(lesson: Lesson) -> Plan:
    """Return the plan of a task. Raises PlanError."""
    return plans.read(tasks.find(lesson.task))


def _scene(lesson: Lesson | None) -> str:
    if lesson is None:
        return ""
    return scene_of(plan_of(lesson)) if lesson.task else lesson.scene


def _scene_name(lesson: Lesson | None, file: str) -> str:
    return f"the scene of the task {lesson.task}" if lesson and lesson.task else file.rpartition("/")[2]
