"""Cockpit node: it shows a simulator in browsers, and uses only the simulator's topics and services."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import rospy

from drone_sim.ros.cockpit.classroom import Classroom
from drone_sim.ros.cockpit.editor.backend import EditorBackend
from drone_sim.ros.cockpit.editor.inspection import ScriptInspector
from drone_sim.ros.cockpit.editor.lessons import Lessons
from drone_sim.ros.cockpit.editor.lists import NEW_SCENE, SceneList
from drone_sim.ros.cockpit.editor.scene_backend import SceneBackend
from drone_sim.ros.cockpit.editor.script_store import ScriptStore
from drone_sim.ros.cockpit.editor.task_flights import TimelinePlayer
from drone_sim.ros.cockpit.panel.board import NO_SIMULATION
from drone_sim.ros.cockpit.panel.cameras import CameraSwitches, ScriptWindows
from drone_sim.ros.cockpit.panel.panel import Panel
from drone_sim.ros.cockpit.scene.meshes import MeshStore
from drone_sim.ros.cockpit.scene.scene_state import SceneState
from drone_sim.ros.cockpit.scene.scene_view import SceneView
from drone_sim.ros.cockpit.server.access_control import Content
from drone_sim.ros.cockpit.server.page_server import PageServer, find_manual
from drone_sim.ros.cockpit.server.page_socket import Answer, PageSocket
from drone_sim.ros.cockpit.teleop import CommandPublisher, HeldCommands
from drone_sim.ros.cockpit.topics import FoundTopics, find_topics
from drone_sim.ros.core.master_watch import MasterWatch
from drone_sim.ros.core.simulator import FAILURES, Simulator
from drone_sim.ros.core.startup import give_way

_PERIOD, _IDLE_PERIOD = 0.05, 0.1  # s between two updates of the scene, and without one
_MARKER_DELAY = 0.008  # s, within which the markers of a step arrive after its frames
_HELD_PERIOD = 0.1  # s between two messages for held keys and dragged objects
_SLEEP = 0.5  # s between two looks for the end of the node, without a browser
# s between two requests to the master: while a browser waits for the simulator, with it, and without a browser.
_SEARCH_PERIOD, _MASTER_PERIOD, _UNSEEN_PERIOD = 0.3, 2.0, 10.0


class Cockpit:
    """Connects browsers to one simulator. While no browser is connected, it does not subscribe to the simulator."""

    def __init__(self, server: PageServer, simulator: str, scripts: Path):
        """Serve the simulator node `simulator` through `server`; `scripts` is the user's folder of scripts."""
        self._server, self._simulator = server, Simulator(simulator)
        node = self._simulator.node
        self._topics = FoundTopics()
        self._view: SceneView | None = None
        self._asked_master_at = 0.0
        self._scene: tuple[object, ...] = ()  # when the master was last asked
        self._state, self._meshes, self._lessons = SceneState(), MeshStore(), Lessons()
        self._commands = CommandPublisher()
        self._held = HeldCommands(self._commands.send)
        answers: dict[str, Answer] = {}  # filled below, before the socket serves browsers
        handlers = {"drag": self._drag, "push": self._push}
        self._socket = PageSocket(self._held, answers, handlers, scene=self._state.since)
        store = ScriptStore(scripts)
        self._inspector = ScriptInspector(node, store, self._socket.tell)
        self._editing = SceneBackend(node, scripts, self._socket.tell_tree, lambda: self._commands.vehicle)
        editor = EditorBackend(store, self._lessons, self._simulator, TimelinePlayer(node), self._editing)
        self._report_file = editor.grader.report_file
        self._panel = Panel(self._simulator, self._commands, SceneList(scripts), self._socket.tell)
        self._cameras = CameraSwitches(self._panel.board, self._socket)
        self._windows = ScriptWindows(node, self._cameras, self._socket)
        for part in (editor, self._inspector, self._editing, self._panel, self._windows):
            answers.update(part.answers)
        server.begin(self._socket.serve, self._find)
        room = Classroom(self._panel.board, lambda: bool(self._socket.browsers), self._camera, editor.for_teachers)
        for loop in (self._repeat_held, room.run):
            threading.Thread(target=loop, daemon=True).start()
        self._panel.pulse.start()

    def run(self) -> None:
        """Update the browsers until the node ends."""
        logging.getLogger("rosout").addFilter(_is_not_repeated)
        MasterWatch(meanwhile="the page waits for it").start()
        while not rospy.is_shutdown():
            self._socket.wait_for_browser(_SLEEP)
            began = time.monotonic()
            self._update(began)
            period = _IDLE_PERIOD if self._view is None else 0.8 * _PERIOD
            time.sleep(max(0.0, period - (time.monotonic() - began)))
            if self._view is not None:
                self._view.wait(_PERIOD)  # for the next step of the simulation
                time.sleep(_MARKER_DELAY)
        self._server.stop()

    def _repeat_held(self) -> None:
        """Repeat the commands of held keys, and keep holding dragged objects.

        In a thread of its own, because `run` waits for the master's replies.
        """
        while not rospy.is_shutdown():
            time.sleep(_HELD_PERIOD)
            self._socket.wait_for_browser(_SLEEP)
            self._held.repeat()
            if (view := self._view) is not None:
                view.keep(self._socket.browsers)

    def _update(self, now: float) -> None:
        browsers = self._socket.browsers
        scene = self._editing.scene
        period = _MASTER_PERIOD if self._topics.namespace else _SEARCH_PERIOD
        if scene != self._scene or now - self._asked_master_at > (period if browsers else _UNSEEN_PERIOD):
            self._scene, self._asked_master_at = scene, now  # at once, so that no picture of the old scene stays
            self._ask_master()
        self._inspector.update(bool(self._topics.namespace))
        wanted = self._topics.namespace if browsers else ""
        if (self._view.namespace if self._view else "") != wanted:
            self._open(wanted)
        if self._view is not None:
            self._view.meet(self._topics.vehicles)
            self._view.collect()
            self._editing.subscribe(True)
            self._panel.follow(self._commands.vehicle)
            self._panel.plots.rest()
            self._cameras.show()
        self._socket.show_scene()

    def _open(self, namespace: str) -> None:
        """Show another simulation, '' for none."""
        if self._view is not None:
            self._view.close()
        self._view = SceneView(self._state, self._meshes, namespace) if namespace else None
        if namespace:
            give_way()
        self._panel.listen(bool(namespace))
        if not namespace:
            self._editing.subscribe(False)
            self._panel.follow("")
            self._panel.plots.rest()
        self._cameras.rest(not namespace)
        self._windows.listen(bool(namespace))

    def _find(self, path: str) -> Content:
        content = self._meshes.find(path) or self._lessons.picture(path) or find_manual(path)
        return content or self._editing.models.picture(path) or self._report_file(path)

    def _camera(self) -> str:
        """Return the topic with the compressed pictures of the vehicle's camera; '' if there is none."""
        prefix = f"/{self._commands.vehicle}/"
        compressed = [one.compressed for one in self._topics.cameras if one.topic.startswith(prefix) and one.compressed]
        return next((topic for topic in compressed if "front" in topic), compressed[0] if compressed else "")

    def _drag(self, browser: int, message: Mapping[str, Any]) -> None:
        if self._view is not None:
            self._view.drag(browser, message)

    def _push(self, _browser: int, message: Mapping[str, Any]) -> None:
        if self._view is not None:
            self._view.push(message)

    def _ask_master(self) -> None:
        try:
            below = rospy.get_namespace()  # there may be other simulators in other namespaces
            topics = [(name, kind) for name, kind in rospy.get_published_topics() if name.startswith(below)]
            self._topics = find_topics(topics)
            scene = NEW_SCENE if self._editing.is_new else str(self._simulator.parameter("scene_file", ""))
            self._panel.board.show("master", True)
        except FAILURES:  # the master may be started again
            self._topics, scene = FoundTopics(), ""
            self._panel.board.show("master", False)
        if not self._topics.namespace:
            self._panel.board.show("status", NO_SIMULATION)
        self._panel.offer(self._topics, scene)
        self._cameras.offer(self._topics.cameras, self._topics.vehicles)


def _is_not_repeated(record: logging.LogRecord) -> bool:
    """Filter out rospy's message per topic about an unreachable master, which `MasterWatch` reports once."""
    return "registrations are now out of sync" not in str(record.msg)
