"""Variables and breakpoints of scripts, between the simulator's topics and the browsers."""

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
from drone_sim.ros.cockpit.topics import read_json

_VIEW_TIMEOUT = 4.0  # s without a request after which a table counts as closed; requests come every second
_CONNECTION_TIMEOUT = 1.0  # s
_PAGE_TIMEOUT = 90.0  # s without a request after which a page's breakpoints go; hidden pages ask once a minute
_MAX_LENGTH = 1 << 20  # characters of a message
_MAX_PAGES = 50
_MAX_FILES, _MAX_LINES = 50, 500  # that the simulator accepts
_Lines = dict[str, list[int]]  # by file


class _Page(NamedTuple):
    """The latest request of one browser, and its time (s, monotonic)."""

    at: float
    lines: _Lines
    looks: bool  # whether the table is open
    live: bool  # whether the table changes during the flight


class ScriptInspector:
    """Forwards the simulator's variables while a table is open, and publishes the breakpoints of all browsers."""

    def __init__(self, node: str, store: ScriptStore, broadcast: Callable[[Mapping[str, Any]], None]):
        """`node` is the simulator's name, `store` lists its scripts, `broadcast` sends a message to all browsers."""
        self._node, self._store, self._broadcast = node, store, broadcast
        self._pages: dict[str, _Page] = {}
        self._subscribers: list[rospy.Subscriber] = []
        self._shows_variables = False  # in some browser
        self._publisher: rospy.Publisher | None = None
        self._published: _Lines = {}
        self._state = ""  # of the simulator, in the last message
        self._names: dict[str, list[str]] = {"objects": [], "parameters": []}
        self._lock = threading.Lock()  # each browser is served by its own thread

    @property
    def answers(self) -> dict[str, Answer]:
        return {"inspect": self._inspect}

    def _inspect(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Store what a browser shows; return the names that scripts may use. Raises ValueError."""
        page = message.get("page")
        if not isinstance(page, str) or not 0 < len(page) <= 40:
            raise ValueError("inspect: needs a page, a name of at most 40 characters")
        breakpoints = self._breakpoints(message.get("breakpoints", {}))
        request = _Page(time.monotonic(), breakpoints, message.get("looks") is True, message.get("live") is True)
        with self._lock:
            if page not in self._pages and len(self._pages) >= _MAX_PAGES:
                raise ValueError(f"inspect: at most {_MAX_PAGES} pages at once")
            self._pages[page] = request
            before = self._publisher
            self._publish(_union(list(self._pages.values())))  # at once: the flight may be resumed right after
            publisher = self._publisher
            if publisher is not None and publisher is not before:
                deadline = time.monotonic() + _CONNECTION_TIMEOUT
                while not publisher.get_num_connections() and time.monotonic() < deadline:
                    time.sleep(0.01)
            return self._names

    def _breakpoints(self, value: Any) -> _Lines:
        """Return the breakpoints of a page by file. Raises ValueError."""
        if not isinstance(value, Mapping) or len(value) > _MAX_FILES:
            raise ValueError(f"breakpoints: must be a mapping of at most {_MAX_FILES} scripts")
        breakpoints: _Lines = {}
        paths = {script.name: str(script.path) for script in self._store.scripts()} if value else {}
        for script, lines in value.items():
            if not isinstance(lines, list) or len(lines) > _MAX_LINES or not all(type(line) is int for line in lines):
                raise ValueError(f"breakpoints: {script[:80]!r}: must have at most {_MAX_LINES} lines")
            if script in paths and lines:
                breakpoints[paths[script]] = lines
        return breakpoints

    def update(self, is_connected: bool) -> None:
        """Start or stop subscriptions; to be called repeatedly. `is_connected`: simulator and a browser are there."""
        now = time.monotonic()
        with self._lock:
            self._pages = {name: page for name, page in self._pages.items() if now - page.at < _PAGE_TIMEOUT}
            pages = list(self._pages.values()) if is_connected else []
            self._publish(_union(pages))
        shows_variables = any(page.lines or (page.looks and now - page.at < _VIEW_TIMEOUT) for page in pages)
        self._subscribe(shows_variables, bool(pages))

    def _publish(self, lines: _Lines) -> None:
        if lines and self._publisher is None:
            self._publisher = rospy.Publisher(f"{self._node}/breakpoints", String, queue_size=1, latch=True)
        if self._publisher is not None and lines != self._published:
            self._published = lines
            self._publisher.publish(json.dumps(lines))

    def _subscribe(self, variables: bool, names: bool) -> None:
        """Subscribe to variables, names, both or nothing."""
        wanted = {
            **({f"{self._node}/variables": self._on_variables} if variables else {}),
            **({f"{self._node}/names": self._on_names} if names else {}),
        }
        with self._lock:  # a callback may still run after `unregister`
            if self._shows_variables and not variables:
                self._broadcast({"variables": None})
            self._shows_variables = variables
        for subscriber in [subscriber for subscriber in self._subscribers if subscriber.name not in wanted]:
            subscriber.unregister()
            self._subscribers.remove(subscriber)
        subscribed = {subscriber.name for subscriber in self._subscribers}
        for topic, callback in wanted.items():
            if topic not in subscribed:
                self._subscribers.append(rospy.Subscriber(topic, String, callback, queue_size=1))

    def _on_variables(self, message: String) -> None:
        state = read_json(message, _MAX_LENGTH)
        if state is None:
            return
        with self._lock:
            if not self._shows_variables:
                return
            is_live = any(page.live for page in self._pages.values())
            before, self._state = self._state, str(state.get("state"))
            if is_live or {before, self._state} != {"flying"}:  # not live: only changes of the state
                self._broadcast({"variables": state})

    def _on_names(self, message: String) -> None:
        names = read_json(message, _MAX_LENGTH) or {}
        lists: list[Any] = [names.get(kind) for kind in self._names]
        if all(isinstance(words, list) and all(isinstance(word, str) for word in words) for words in lists):
            with self._lock:
                self._names = dict(zip(self._names, lists))


def _union(pages: list[_Page]) -> _Lines:
    """Return the breakpoints of all pages, as many as the simulator accepts."""
    union: dict[str, set[int]] = {}
    for page in pages:
        for file, lines in page.lines.items():
            union.setdefault(file, set()).update(lines)
    return {file: sorted(lines)[:_MAX_LINES] for file, lines in sorted(union.items())[:_MAX_FILES]}
