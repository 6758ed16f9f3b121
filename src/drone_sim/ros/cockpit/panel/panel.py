"""The panel beside the scene: toolbar, view, cameras, what is said. viser draws it, the same in every browser."""

from __future__ import annotations

import html
import time
from typing import Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure.msg import Config
from rosgraph_msgs.msg import Log
from std_msgs.msg import String

from drone_sim.ros.cockpit.editor.scene_files import SceneList
from drone_sim.ros.cockpit.panel.cameras import CameraSwitches
from drone_sim.ros.cockpit.panel.plots import SensorPlot, VehiclePlots, set_options
from drone_sim.ros.cockpit.panel.tuning import SpeedControl, VehicleTuning
from drone_sim.ros.cockpit.scene.frames import BEHIND, FREE, Viewpoint
from drone_sim.ros.cockpit.scene.handles import Selection
from drone_sim.ros.cockpit.server.page_socket import PageSocket
from drone_sim.ros.cockpit.teleop import REQUESTS, CommandPublisher
from drone_sim.ros.cockpit.topics import FoundTopics
from drone_sim.ros.core.simulator import FAILURES, Simulator, script_failure

_READ = 30.0  # s for which a message is shown
# As high with a message as without: the tabs stay where they are.
_MESSAGE = (
    # All tabs stand in one line, and what is dimmed can be read.
    "<style>[role=tab] {{padding: 0 7px !important; opacity: 1 !important}} "
    ":root {{--mantine-color-dimmed: #495057}}</style>"
    '<div role="status" style="height:34px;overflow:auto;margin:2px 10px;'
    'font-size:12px;line-height:17px;overflow-wrap:anywhere">{}</div>'
)
_LINES = 50  # that a log has
_LONGEST = 600  # characters of a line
_STYLE = "font:11px/1.45 ui-monospace,monospace;white-space:pre-wrap;overflow-wrap:anywhere;margin:4px 10px"
_AT_THE_END = "display:flex;flex-direction:column-reverse;max-height:300px;overflow:auto"  # until somebody scrolls
_LEVELS = {Log.WARN: "warning: ", Log.ERROR: "error: ", Log.FATAL: "error: "}


class Panel:
    """Buttons that call the simulation's services, and what it says."""

    def __init__(
        self,
        gui: Any,
        simulator: Simulator,
        commands: CommandPublisher,
        scenes: SceneList,
        viewpoint: Viewpoint,
        selection: Selection,
        socket: PageSocket,
    ):
        """Draw it into `gui`.

        Its buttons call `simulator` and send `commands`; it offers `scenes`, sets `viewpoint` and `selection`, and
        sends pictures through `socket`.
        """
        self._gui = gui
        self._simulator = simulator
        self._commands = commands
        self._scenes = scenes
        self._selection = selection
        gui.set_panel_label("drone_sim")
        self._status = gui.add_text("Status", "no simulation", disabled=True)
        self._message = gui.add_html("")
        self.say("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Fly"):
            self._toolbar()
        with tabs.add_tab("View"):
            self._view(viewpoint)
        with tabs.add_tab("Cameras"):
            self.cameras = CameraSwitches(gui, socket)
        with tabs.add_tab("Plots"):
            self.plots = VehiclePlots(gui)
            self.sensor = SensorPlot(gui)
        with tabs.add_tab("Tune"):
            self.tuning = VehicleTuning(gui, self.say)
        with tabs.add_tab("Log"):
            self.diagnosis = TextLog(gui, "Diagnosis")
            self.log = TextLog(gui, "Log")

    def _toolbar(self) -> None:
        gui = self._gui
        run = gui.add_button_group(
            "Simulation", ("start", "stop", "restart"), hint="Start the flight; end it, and put all back; both"
        )
        run.on_click(lambda event: self._call(event.target.value))
        pause = gui.add_button_group("Pause", ("pause", "resume", "step"), hint="A step is 0.05 s")
        pauses: dict[str, tuple[Any, ...]] = {"step": ("step",), "pause": ("pause", True), "resume": ("pause", False)}
        pause.on_click(lambda event: self._call(*pauses[event.target.value]))
        self.speed = SpeedControl(gui, self._simulator.node, self.say)
        snapshot = gui.add_button_group("Snapshot", ("snapshot", "restore"), hint="Remember this moment; go back to it")
        snapshot.on_click(lambda event: self._call(event.target.value))
        self._scene = gui.add_dropdown("Scene", ("",), hint="What stands around the drone; starts anew")
        self._scene.on_update(lambda event: self._load(event))
        self._vehicles = gui.add_dropdown("Vehicle", ("",), hint="The one that the keys fly")
        self._vehicles.on_update(lambda event: self._commands.choose(event.target.value))
        ask = gui.add_button_group("Flight", REQUESTS)
        ask.on_click(lambda event: self.say(self._commands.request(event.target.value)))

    def _view(self, viewpoint: Viewpoint) -> None:
        gui = self._gui
        self._look = gui.add_dropdown(
            "Look", (BEHIND, FREE), initial_value=viewpoint.choice, hint="Where one looks from; free: drag the scene"
        )
        self._look.on_update(lambda event: setattr(viewpoint, "choice", event.target.value))
        self.axes = gui.add_checkbox("Frames", False, hint="The axes of all frames: x red, y green, z blue")
        self.handles = gui.add_checkbox("Handles", True, hint="The arrows that drag drone and sphere")
        self._objects = gui.add_dropdown("Drag", ("",), hint="The object that gets arrows; so does a click on it")
        self._objects.on_update(lambda event: setattr(self._selection, "name", event.target.value))
        self.shadows = gui.add_checkbox("Shadows", True)
        self.strength = gui.add_slider("Push by a click, N", min=0.1, max=3.0, step=0.1, initial_value=0.5)

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
        """Show one line, for a while."""
        self._said_at = time.monotonic()
        self._message.content = _MESSAGE.format(html.escape(line))

    def clear_old_message(self) -> None:
        """Show what has been said no more when it has been read."""
        if self._said_at and time.monotonic() - self._said_at > _READ:
            self.say("")
            self._said_at = 0.0

    def show_status(self, status: str) -> None:
        """Show what the simulation does."""
        if self._status.value != status:
            self._status.value = status

    def offer_viewpoints(self, choices: tuple[str, ...]) -> None:
        """Offer where to look from."""
        set_options(self._look, choices)

    def offer_objects(self, names: tuple[str, ...]) -> None:
        """Offer the objects of the scene, and show the one that is chosen."""
        choices = ("", *names)
        if self._selection.name not in choices:
            self._selection.name = ""
        set_options(self._objects, choices)
        if self._objects.value != self._selection.name:
            self._objects.value = self._selection.name

    def offer(self, found: FoundTopics, scene: str) -> None:
        """Offer vehicles, cameras and scenes that there are; `scene` is the file of the one that is flown."""
        if set_options(self._vehicles, found.vehicles or ("",)):
            self._commands.choose(self._vehicles.value)
        scenes, name = self._scenes.offered(scene)
        set_options(self._scene, scenes)
        if self._scene.value != name:
            self._scene.value = name
        self.cameras.offer(found.cameras)
        self.sensor.offer(found.sensors)


