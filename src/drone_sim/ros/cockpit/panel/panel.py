"""The panel beside the scene: toolbar, view, cameras, what is said. viser draws it, the same in every browser."""

from __future__ import annotations

from typing import Any

from drone_sim.ros.cockpit.flying.commanding import REQUESTS, Commanding
from drone_sim.ros.cockpit.found import Found
from drone_sim.ros.cockpit.panel.cameras import Cameras
from drone_sim.ros.cockpit.panel.pace import Pace
from drone_sim.ros.cockpit.panel.plots import Plots
from drone_sim.ros.cockpit.panel.scenes import Scenes
from drone_sim.ros.cockpit.panel.sensor_plot import SensorPlot
from drone_sim.ros.cockpit.panel.tuning import Tuning
from drone_sim.ros.cockpit.panel.words import Words
from drone_sim.ros.cockpit.scene import sight
from drone_sim.ros.cockpit.scene.choice import Choice
from drone_sim.ros.cockpit.server.wire import Wire
from drone_sim.ros.cockpit.simulator import FAILURES, Simulator

_LINES = 50  # of the log that are shown


class Panel:
    """Buttons that call the simulation's services, and what it says."""

    def __init__(
        self,
        gui: Any,
        simulator: Simulator,
        commanding: Commanding,
        scenes: Scenes,
        eyes: sight.Sight,
        choice: Choice,
        wire: Wire,
    ):
        """Draw it; `wire` takes pictures to the browsers."""
        self._gui = gui
        self._simulator = simulator
        self._commanding = commanding
        self._scenes = scenes
        self._choice = choice
        self._lines: list[str] = []
        gui.set_panel_label("drone_sim")
        self._state = gui.add_text("State", "no simulation", disabled=True)
        self._said = gui.add_text("Says", "", disabled=True, multiline=True)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Fly"):
            self._toolbar()
        with tabs.add_tab("View"):
            self._view(eyes)
        with tabs.add_tab("Cameras"):
            self.cameras = Cameras(gui, wire)
        with tabs.add_tab("Plots"):
            self.plots = Plots(gui)
            self.sensor = SensorPlot(gui)
        with tabs.add_tab("Tune"):
            self.tuning = Tuning(gui, self.say)
        with tabs.add_tab("Log"):
            self._diagnosis = Words(gui, "Diagnosis")
            self._log = Words(gui, "Log")

    def _toolbar(self) -> None:
        gui = self._gui
        run = gui.add_button_group("Run", ("start", "stop", "restart"))
        run.on_click(lambda event: self._call(event.target.value))
        stand = gui.add_button_group("Stand still", ("pause", "go on", "step"))
        stand.on_click(lambda event: self._stand(event.target.value))
        self.pace = Pace(gui, self._simulator.node, self.say)
        keep = gui.add_button_group("Remember", ("snapshot", "restore"))
        keep.on_click(lambda event: self._call(event.target.value))
        self._scene = gui.add_dropdown("Scene", ("",))
        self._scene.on_update(lambda event: self._load(event))
        self._vehicles = gui.add_dropdown("Vehicle", ("",))
        self._vehicles.on_update(lambda event: self._commanding.choose(event.target.value))
        ask = gui.add_button_group("Flight", REQUESTS)
        ask.on_click(lambda event: self.say(self._commanding.request(event.target.value)))

    def _view(self, eyes: sight.Sight) -> None:
        gui = self._gui
        self._look = gui.add_dropdown("Look", (sight.BEHIND, sight.FREE), initial_value=eyes.choice)
        self._look.on_update(lambda event: setattr(eyes, "choice", event.target.value))
        self.axes = gui.add_checkbox("Frames", False)
        self.handles = gui.add_checkbox("Handles", True)
        self._objects = gui.add_dropdown("Drag", ("",))
        self._objects.on_update(lambda event: setattr(self._choice, "name", event.target.value))
        self.shadows = gui.add_checkbox("Shadows", True)
        self.strength = gui.add_slider("Push by a click, N", min=0.1, max=3.0, step=0.1, initial_value=0.5)

    def _stand(self, what: str) -> None:
        self._call("step") if what == "step" else self._call("pause", what == "pause")

    def _call(self, service: str, *request: Any) -> None:
        self.say(f"{service} ...")
        self._simulator.call_aside(
            service, *request, then=lambda done, said: self.say(f"{service}: {'' if done else 'failed: '}{said}")
        )

    def _load(self, event: Any) -> None:
        if event.client is None:  # the server itself has set it
            return
        try:
            self._simulator.set_parameter("scene_file", self._scenes.file(event.target.value))
        except FAILURES as error:
            self.say(f"load_scene: failed: {' '.join(str(error).split())}")
            return
        self._call("load_scene")

    # ---- what is said

    def say(self, line: str) -> None:
        """Show one line."""
        self._said.value = line

    def show_state(self, state: str) -> None:
        """Show what the simulation does."""
        if self._state.value != state:
            self._state.value = state

    def log(self, line: str) -> None:
        """Add a line to the log."""
        self._lines = [*self._lines[1 - _LINES :], line]
        self._log.show(self._lines)

    def diagnose(self, lines: list[str]) -> None:
        """Show what /diagnostics says."""
        self._diagnosis.show(lines)

    def offer_sights(self, choices: tuple[str, ...]) -> None:
        """Offer where to look from."""
        if tuple(self._look.options) != choices:
            self._look.options = choices

    def offer_objects(self, names: tuple[str, ...]) -> None:
        """Offer the objects of the scene, and show the one that is chosen."""
        choices = ("", *names)
        if self._choice.name not in choices:
            self._choice.name = ""
        if tuple(self._objects.options) != choices:
            self._objects.options = choices
        if self._objects.value != self._choice.name:
            self._objects.value = self._choice.name

    def offer(self, found: Found, scene: str) -> None:
        """Offer vehicles, cameras and scenes that there are; `scene` is the file of the one that is flown."""
        vehicles = found.vehicles or ("",)
        if tuple(self._vehicles.options) != vehicles:
            self._vehicles.options = vehicles
            self._commanding.choose(self._vehicles.value)
        scenes, name = self._scenes.offered(scene)
        if tuple(self._scene.options) != scenes:
            self._scene.options = scenes
        if self._scene.value != name:
            self._scene.value = name
        self.cameras.offer(found.cameras)
        self.sensor.offer(found.sensors)
