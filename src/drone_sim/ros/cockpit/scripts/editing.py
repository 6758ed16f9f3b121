"""What the page's editor asks for: scripts, their texts, to save them, and to fly them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import rosgraph

from drone_sim.ros.cockpit.scripts.grader import Grader
from drone_sim.ros.cockpit.scripts.happenings import Happenings
from drone_sim.ros.cockpit.scripts.lessons import Lesson, Lessons
from drone_sim.ros.cockpit.scripts.places import Places, plan_of
from drone_sim.ros.cockpit.scripts.script_files import ShelfError
from drone_sim.ros.cockpit.scripts.shelf import OWN, Book, Shelf
from drone_sim.ros.cockpit.server.wire import Answer
from drone_sim.ros.cockpit.simulator import FAILURES, Simulator, script_failure

_Message = Mapping[str, Any]


class Editing:
    """The answers, by what is asked."""

    def __init__(self, shelf: Shelf, lessons: Lessons, simulator: Simulator, happenings: Happenings):
        """Take where scripts and texts are, what flies them, and what lets happen what a task says."""
        self._shelf = shelf
        self._lessons = lessons
        self._simulator = simulator
        self._places = Places(simulator)
        self._happenings = happenings
        self._grader = Grader()

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers each question."""
        asked = {
            "scripts": lambda _: self._scripts(),
            "open": lambda message: self._opened(self._book(message)),
            "look": self._look,
            "save": self._save,
            "save_as": self._save_as,
            "keep": self._keep,
            "revert": lambda message: {"text": self._shelf.original(self._book(message))},
            "lesson": self._lesson,
            "run": self._run,
            "grade": self._grade,
            "graded": lambda message: self._grader.result(message.get("number")),
        }
        return {name: _told(answer) for name, answer in asked.items()}

    # ---- scripts

    def _scripts(self) -> dict[str, Any]:
        """Return the names of all scripts by their kinds, that of the one that flies, and the texts' titles."""
        books = self._shelf.books()
        kinds = list(dict.fromkeys([*(book.group for book in books), OWN]))
        return {
            "groups": [{"name": kind, "scripts": [one.name for one in books if one.group == kind]} for kind in kinds],
            "flown": self._flown(),
            "shelf": self._shelf.digest(),
            "folder": str(self._shelf.folder),
            "lessons": [
                {"lesson": one.name, "title": one.title, "task": one.task, "script": one.script}
                for one in self._lessons.all()
            ],
        }

    def _flown(self) -> str:
        flown = str(self._simulator.parameter("script", "") or "pilot")
        book = self._shelf.of_file(flown)
        return book.name if book else f"built-in/{flown}.py"

    def _book(self, message: _Message) -> Book:
        return self._shelf.find(message.get("script"))

    def _opened(self, book: Book) -> dict[str, Any]:
        text, version = self._shelf.read(book)
        return {**self._named(book, version), "text": text}

    def _named(self, book: Book, version: str) -> dict[str, Any]:
        lesson = self._lessons.of_script(book)
        return {
            "script": book.name,
            "file": str(book.path),
            "version": version,
            "lesson": lesson.name if lesson else "",
        }

    def _look(self, message: _Message) -> dict[str, Any]:
        """Tell what has changed on the disk: the version of a script, '' where it is gone, and which there are."""
        return {"version": self._shelf.version(message.get("script")), "shelf": self._shelf.digest()}

    def _save(self, message: _Message) -> dict[str, Any]:
        """Save the text of a script whose version the browser has, unless somebody else has `changed` it."""
        name, text, version = message.get("script"), _text(message), message.get("version")
        if not isinstance(version, str):
            raise ShelfError("save: needs script, text and version")
        gone = str(name).startswith(f"{OWN}/") and not self._shelf.version(name)
        saved = None if gone else self._shelf.save(self._shelf.find(name), text, version)
        return {"changed": True} if saved is None else self._named(*saved)

    def _save_as(self, message: _Message) -> dict[str, Any]:
        return self._named(*self._shelf.save_as(message.get("name"), _text(message)))

    def _keep(self, message: _Message) -> dict[str, Any]:
        """End a conflict: both texts are kept, one of them in another file."""
        mine = message.get("mine") is True
        book, _, other = self._shelf.keep_both(message.get("script"), _text(message), mine)
        return {**self._opened(book), "other": other}

    # ---- texts, and flights

    def _lesson(self, message: _Message) -> dict[str, Any]:
        """Return a text, and which of the user's scripts, or of the package's, belongs to it."""
        lesson = self._find_lesson(message)
        if lesson is None:
            raise ShelfError(f"{str(message.get('lesson'))[:80]!r}: no such text")
        own = [one for one in self._shelf.books() if one.is_own and self._lessons.of_script(one) == lesson]
        return {
            "lesson": lesson.name,
            "text": lesson.text,
            "folder": lesson.folder,
            "script": own[0].name if own else lesson.script,
            "flies": self._places.told(lesson),
        }

    def _find_lesson(self, message: _Message) -> Lesson | None:
        return self._lessons.find(message.get("lesson"))

    def _run(self, message: _Message) -> dict[str, Any]:
        """Fly a script from the start, where its text says; what the simulation says of it is the answer."""
        book = self._book(message)
        path = str(book.path)
        if not path.isprintable():
            raise ShelfError(f"{book.name!r}: ROS cannot pass on such a name; save it as another one")
        lesson = self._find_lesson(message)
        self._happenings.prepare(plan_of(lesson) if lesson and lesson.task else None)
        self._simulator.set_parameter("script", path)
        done, said = self._places.fly(lesson)
        self._happenings.begin() if done else self._happenings.end()
        if said.endswith("unavailable"):  # rospy's word for a service of nobody
            said = f"no simulation answers: {said}"
        failure = None if done else script_failure(said)
        return {"done": done, "said": said, "line": failure.line if failure and failure.file == path else 0}

    def _grade(self, message: _Message) -> dict[str, Any]:
        """Begin to grade a script by the task beside it."""
        lesson, book = self._find_lesson(message), self._book(message)
        if lesson is None or not lesson.task:
            raise ShelfError("grade: needs a task; choose one above the text")
        return {"number": self._grader.start(lesson.task, book.path)}


def _text(message: _Message) -> str:
    text = message.get("text")
    if not isinstance(text, str):
        raise ShelfError("needs a text")
    return text


def _told(answer: Callable[[_Message], Mapping[str, Any]]) -> Answer:
    """Let what goes wrong with files and with the master be told in one line."""

    def answered(message: _Message) -> Mapping[str, Any]:
        try:
            return answer(message)
        except (*FAILURES, rosgraph.MasterException) as error:
            raise ValueError(str(error) or "the ROS master does not answer") from None

    return answered
