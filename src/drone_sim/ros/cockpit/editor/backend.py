"""What the page's editor asks for: scripts, their texts, to save them, and to fly them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drone_sim.ros.cockpit.editor.checks import TextChecker
from drone_sim.ros.cockpit.editor.lessons import Lesson, Lessons
from drone_sim.ros.cockpit.editor.scene_files import SceneSwitcher, plan_of
from drone_sim.ros.cockpit.editor.script_store import OWN, ScriptFile, ScriptStore, ScriptStoreError
from drone_sim.ros.cockpit.editor.task_flights import Grader, TimelinePlayer
from drone_sim.ros.cockpit.server.page_socket import Answer
from drone_sim.ros.core.simulator import FAILURES, Simulator, script_failure
from drone_sim.ros.core.startup import script_from_shell
from drone_sim.scripting.api.listing import for_editors
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path

_Message = Mapping[str, Any]


class EditorBackend:
    """The answers, by what is asked."""

    def __init__(self, store: ScriptStore, lessons: Lessons, simulator: Simulator, player: TimelinePlayer):
        """Answer from `store` and `lessons`; `simulator` flies a script, `player` sends what its task says happens."""
        self._store = store
        self._lessons = lessons
        self._simulator = simulator
        self._switcher = SceneSwitcher(simulator)
        self._player = player
        self._grader = Grader()
        self._checker = TextChecker()

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers each question."""
        asked = {
            "api": lambda _: for_editors(),
            "check": lambda message: self._checker.check(_text(message), message.get("lua") is True),
            "scripts": lambda _: self._scripts(),
            "open": lambda message: self._opened(self._script(message)),
            "look": self._look,
            "save": self._save,
            "save_as": lambda one: self._described(*self._store.save_as(one.get("name"), _text(one))),
            "keep": self._keep,
            "rename": self._rename,
            "duplicate": lambda one: self._described(*self._store.duplicate(self._script(one), _text(one))),
            "delete": self._delete,
            "bring back": lambda one: self._described(*self._store.bring_back(one.get("script"))),
            "locate": self._locate,
            "revert": lambda message: {"text": self._store.original(self._script(message))},
            "lesson": self._lesson,
            "run": self._run,
            "grade": self._grade,
            "graded": lambda message: self._grader.result(message.get("number")),
        }
        return {name: _in_one_line(answer) for name, answer in asked.items()}

    # ---- scripts

    def _scripts(self) -> dict[str, Any]:
        """Return the names of all scripts by their kinds, that of the one that flies, and the texts' titles."""
        scripts = self._store.scripts()
        kinds = list(dict.fromkeys([*(script.group for script in scripts), OWN]))
        return {
            "groups": [{"name": kind, "scripts": [one.name for one in scripts if one.group == kind]} for kind in kinds],
            "flown": self._flown(),
            "digest": self._store.digest(),
            "folder": str(self._store.folder),
            "lessons": [
                {"lesson": one.name, "title": one.title, "task": one.task, "script": one.script}
                for one in self._lessons.all()
            ],
        }

    def _flown(self) -> str:
        flown = script_from_shell(str(self._simulator.parameter("script", ""))) or "pilot"
        with contextlib.suppress(ScriptError):  # one that is not there has its file's name
            flown = script_path(flown)
        script = self._store.of_file(flown)
        return Path(flown).name if script is None else script.name

    def _script(self, message: _Message) -> ScriptFile:
        return self._store.find(message.get("script"))

    def _opened(self, script: ScriptFile) -> dict[str, Any]:
        text, version = self._store.read(script)
        return {**self._described(script, version), "text": text}

    def _described(self, script: ScriptFile, version: str) -> dict[str, Any]:
        lesson = self._lessons.of_script(script)
        return {
            "script": script.name,
            "file": str(script.path),
            "version": version,
            "lesson": lesson.name if lesson else "",
        }

    def _look(self, message: _Message) -> dict[str, Any]:
        """Return what may have changed: a script's version ('' if deleted), a digest of all names, and what flies."""
        try:
            flown = self._flown()
        except FAILURES:  # the disk is there without a master, too
            flown = ""
        version = self._store.version(message.get("script"))
        return {"version": version, "digest": self._store.digest(), "flown": flown}

    def _save(self, message: _Message) -> dict[str, Any]:
        """Save the text of a script whose version the browser has, unless somebody else has `changed` it."""
        name, text, version = message.get("script"), _text(message), message.get("version")
        if not isinstance(version, str):
            raise ScriptStoreError("save: needs script, text and version")
        gone = str(name).startswith(f"{OWN}/") and not self._store.version(name)
        saved = None if gone else self._store.save(self._store.find(name), text, version)
        return {"changed": True} if saved is None else self._described(*saved)

    def _keep(self, message: _Message) -> dict[str, Any]:
        """End a conflict: both texts are kept, one of them in another file."""
        mine = message.get("mine") is True
        script, _, other = self._store.keep_both(message.get("script"), _text(message), mine)
        return {**self._opened(script), "other": other}

    def _rename(self, message: _Message) -> dict[str, Any]:
        """Give a script of the user's another name, by which the simulation knows it, too, where it flies."""
        before = self._script(message)
        renamed, version = self._store.rename(before, message.get("name"))
        try:
            if self._simulator.parameter("script", "") == str(before.path):
                self._simulator.set_parameter("script", str(renamed.path))
        except FAILURES:  # the disk is there without a master, too
            pass
        return self._described(renamed, version)

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

    # ---- texts, and flights

    def _lesson(self, message: _Message) -> dict[str, Any]:
        """Return a text, and which of the user's scripts, or of the package's, belongs to it."""
        lesson = self._find_lesson(message)
        if lesson is None:
            raise ScriptStoreError(f"{str(message.get('lesson'))[:80]!r}: there is no such lesson")
        own = [
            one
            for one in self._store.scripts()
            if one.is_own and self._lessons.of_script(one) == lesson and lesson.is_begun_by(one.path.stem)
        ]
        return {
            "lesson": lesson.name,
            "text": lesson.text,
            "folder": lesson.folder,
            "script": own[0].name if own else lesson.script,
            "flies": self._switcher.describe(lesson),
        }

    def _find_lesson(self, message: _Message) -> Lesson | None:
        return self._lessons.find(message.get("lesson"))

    def _run(self, message: _Message) -> dict[str, Any]:
        """Fly a script from the start, in the scene that its text asks for; return the simulation's answer."""
        script = self._script(message)
        path = str(script.path)
        if not path.isprintable():
            raise ScriptStoreError(
                f"{script.name!r}: a ROS parameter cannot hold this name; save the script under another name"
            )
        lesson = self._find_lesson(message)
        self._player.prepare(plan_of(lesson) if lesson and lesson.task else None)
        self._simulator.set_parameter("script", path)
        done, said = self._switcher.fly(lesson)
        self._player.begin() if done else self._player.end()
        if said.endswith("unavailable"):  # rospy's word for a service of nobody
            said = f"the simulation does not answer: {said}"
        failure = None if done else script_failure(said)
        return {"done": done, "said": said, "failure": failure and failure._asdict()}

    def _grade(self, message: _Message) -> dict[str, Any]:
        """Begin to grade a script by the task beside it."""
        lesson, script = self._find_lesson(message), self._script(message)
        if lesson is None or not lesson.task:
            raise ScriptStoreError("grade: needs a task; choose one above the text")
        return {"number": self._grader.start(lesson.task, script.path)}


def _text(message: _Message) -> str:
    text = message.get("text")
    if not isinstance(text, str):
        raise ScriptStoreError("needs a text")
    return text


def _in_one_line(answer: Callable[[_Message], Mapping[str, Any]]) -> Answer:
    """Turn errors of files and of the master into a ValueError with one line."""

    def answered(message: _Message) -> Mapping[str, Any]:
        try:
            return answer(message)
        except FAILURES as error:
            raise ValueError(str(error) or "the ROS master does not answer") from None

    return answered
