"""The simulation in a browser, from a node that only knows its topics and services."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import rospy

from drone_sim.ros.cockpit.flying.commanding import Commanding
from drone_sim.ros.cockpit.flying.flying import Flying
from drone_sim.ros.cockpit.found import Found, find
from drone_sim.ros.cockpit.hearing import Hearing
from drone_sim.ros.cockpit.panel.panel import Panel
from drone_sim.ros.cockpit.panel.scenes import Scenes
from drone_sim.ros.cockpit.panel.windows import Windows
from drone_sim.ros.cockpit.scene.choice import Choice
from drone_sim.ros.cockpit.scene.scene_view import SceneView
from drone_sim.ros.cockpit.scene.sight import Sight
from drone_sim.ros.cockpit.scene.sunlight import Sunlight
from drone_sim.ros.cockpit.scripts.editing import Editing
from drone_sim.ros.cockpit.scripts.happenings import Happenings
from drone_sim.ros.cockpit.scripts.lessons import Lessons
from drone_sim.ros.cockpit.scripts.shelf import Shelf
from drone_sim.ros.cockpit.server.wire import Wire
from drone_sim.ros.cockpit.serving import Serving
from drone_sim.ros.cockpit.settings import Settings
from drone_sim.ros.cockpit.simulator import FAILURES, Simulator
from drone_sim.ros.node.master_watch import MasterWatch
from drone_sim.ros.vehicle import frame_names

_WIDTH = 270  # pixels of the panel
_HORIZON, _ZENITH = (209, 217, 224), (118, 160, 205)
_PERIOD = 0.05  # s between two looks: 20 a second
_ASKING = 2.0  # s between two questions to the master


class Cockpit:
    """One page for one simulation. While no browser is open, it listens to nothing."""

    def __init__(self, settings: Settings, serving: Serving):
        """Fill what is served."""
        self._simulator = Simulator(settings.simulator)
        self._found = Found()
        self._view: SceneView | None = None
        self._hearing: Hearing | None = None
        self._asked, self._has_master = 0.0, True
        self._commanding = Commanding()
        self._sight, self._choice = Sight(), Choice()
        flying = Flying(self._commanding.send)
        shelf, lessons = Shelf(settings.scripts), Lessons()
        editing = Editing(shelf, lessons, self._simulator, Happenings(self._simulator.node))
        self._wire = Wire(flying, {**editing.answers, "let go": self._let_go, "spare": self._spare})
        self._server = serving.server
        self._server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._server.scene.set_up_direction("+z")
        self._server.scene.set_background_image(_sky())
        self._sun = Sunlight(self._server.scene)
        panel = self._server.gui.main_panel
        panel.dock_right()
        panel.set_width(_WIDTH)
        scenes = Scenes(settings.scripts)
        self._panel = Panel(
            self._server.gui, self._simulator, self._commanding, scenes, self._sight, self._choice, self._wire
        )
        self._windows = Windows(self._simulator.node, self._panel.cameras, self._wire)
        self._wire.answer_also(self._windows.answers)
        serving.begin(self._wire.serve, lessons.picture)
        threading.Thread(target=flying.watch, args=(lambda: not rospy.is_shutdown(),), daemon=True).start()

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
        wanted = self._found.namespace if clients else ""
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
        vehicle = self._commanding.vehicle
        prefix = frame_names.prefix(vehicle, is_alone=self._found.namespace.strip("/") == vehicle)
        self._panel.offer_sights(self._sight.choices(self._view.frames, prefix))
        if not (self._view.handles.held or self._view.objects.held):  # or the eyes would run after the mouse
            self._sight.follow(clients.values(), self._view.frames, prefix)
        for one in (self._panel.plots, self._panel.tuning):
            one.follow(vehicle)
            one.show()
        self._panel.sensor.show()
        self._panel.cameras.show()

    def _open(self, namespace: str) -> None:
        """Show another simulation, '' for none."""
        for one in (self._view, self._hearing):
            if one is not None:
                one.close()
        self._view = SceneView(self._server.scene, namespace, self._sun, self._choice) if namespace else None
        self._hearing = Hearing(self._simulator.node, self._panel, self._wire) if namespace else None
        self._panel.cameras.rest(not namespace)
        self._windows.listen(bool(namespace))
        if not namespace:
            self._panel.plots.follow("")
            self._panel.sensor.show(listening=False)
            self._panel.tuning.follow("")

    def _let_go(self, _message: Mapping[str, Any]) -> Mapping[str, Any]:
        self._choice.name = ""
        return {}

    def _spare(self, _message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Do without what is too much for a browser that paints without a GPU."""
        self._panel.shadows.value = False
        return {}

    def _ask_master(self) -> None:
        try:
            below = rospy.get_namespace()  # another simulator may fly in another one
            self._found = find([one for one in rospy.get_published_topics() if one[0].startswith(below)])
            scene = str(self._simulator.parameter("scene_file", ""))
            self._tell_of_master(True)
        except FAILURES:  # another master may come
            self._found, scene = Found(), ""
            self._tell_of_master(False)
        if not self._found.namespace:
            self._panel.show_state("no simulation")
        self._panel.offer(self._found, scene)

    def _tell_of_master(self, answers: bool) -> None:
        if answers != self._has_master:
            self._has_master = answers
            self._panel.say("the ROS master is there again" if answers else "no ROS master answers: waiting for one")


def _is_not_repeated(record: logging.LogRecord) -> bool:
    """Leave out what rospy says of each single topic when there is no master: `MasterWatch` says it once."""
    return "registrations are now out of sync" not in str(record.msg)


def _sky() -> np.ndarray:
    """Return a column of the sky, paler towards the horizon."""
    height = np.linspace(1.0, 0.0, 64)[:, None, None]
    return np.asarray(_HORIZON + height * (np.array(_ZENITH) - _HORIZON), dtype=np.uint8)
