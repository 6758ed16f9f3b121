"""Where a script is flown: in the scene of the task or stage whose text is beside it, or where it was before."""

from __future__ import annotations

from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.grading.plan import Plan
from drone_sim.ros.cockpit.scripts import task_scenes
from drone_sim.ros.cockpit.scripts.lessons import Lesson
from drone_sim.ros.cockpit.simulator import Simulator, script_failure

_KEY = "scene_file"


class Places:
    """Remembers the scene that the user has chosen, while tasks and stages bring theirs."""

    def __init__(self, simulator: Simulator):
        """Take what flies."""
        self._simulator = simulator
        self._brought = ""  # the scene that a lesson has brought
        self._before = ""  # the user's, to come back to

    def told(self, lesson: Lesson) -> str:
        """Return where a lesson is flown, in one line; '' for where the user is. Raises ValueError, OSError."""
        if lesson.task:
            return task_scenes.told(plan_of(lesson))
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
    return task_scenes.scene_of(plan_of(lesson)) if lesson.task else lesson.scene
