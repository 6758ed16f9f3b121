"""Request handlers of the page's script editor: list, open, save, fly and grade scripts."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drone_sim.grading.submissions import handed_in
from drone_sim.ros.cockpit.editor.checks import TextChecker
from drone_sim.ros.cockpit.editor.lesson_scenes import SceneSwitcher, plan_of
from drone_sim.ros.cockpit.editor.lessons import Lesson, Lessons
from drone_sim.ros.cockpit.editor.scene_backend import SceneBackend
from drone_sim.ros.cockpit.editor.script_store import OWN, ScriptFile, ScriptStore, ScriptStoreError
from drone_sim.ros.cockpit.editor.task_flights import Grader, TimelinePlayer
from drone_sim.ros.cockpit.server.page_socket import Answer
from drone_sim.ros.core.shell_files import script_from_shell
from drone_sim.ros.core.simulator import FAILURES, Simulator, script_failure
from drone_sim.scripting.api.listing import for_editors
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path

_Message = Mapping[str, Any]
_MAX_DRAFT = 40  # characters of a draft's name


class EditorBackend:
    """Handlers of the editor's requests."""

    def __init__(
        self,
        store: ScriptStore,
        lessons: Lessons,
        simulator: Simulator,
        player: TimelinePlayer,
        scene: SceneBackend,
    ):
        """`simulator` flies a script in `scene`; `player` sends the timeline of its task meanwhile."""
        self._store, self._lessons, self._simulator = store, lessons, simulator
        self._player, self._scene = player, scene
        self._switcher = SceneSwitcher(simulator, scene)
        self.grader = Grader()
        self._checker = TextChecker()

    @property
    def answers(self) -> dict[str, Answer]:
        """The handler of each request. A handler raises ValueError with one line."""
        handlers = {
            "api": lambda _: for_editors(),
            "check": lambda message: self._checker.check(_text(message), message.get("lua") is True),
            "scripts": lambda _: self._list_scripts(),
            "open": lambda message: self._open(self._script(message)),
            "look": self._poll,
            "save": self._save,
            "save_as": lambda message: self._describe(*self._store.save_as(message.get("name"), _text(message))),
            "keep": self._resolve_conflict,
            "rename": self._rename,
            "duplicate": lambda message: self._describe(*self._store.duplicate(self._script(message), _text(message))),
            "delete": self._delete,
            "bring back": lambda message: self._describe(*self._store.bring_back(message.get("script"))),
            "locate": self._locate,
            "revert": lambda message: {"text": self._store.original(self._script(message))},
            "lesson": self._lesson,
            "run": self._run,
            "grade": self._grade,
            "hand in": self._hand_in,
            "graded": lambda message: self.grader.result(message.get("number")),
        }
        return {name: _with_one_line_errors(handler) for name, handler in handlers.items()}

    def for_teachers(self) -> dict[str, str]:
        """Return the flying script and the best grades in words."""
        try:
            script = self._flying_script()
        except FAILURES:
            script = ""
        grades = (f"{task} {points:g} of {of:g}" for task, (points, of) in self.grader.best.items())
        return {"script": script, "grades": ", ".join(grades)}

    # ---- scripts

    def _list_scripts(self) -> dict[str, Any]:
        """Return the names of all scripts by group, the name of the flying script, and the lessons."""
        scripts = self._store.scripts()
        groups = list(dict.fromkeys([*(script.group for script in scripts), OWN]))
        return {
            "groups": [
                {"name": group, "scripts": [script.name for script in scripts if script.group == group]}
                for group in groups
            ],
            "flown": self._flying_script(),
            "digest": self._store.digest(),
            "folder": str(self._store.folder),
            "lessons": [_describe_lesson(lesson) for lesson in self._lessons.all()],
        }

    def _flying_script(self) -> str:
        """Return the script of the vehicle: the one that the scene names, else the simulator's; '' if none flies."""
        if self._scene.has_no_vehicle:
            return ""
        path = self._scene.own_script or script_from_shell(str(self._simulator.parameter("script", ""))) or "pilot"
        with contextlib.suppress(ScriptError):  # a missing script is shown by its file name
            path = script_path(path)
        script = self._store.of_file(path)
        return Path(path).name if script is None else script.name

    def _script(self, message: _Message) -> ScriptFile:
        return self._store.find(message.get("script"))

    def _open(self, script: ScriptFile) -> dict[str, Any]:
        text, version = self._store.read(script)
        return {**self._describe(script, version), "text": text}

    def _describe(self, script: ScriptFile, version: str) -> dict[str, Any]:
        lesson = self._lessons.of_script(script)
        return {
            "script": script.name,
            "file": str(script.path),
            "version": version,
            "lesson": lesson.name if lesson else "",
        }

    def _poll(self, message: _Message) -> dict[str, Any]:
        """Return a script's version ('' if deleted), a digest of all names, and the name of the flying script."""
        flown = ""
        with contextlib.suppress(*FAILURES):  # scripts can be edited without a ROS master
            flown = self._flying_script()
        version = self._store.version(message.get("script"))
        return {"version": version, "digest": self._store.digest(), "flown": flown}

    def _save(self, message: _Message) -> dict[str, Any]:
        """Save a script unless its file is no longer the `version` that the browser has; then return `changed`."""
        name, text, version = message.get("script"), _text(message), message.get("version")
        if not isinstance(version, str):
            raise ScriptStoreError("save: needs script, text and version")
        is_deleted = str(name).startswith(f"{OWN}/") and not self._store.version(name)
        draft = str(message.get("draft", ""))[:_MAX_DRAFT]
        saved = None if is_deleted else self._store.save(self._store.find(name), text, version, draft)
        return {"changed": True} if saved is None else self._describe(*saved)

    def _resolve_conflict(self, message: _Message) -> dict[str, Any]:
        """Save both versions of a script, one of them in a new file, the `other`."""
        mine = message.get("mine") is True
        script, _, other = self._store.keep_both(message.get("script"), _text(message), mine)
        return {**self._open(script), "other": other}

    def _rename(self, message: _Message) -> dict[str, Any]:
        """Rename a script of the user's, also in the simulator's parameter if it is set there."""
        before = self._script(message)
        renamed, version = self._store.rename(before, message.get("name"))
        with contextlib.suppress(*FAILURES):  # scripts can be edited without a ROS master
            if self._simulator.parameter("script", "") == str(before.path):
                self._simulator.set_parameter("script", str(renamed.path))
        return self._describe(renamed, version)

    def _delete(self, message: _Message) -> dict[str, Any]:
        self._store.remove(self._script(message))
        return {}

    def _locate(self, message: _Message) -> dict[str, Any]:
        """Return the listed name of a script, given its file or a built-in script's name; '' if it is not listed."""
        file = str(message.get("file"))
        if "/" not in file:
            with contextlib.suppress(ScriptError):
                file = script_path(file)
        script = self._store.of_file(file)
        return {"script": script.name if script else ""}

    # ---- lessons and flights

    def _find_lesson(self, message: _Message) -> Lesson | None:
        return self._lessons.find(message.get("lesson"))

    def _task(self, message: _Message, request: str) -> str:
        """Return the task of a message's lesson. Raises ScriptStoreError if it has none."""
        lesson = self._find_lesson(message)
        if lesson is None or not lesson.task:
            raise ScriptStoreError(f"{request}: needs a task; choose one above the text")
        return lesson.task

    def _lesson(self, message: _Message) -> dict[str, Any]:
        """Return a lesson's text, its script (the user's own if there is one) and the scene that it flies in."""
        lesson = self._find_lesson(message)
        if lesson is None:
            raise ScriptStoreError(f"{str(message.get('lesson'))[:80]!r}: there is no such lesson")
        own = [
            script
            for script in self._store.scripts()
            if script.is_own and self._lessons.of_script(script) == lesson and lesson.is_begun_by(script.path.stem)
        ]
        return {
            "lesson": lesson.name,
            "text": lesson.text,
            "folder": lesson.folder,
            "script": own[0].name if own else lesson.script,
            "flies": self._switcher.describe(lesson),
        }

    def _run(self, message: _Message) -> dict[str, Any]:
        """Start a script from the beginning, in its lesson's scene; return the simulator's answer.

        If that would leave a scene of the user's and the page `may_ask`, nothing happens, and `leaves` names the
        lesson's scene.
        """
        script = self._script(message)
        path = str(script.path)
        if not path.isprintable():
            raise ScriptStoreError(
                f"{script.name!r}: a ROS parameter cannot hold this name; save the script under another name"
            )
        lesson = self._find_lesson(message)
        leaves = self._switcher.leaves_own_scene(lesson) if message.get("may_ask") is True else ""
        if leaves:
            return {"leaves": leaves}
        plan = plan_of(lesson) if lesson and lesson.task else None
        self._player.prepare(plan, self._store.read(script)[0])
        self._switcher.go_back(lesson)
        self._simulator.set_parameter("script", path)
        if self._scene.own_script and self._switcher.keeps_scene(lesson):
            self._simulator.call("stop")  # it would undo the edit
            self._scene.set_script(path)
        done, message_text = self._switcher.fly(lesson)
        self._player.begin() if done else self._player.end()
        if message_text.endswith("unavailable"):  # rospy's message for a service that does not exist
            message_text = f"the simulation does not answer: {message_text}"
        failure = None if done else script_failure(message_text)
        return {"done": done, "said": message_text, "failure": failure and failure._asdict()}

    def _grade(self, message: _Message) -> dict[str, Any]:
        """Begin to grade a script with its lesson's task; return the number of the run."""
        script = self._script(message)
        return {"number": self.grader.start(self._task(message, "grade"), script.path)}

    def _hand_in(self, message: _Message) -> dict[str, Any]:
        """Copy a script as it is saved to the folder of the course; return time and digest of the copy."""
        script = self._script(message)
        task = self._task(message, "hand in")
        now, digest = handed_in.hand_in(task, self._store.read(script)[0], script.path.suffix)
        return {"time": now, "digest": digest}


def _describe_lesson(lesson: Lesson) -> dict[str, Any]:
    described = {"lesson": lesson.name, "title": lesson.title, "task": lesson.task, "script": lesson.script}
    hands_in = handed_in.folder_of(lesson.task) is not None
    keys = ("summary", "difficulty", "time") if lesson.task else ()
    return {**described, "hands_in": hands_in, **{key: getattr(lesson, key) for key in keys}}


def _text(message: _Message) -> str:
    text = message.get("text")
    if not isinstance(text, str):
        raise ScriptStoreError("needs a text")
    return text


def _with_one_line_errors(handler: Callable[[_Message], Mapping[str, Any]]) -> Answer:
    """Convert errors of files and of the ROS master to a ValueError with one line."""

    def handle(message: _Message) -> Mapping[str, Any]:
        try:
            return handler(message)
        except FAILURES as error:
            raise ValueError(str(error) or "the ROS master does not answer") from None

    return handle
