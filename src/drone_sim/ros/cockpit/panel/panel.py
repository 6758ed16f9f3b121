"""Replies to the page's buttons and lists, and the simulator's state and heartbeat, which are sent to the page."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure.msg import Config
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool, String

from drone_sim.ros.cockpit.editor.lists import SceneList
from drone_sim.ros.cockpit.panel.board import NO_SIMULATION, Board, one_of
from drone_sim.ros.cockpit.panel.plots import Plots
from drone_sim.ros.cockpit.panel.tuning import SpeedControl, VehicleTuning
from drone_sim.ros.cockpit.server.page_socket import Answer
from drone_sim.ros.cockpit.teleop import REQUESTS, CommandPublisher
from drone_sim.ros.cockpit.topics import FoundTopics
from drone_sim.ros.core import network
from drone_sim.ros.core.simulator import FAILURES, Simulator, script_failure

_LEVELS = {Log.WARN: "warning: ", Log.ERROR: "error: ", Log.FATAL: "error: "}
_CALLS: dict[str, tuple[Any, ...]] = {
    **{service: (service,) for service in ("start", "stop", "restart", "step", "snapshot", "restore")},
    "pause": ("pause", True),
    "resume": ("pause", False),
}
_PULSE_PERIOD = 1.0  # s
_SILENCE_LIMIT = 5.0  # s; while the simulator is busy, it publishes /diagnostics every 3 s only
_TIMEOUT = 0.5  # s, for the reply of the master and of the node


class Panel:
    """Replies to requests of the page's toolbar and panels, and puts the simulator's state on the board."""

    def __init__(
        self, simulator: Simulator, commands: CommandPublisher, scenes: SceneList, tell: Callable[[Any], None]
    ):
        """`simulator` is called, `commands` sends commands, `scenes` lists scenes; `tell` sends to all browsers."""
        self._simulator, self._commands, self._scenes, self._tell = simulator, commands, scenes, tell
        self.pulse = Pulse(simulator.node, tell)
        self.board = Board(tell)
        self.plots = Plots(self.board)
        self.tuning = VehicleTuning(self.board)
        self.speed = SpeedControl(self.board, simulator.node)
        self._subscribers: list[rospy.Subscriber] = []  # to the simulator
        self._flight: list[rospy.Subscriber] = []  # to the followed vehicle
        self._followed = ""
        self.board.show("status", NO_SIMULATION)

    @property
    def answers(self) -> dict[str, Answer]:
        return {
            "panel": self.board.whole,
            "call": self._call,
            "request": lambda message: {"said": self._commands.request(one_of(message, "request", REQUESTS))},
            "speed": self.speed.set,
            "scene": self._load,
            "vehicle": self._choose,
            "tune": self.tuning.set,
            "plots": self.plots.answer,
        }

    def _call(self, message: Mapping[str, Any]) -> dict[str, Any]:
        done, said = self._simulator.call(*_CALLS[one_of(message, "call", list(_CALLS))])
        return {"done": done, "said": said}

    def _load(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Load another scene, which restarts the simulation. Raises ValueError."""
        now = self.board.get("scenes", {}).get("now", "")
        name = one_of(message, "scene", self._scenes.names(now)[0])
        try:
            self._simulator.set_parameter("scene_file", self._scenes.file(name))
        except FAILURES as error:
            raise ValueError(f"scene = {name}: {' '.join(str(error).split())}") from None
        done, said = self._simulator.call("load_scene")
        self._show_scenes(self._scenes.file(name))
        return {"done": done, "said": said}

    def _choose(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send the keys' commands to another vehicle. Raises ValueError."""
        vehicles = self.board.get("vehicles", {}).get("all", [])
        self._commands.choose(one_of(message, "vehicle", vehicles))
        self._show_vehicles(vehicles)
        return {"said": f"the keys fly {self._commands.vehicle}"}

    # ---- contents of the board

    def offer(self, found: FoundTopics, scene: str) -> None:
        """Show the available vehicles and scenes; `scene` is the value of the simulator's parameter."""
        if self._commands.vehicle not in found.vehicles:
            self._commands.choose(found.vehicles[0] if found.vehicles else "")
        self._show_vehicles(list(found.vehicles))
        self._show_scenes(scene)
        self.plots.offer(found.sensors)

    def _show_vehicles(self, vehicles: list[str]) -> None:
        self.board.show("vehicles", {"all": vehicles, "now": self._commands.vehicle})

    def _show_scenes(self, scene: str) -> None:
        scenes, now = self._scenes.names(scene)
        self.board.show("scenes", {"all": list(scenes), "now": now})

    def follow(self, vehicle: str) -> None:
        """Show the state of a vehicle, '' for none."""
        self.plots.follow(vehicle)
        self.tuning.follow(vehicle)
        if vehicle == self._followed:
            return
        self._followed = vehicle
        for subscriber in self._flight:
            subscriber.unregister()
        self.board.show("flight", "")
        self.board.show("hears_commands", True)  # until the simulator publishes otherwise
        self._flight = []
        if vehicle:
            show = self.board.show
            self._flight = [
                rospy.Subscriber(f"/{vehicle}/state", String, lambda message: show("flight", message.data[:80])),
                rospy.Subscriber(
                    f"/{vehicle}/hears_commands", Bool, lambda message: show("hears_commands", message.data)
                ),
            ]

    # ---- the simulator

    def listen(self, on: bool) -> None:
        """Subscribe to the simulator's state, log, diagnosis, signals and parameters, or unsubscribe."""
        self.pulse.expect(on)
        for subscriber in self._subscribers:
            subscriber.unregister()
        node = self._simulator.node
        subscriptions = (
            ("/rosout_agg", Log, self._on_log),
            ("/diagnostics", DiagnosticArray, self._on_diagnostics),
            (f"{node}/state", String, self._on_state),
            (f"{node}/signals", String, self.plots.on_signals),
            (f"{node}/parameter_updates", Config, self.speed.on_set),
        )
        self._subscribers = [rospy.Subscriber(*each, queue_size=20) for each in subscriptions] if on else []

    def _on_state(self, message: Any) -> None:
        self.pulse.hear()
        self.board.show("status", message.data)

    def _on_log(self, message: Any) -> None:
        if message.name != self._simulator.node:
            return
        self.pulse.hear()
        self.board.log(f"{_LEVELS.get(message.level, '')}{message.msg}")
        failure = script_failure(message.msg) if message.level >= Log.ERROR else None
        if failure is not None:
            self._tell({"failure": failure._asdict()})

    def _on_diagnostics(self, message: Any) -> None:
        own = f"{self._simulator.node.strip('/')}: "
        statuses = {each.name.removeprefix(own): each for each in message.status if each.name.startswith(own)}
        if not statuses:  # another node's
            return
        self.pulse.hear()
        lines = [
            {"of": name, "said": status.message, "wrong": status.level != DiagnosticStatus.OK}
            for name, status in statuses.items()
        ]
        self.board.show("diagnosis", sorted(lines, key=lambda line: not line["wrong"]))
        values = statuses["simulation"].values if "simulation" in statuses else []
        self.board.show("pace", next((each.value for each in values if each.key == "real-time factor"), ""))


class Pulse(threading.Thread):
    """Heartbeat: once a second, it sends {"pulse": {"silent", "frozen", "ended"}} to every browser.

    It is a daemon thread, so that a slow master does not delay it.
    """

    def __init__(self, node: str, tell: Callable[[Mapping[str, Any]], None]):
        """Watch the simulator `node`; `tell` sends a message to all browsers."""
        super().__init__(name="pulse", daemon=True)
        self._node, self._tell = node, tell
        self._heard: float | None = None  # s, monotonic; None while nothing is expected from the simulator

    def expect(self, is_there: bool) -> None:
        """Begin to expect messages from the simulator, or stop."""
        self._heard = time.monotonic() if is_there else None

    def hear(self) -> None:
        """Note that the simulator has published something. Any thread may call it."""
        if self._heard is not None:
            self._heard = time.monotonic()

    def run(self) -> None:
        """Send the heartbeat until the process ends."""
        while True:
            time.sleep(_PULSE_PERIOD)
            self._tell({"pulse": self.state()})

    def state(self) -> dict[str, Any]:
        """Return for how long the simulator has been silent (s), whether that is too long, and whether it has ended."""
        heard = self._heard
        silent = 0.0 if heard is None else time.monotonic() - heard
        is_frozen = silent > _SILENCE_LIMIT
        return {"silent": round(silent, 1), "frozen": is_frozen, "ended": is_frozen and has_ended(self._node)}


def has_ended(node: str) -> bool:
    """Return whether the process of a node has ended; the master still lists a node that was killed."""
    try:
        uri = network.call(rosgraph.get_master_uri(), "lookupNode", node, timeout=_TIMEOUT)
    except ValueError:  # the master does not know it
        return True
    except network.FAILURES:
        return False
    try:
        network.call(uri, "getPid", timeout=_TIMEOUT)
    except ConnectionRefusedError:
        return True
    except network.FAILURES:  # the process is stopped, or the network is slow
        return False
    return False