class TextLog:
    """A heading, and lines below it, of whatever kind: they are text, never HTML."""

    def __init__(self, gui: Any, heading: str):
        """Draw `heading` into `gui`, without lines."""
        self._heading = heading
        self._lines: list[str] = []
        self._drawn = gui.add_html(self._html())

    def show(self, lines: list[str]) -> None:
        """Show these lines in the place of the last ones."""
        lines = [one[:_LONGEST] for one in lines]
        if lines != self._lines:
            self._lines = lines
            self._drawn.content = self._html()

    def add(self, line: str) -> None:
        """Show one more line; the oldest goes when there are many."""
        self.show([*self._lines[1 - _LINES :], line])

    def _html(self) -> str:
        heading, text = html.escape(self._heading), html.escape("\n".join(self._lines))
        body = f'<div style="{_AT_THE_END}"><pre style="{_STYLE}">{text}</pre></div>'
        return f'<div style="margin:6px 10px;font-size:12px;font-weight:600">{heading}</div>{body}'


class SimulatorListener:
    """Listens to one node, and shows what it says."""

    def __init__(self, node: str, panel: Panel, socket: PageSocket):
        """Listen to `node`; show it on `panel`, and send a script's failure through `socket`."""
        self._node = node
        self._panel, self._socket = panel, socket
        heard = (
            ("/rosout_agg", Log, self._on_log),
            ("/diagnostics", DiagnosticArray, self._on_diagnostics),
            (f"{node}/state", String, lambda message: panel.show_status(message.data)),
            (f"{node}/parameter_updates", Config, panel.speed.show_set),
        )
        self._listening = [rospy.Subscriber(*one, queue_size=20) for one in heard]

    def close(self) -> None:
        """Listen no more."""
        for one in self._listening:
            one.unregister()

    def _on_log(self, message: Any) -> None:
        if message.name != self._node:
            return
        line = f"{_LEVELS.get(message.level, '')}{message.msg}"
        self._panel.log.add(line)
        self._socket.tell({"log": line})
        failure = script_failure(message.msg) if message.level >= Log.ERROR else None
        if failure is not None:
            self._socket.tell({"failure": failure._asdict()})

    def _on_diagnostics(self, message: Any) -> None:
        own = f"{self._node.strip('/')}: "
        found = {one.name.removeprefix(own): one for one in message.status if one.name.startswith(own)}
        if not found:  # another node's
            return
        wrong = [f"{name}: {one.message}" for name, one in found.items() if one.level != DiagnosticStatus.OK]
        fine = [f"{name}: {one.message}" for name, one in found.items() if one.level == DiagnosticStatus.OK]
        self._panel.diagnosis.show([*(wrong or ["nothing is wrong"]), "", *fine])
        values = {one.key: one.value for one in found["simulation"].values} if "simulation" in found else {}
        self._panel.speed.show_actual(values.get("real-time factor", ""))
