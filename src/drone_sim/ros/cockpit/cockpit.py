"""The simulation in a browser, from a node that only knows its topics and services."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import rospy

from drone_sim.ros.cockpit.editor.backend import EditorBackend
from drone_sim.ros.cockpit.editor.lessons import Lessons
from drone_sim.ros.cockpit.editor.scene_files import SceneList
from drone_sim.ros.cockpit.editor.script_store import ScriptStore
from drone_sim.ros.cockpit.editor.task_flights import TimelinePlayer
from drone_sim.ros.cockpit.panel.cameras import ScriptWindows
from drone_sim.ros.cockpit.panel.panel import Panel, SimulatorListener
from drone_sim.ros.cockpit.scene.frames import Viewpoint
from drone_sim.ros.cockpit.scene.handles import Selection
from drone_sim.ros.cockpit.scene.scene_view import SceneView, Sunlight
from drone_sim.ros.cockpit.server.page_server import PageServer
from drone_sim.ros.cockpit.server.page_socket import PageSocket
from drone_sim.ros.cockpit.teleop import CommandPublisher, HeldCommands
from drone_sim.ros.cockpit.topics import FoundTopics, find_topics
from drone_sim.ros.core.master_watch import MasterWatch
from drone_sim.ros.core.simulator import FAILURES, Simulator
from drone_sim.vehicles.parameters import UNPREFIXED

_WIDTH = 270  # pixels of the panel
_HORIZON, _ZENITH = (209, 217, 224), (118, 160, 205)
_PERIOD = 0.05  # s between two looks: 20 a second
_ASKING = 2.0  # s between two questions to the master


class Cockpit:
    """One page for one simulation. While no browser is open, it listens to nothing."""

    def __init__(self, server: PageServer, simulator: str, scripts: Path):
        """Fill what `server` serves with the simulation of the node `simulator`; the user's `scripts` are a folder."""
        self._simulator = Simulator(simulator)
        self._topics = FoundTopics()
        self._view: SceneView | None = None
        self._listener: SimulatorListener | None = None
        self._asked, self._has_master = 0.0, True
        self._commands = CommandPublisher()
        self._viewpoint, self._selection = Viewpoint(), Selection()
        held = HeldCommands(self._commands.send)
        store, lessons = ScriptStore(scripts), Lessons()
        editor = EditorBackend(store, lessons, self._simulator, TimelinePlayer(self._simulator.node))
        windows = {name: partial(self._ask_windows, name) for name in ("windows", "answer", "camera")}
        self._socket = PageSocket(held, {**editor.answers, **windows, "let go": self._let_go, "spare": self._spare})
        self._server = server.server
        self._server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._server.scene.set_up_direction("+z")
        self._server.scene.set_background_image(_sky())
        self._sun = Sunlight(self._server.scene)
        panel = self._server.gui.main_panel
        panel.dock_right()
        panel.set_width(_WIDTH)
        scenes = SceneList(scripts)
        self._panel = Panel(
            self._server.gui, self._simulator, self._commands, scenes, self._viewpoint, self._selection, self._socket
        )
        self._windows = ScriptWindows(self._simulator.node, self._panel.cameras, self._socket)
        server.begin(self._socket.serve, lessons.picture)
        threading.Thread(target=held.run, args=(lambda: not rospy.is_shutdown(),), daemon=True).start()

    def run(self) -> None:
        """Show what is new, again and again."""
        logging.getLogger("rosout").addFilter(_is_not_repeated)
        MasterWatch(meanwhile="the page waits for one").start()
        while not rospy.is_shutdown():
            began = time.monotonic()
            self._look(began)
            time.sleep(max(0.0, _PERIOD - (time.monotonic() - began)))
        self._server.stop()

    def _look(self, now: float) -> None:
        clients = self._server.get_clients()
        if now - self._asked > _ASKING:
            self._asked = now
            self._ask_master()
        self._panel.clear_old_message()
        wanted = self._topics.namespace if clients else ""
        if (self._view.namespace if self._view else "") != wanted:
            self._open(wanted)
        if self._view is None:
            return
        with self._server.atomic():
            self._view.frames.show_axes(self._panel.axes.value)
            self._view.handles.show_all(self._panel.handles.value)
            self._view.strength = self._panel.strength.value
            self._sun.cast(self._panel.shadows.value)
            self._view.show(clients.keys())
        self._panel.offer_objects(self._view.objects.names)
        vehicle = self._commands.vehicle
        prefix = _frame_prefix(vehicle, is_alone=self._topics.namespace.strip("/") == vehicle)
        self._panel.offer_viewpoints(self._viewpoint.choices(self._view.frames, prefix))
        if not (self._view.handles.held or self._view.objects.held):  # or the eyes would run after the mouse
            self._viewpoint.follow(clients.values(), self._view.frames, prefix)
        for one in (self._panel.plots, self._panel.tuning):
            one.follow(vehicle)
            one.show()
        self._panel.sensor.show()
        self._panel.cameras.show()

    def _open(self, namespace: str) -> None:
        """Show another simulation, '' for none."""
        for one in (self._view, self._listener):
            if one is not None:
                one.close()
        self._view = SceneView(self._server.scene, namespace, self._sun, self._selection) if namespace else None
        self._listener = SimulatorListener(self._simulator.node, self._panel, self._socket) if namespace else None
        self._panel.cameras.rest(not namespace)
        self._windows.listen(bool(namespace))
        if not namespace:
            self._panel.plots.follow("")
            self._panel.sensor.show(listening=False)
            self._panel.tuning.follow("")

    def _ask_windows(self, what: str, message: Mapping[str, Any]) -> Mapping[str, Any]:
        return self._windows.answers[what](message)

    def _let_go(self, _message: Mapping[str, Any]) -> Mapping[str, Any]:
        self._selection.name = ""
        return {}

    def _spare(self, _message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Do without what is too much for a browser that paints without a GPU."""
        self._panel.shadows.value = False
        return {}

    def _ask_master(self) -> None:
        try:
            below = rospy.get_namespace()  # another simulator may fly in another one
            self._topics = find_topics([one for one in rospy.get_published_topics() if one[0].startswith(below)])
            scene = str(self._simulator.parameter("scene_file", ""))
            self._tell_of_master(True)
        except FAILURES:  # another master may come
            self._topics, scene = FoundTopics(), ""
            self._tell_of_master(False)
        if not self._topics.namespace:
            self._panel.show_status("no simulation")
        self._panel.offer(self._topics, scene)

    def _tell_of_master(self, answers: bool) -> None:
        if answers != self._has_master:
            self._has_master = answers
            self._panel.say("the ROS master is there again" if answers else "no ROS master answers: waiting for one")


def _frame_prefix(vehicle: str, is_alone: bool) -> str:
    """Return what the names of a vehicle's frames begin with, by the namespace of its topics, such as `a/drone`."""
    above, slash, name = vehicle.rpartition("/")
    return f"{above}{slash}" if is_alone and name == UNPREFIXED else f"{vehicle}/"


def _is_not_repeated(record: logging.LogRecord) -> bool:
    """Leave out what rospy says of each single topic when there is no master: `MasterWatch` says it once."""
    return "registrations are now out of sync" not in str(record.msg)


def _sky() -> np.ndarray:
    """Return a column of the sky, paler towards the horizon."""
    height = np.linspace(1.0, 0.0, 64)[:, None, None]
    return np.asarray(_HORIZON + height * (np.array(_ZENITH) - _HORIZON), dtype=np.uint8)
