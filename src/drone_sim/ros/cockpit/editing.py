"""What the page's editor asks for: scripts, their text, to save them, and to fly them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drone_sim.ros.cockpit.shelf import Book, Shelf
from drone_sim.ros.cockpit.simulator import Simulator, script_failure
from drone_sim.ros.cockpit.wire import Answer


class Editing:
    """The answers, by what is asked."""

    def __init__(self, shelf: Shelf, simulator: Simulator):
        """Take where scripts are, and what flies them."""
        self._shelf = shelf
        self._simulator = simulator

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers `scripts`, `open`, `save`, `revert` and `run`."""
        return {
            "scripts": lambda _: self._scripts(),
            "open": lambda message: self._open(self._shelf.find(message.get("script"))),
            "save": lambda message: self._save(message),
            "revert": lambda message: {"text": self._shelf.original(self._shelf.find(message.get("script")))},
            "run": lambda message: self._run(message),
        }

    def _scripts(self) -> dict[str, Any]:
        """Return the names of all scripts, and that of the one that flies."""
        flown = str(self._simulator.parameter("script", "") or "pilot")
        book = self._shelf.of_file(flown)
        name = book.name if book else f"built-in/{flown}.py"
        return {"scripts": [one.name for one in self._shelf.books()], "flown": name}

    def _open(self, book: Book) -> dict[str, Any]:
        text, version = self._shelf.read(book)
        return {"script": book.name, "text": text, "version": version}

    def _save(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Save the text of a script whose version the browser has."""
        text, version = message.get("text"), message.get("version")
        if not (isinstance(text, str) and isinstance(version, str)):
            raise ValueError("save: needs script, text and version")
        book, version = self._shelf.save(self._shelf.find(message.get("script")), text, version)
        return {"script": book.name, "version": version}

    def _run(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Fly a script from the start; what the simulation says of it is the answer."""
        book = self._shelf.find(message.get("script"))
        self._simulator.set_parameter("script", str(book.path))
        done, said = self._simulator.call("restart")
        failure = None if done else script_failure(said)
        return {"done": done, "said": said, "line": failure.line if failure and failure.file == str(book.path) else 0}
