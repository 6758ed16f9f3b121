"""Variables and breakpoints of scripts, between the simulation's topics and the browsers that look."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import rospy
from std_msgs.msg import String

from drone_sim.ros.cockpit.editor.script_store import ScriptStore
from drone_sim.ros.cockpit.server.page_socket import Answer

_LOOKS = 4.0  # s for which a browser looks that has said so: it says so every second
_HEARD_WITHIN = 1.0  # s
_STAYS = 90.0  # s after which its breakpoints go: one in the background speaks once a minute
_LONGEST = 1 << 20  # characters of a message
_MOST_PAGES = 50
_MOST_FILES, _MOST_LINES = 50, 500  # which the simulation takes
_Lines = dict[str, list[int]]  # by file


class _Page(NamedTuple):
    """What one browser has asked for, and when (s, monotonic)."""

    at: float
    lines: _Lines
    looks: bool  # whether the table is open
    live: bool  # whether it is to change while it flies


class ScriptInspector:
    """Listens to the simulation while a browser looks, and publishes the breakpoints of all of them."""

    def __init__(self, node: str, store: ScriptStore, tell: Callable[[Mapping[str, Any]], None]):
        """Look at the scripts of `node`, whose files `store` knows; `tell` sends something to all browsers."""
        self._node, self._store, self._tell = node, store, tell
        self._pages: dict[str, _Page] = {}
        self._listening: list[rospy.Subscriber] = []
        self._publisher: rospy.Publisher | None = None
        self._published: _Lines = {}
        self._state = ""  # what the simulation did when that was last told
        self._names: dict[str, list[str]] = {"objects": [], "parameters": []}
        self._lock = threading.Lock()  # browsers ask in threads of their own

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers `inspect`."""
        return {"inspect": self._inspect}

    def _inspect(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Hear what a browser looks at; return the names that scripts may use. Raises ValueError."""
        page = message.get("page")
        if not isinstance(page, str) or not 0 < len(page) <= 40:
            raise ValueError("inspect: needs a page, a name of at most 40 characters")
        asked = _Page(time.monotonic(), self._files(message.get("breakpoints", {})), *_flags(message))
        with self._lock:
            if page not in self._pages and len(self._pages) >= _MOST_PAGES:
                raise ValueError(f"inspect: at most {_MOST_PAGES} pages at once")
            self._pages[page] = asked
            before = self._publisher
            self._publish(_union(list(self._pages.values())))  # at once: who sets one may go on in the next moment
            if self._publisher is not before:
                self._wait_until_heard(self._publisher)
            return self._names

    def _wait_until_heard(self, publisher: rospy.Publisher) -> None:
        """Wait until the simulation is connected to the publisher, at most _HEARD_WITHIN (s)."""
        until = time.monotonic() + _HEARD_WITHIN
        while not publisher.get_num_connections() and time.monotonic() < until:
            time.sleep(0.01)

    def _files(self, given: Any) -> _Lines:
        """Return the breakpoints of a page by files. Raises ValueError."""
        if not isinstance(given, Mapping) or len(given) > _MOST_FILES:
            raise ValueError(f"breakpoints: must be a mapping of at most {_MOST_FILES} scripts")
        found: _Lines = {}
        paths = {one.name: str(one.path) for one in self._store.scripts()} if given else {}
        for script, lines in given.items():
            if not isinstance(lines, list) or len(lines) > _MOST_LINES or not all(type(one) is int for one in lines):
                raise ValueError(f"breakpoints: {script[:80]!r}: must have at most {_MOST_LINES} lines")
            if script in paths and lines:
                found[paths[script]] = lines
        return found

    def look(self, is_there: bool) -> None:
        """Start or stop listening; to be called repeatedly. `is_there`: there is a simulation, and a browser."""
        now = time.monotonic()
        with self._lock:
            self._pages = {name: one for name, one in self._pages.items() if now - one.at < _STAYS}
            pages = list(self._pages.values()) if is_there else []
            self._publish(_union(pages))
        self._listen(any(one.lines or (one.looks and now - one.at < _LOOKS) for one in pages), bool(pages))

    def _publish(self, lines: _Lines) -> None:
        if lines and self._publisher is None:
            self._publisher = rospy.Publisher(f"{self._node}/breakpoints", String, queue_size=1, latch=True)
        if self._publisher is not None and lines != self._published:
            self._published = lines
            self._publisher.publish(json.dumps(lines))

    def _listen(self, variables: bool, names: bool) -> None:
        """Listen to variables, names, both or nothing."""
        wanted = {
            **({f"{self._node}/variables": self._on_variables} if variables else {}),
            **({f"{self._node}/names": self._on_names} if names else {}),
        }
        for one in [one for one in self._listening if one.name not in wanted]:
            one.unregister()
            self._listening.remove(one)
            if one.callback == self._on_variables:
                self._tell({"variables": None})
        there = {one.name for one in self._listening}
        for topic, callback in wanted.items():
            if topic not in there:
                self._listening.append(rospy.Subscriber(topic, String, callback, queue_size=1))

    def _on_variables(self, message: String) -> None:
        state = _read(message)
        with self._lock:
            is_live = any(one.live for one in self._pages.values())
        if state is None:
            return
        before, self._state = self._state, str(state.get("state"))
        if is_live or {before, self._state} != {"flying"}:  # or it goes on, which is told once
            self._tell({"variables": state})

    def _on_names(self, message: String) -> None:
        names = _read(message)
        if names is not None and all(_are_words(names.get(kind)) for kind in self._names):
            with self._lock:
                self._names = {kind: names[kind] for kind in self._names}


def _flags(message: Mapping[str, Any]) -> tuple[bool, bool]:
    return message.get("looks") is True, message.get("live") is True


def _union(pages: list[_Page]) -> _Lines:
    """Return the breakpoints of all pages, as many as the simulation takes."""
    found: dict[str, set[int]] = {}
    for page in pages:
        for file, lines in page.lines.items():
            found.setdefault(file, set()).update(lines)
    return {file: sorted(lines)[:_MOST_LINES] for file, lines in sorted(found.items())[:_MOST_FILES]}


def _read(message: String) -> dict[str, Any] | None:
    try:
        state = json.loads(message.data) if len(message.data) <= _LONGEST else None
    except (ValueError, RecursionError):
        return None
    return state if isinstance(state, dict) else None


def _are_words(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, str) for one in value)
