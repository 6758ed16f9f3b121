"""The simulator's node during a graded flight: whether it fits the plan, its start and stop, and the files for it."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import rosgraph
import rospy
from dynamic_reconfigure.encoding import decode_config
from dynamic_reconfigure.msg import Config
from rosgraph_msgs.msg import Log
from std_msgs.msg import String

from drone_sim.files import writing
from drone_sim.files.resources import cache_path
from drone_sim.files.yaml_writing import dump
from drone_sim.grading.plan import Plan
from drone_sim.message_text import shown
from drone_sim.ros.core.launch_parameters import parameters_of, use_sim_time
from drone_sim.ros.core.simulator import Simulator
from drone_sim.run.parameters import Parameters

_POLL_INTERVAL = 0.05  # s of real time
_MAX_DIFFERENCES = 3  # in a message
# Parameters that a plan does not set, or that are set in another way.
_IGNORED = (
    *("profile", "config", "gui", "script", "script_time_limit", "real_time_factor", "remote_api", "scene_file"),
    *("samples", "lockstep", "step_count", "timeline_file"),
)
_STOPPED = "stopped"
_SCRIPT_ERROR = "script error: "
_TIMELINE = re.compile(r"; timeline (\w+)$")  # at the end of the answer of a start


class Mismatch(ValueError):
    """The plan cannot be graded on this simulator; one line says why."""


class GradedSimulator(Simulator):
    """The node of `drone.launch` or `fleet.launch` on which a plan is graded."""

    def __init__(self, name: str, patience: float):
        """Wait for the node with a name, at most `patience` s of real time. Raises Mismatch."""
        super().__init__(f"/{name.strip('/')}")
        self._patience = patience
        service = f"{self.node}/pause"
        self.wait(lambda: lookup("lookupService", service), f"no simulator {self.node}: start drone.launch")
        self.state = ""
        self.starts = 0  # since the last call of `start`, by anybody
        self.error = ""
        self._subscribers = [
            rospy.Subscriber(f"{self.node}/state", String, self._on_state),
            rospy.Subscriber("/rosout", Log, self._on_log),
        ]

    def wait(self, condition: Callable[[], Any], message: str) -> None:
        """Wait until a condition is true. Raises Mismatch with `message` after too long a time."""
        end = time.monotonic() + self._patience
        while not condition():
            if rospy.is_shutdown() or time.monotonic() > end:
                raise Mismatch(f"{message} (waited for {self._patience:g} s)")
            time.sleep(_POLL_INTERVAL)

    def fit(self, plan: Plan) -> Parameters:
        """Return the simulator's parameters in the plan's scene. Raises Mismatch if they differ from the plan's."""
        if not use_sim_time():
            raise Mismatch("grading needs simulated time: start the simulator with use_sim_time:=true")
        wanted = plan.parameters()
        running = parameters_of(self.node, scene_file=wanted.scene_file)
        if [*running.vehicles] == [*wanted.vehicles] == [wanted.drone.name]:
            # The vehicle's start pose is that of the scene in which the simulator flies now; the plan's may differ.
            running = parameters_of(self.node, scene_file=wanted.scene_file, vehicles=0)
        if plan.lockstep and not running.lockstep.wait_for:
            raise Mismatch("the plan says lockstep: true: start the simulator with lockstep:=cmd_vel")
        if plan.timeline and not plan.lockstep and not self._real_time_factor():
            raise Mismatch("real_time_factor = 0: the timeline's messages would be late; 1 to 5 works well")
        differences = list(_differences(wanted.model_dump(), running.model_dump(), ()))
        if differences:
            more = f", and {len(differences) - _MAX_DIFFERENCES} more" if len(differences) > _MAX_DIFFERENCES else ""
            first = "; ".join(differences[:_MAX_DIFFERENCES])
            raise Mismatch(f"the simulator flies with other parameters than the plan: {first}{more}; see its config:=")
        return running

    def check_seed(self, wanted: Parameters, scene_file: str) -> None:
        """Raise Mismatch if a scene file does not result in the start conditions of a flight."""
        running = parameters_of(self.node, scene_file=scene_file, vehicles=0)
        for difference in _differences(_start_conditions(wanted), _start_conditions(running), ()):
            raise Mismatch(f"the simulator cannot fly this seed of the plan: {difference}")

    def _real_time_factor(self) -> float:
        """Return the current real-time factor, which may differ from the start parameters. Raises Mismatch."""
        try:
            message = rospy.wait_for_message(f"{self.node}/parameter_updates", Config, self._patience)
        except rospy.ROSException:
            raise Mismatch(f"no simulator {self.node} publishes its real_time_factor") from None
        return float(decode_config(message)["real_time_factor"])

    def start(self, scene: str, timeline: str = "", digest: str = "") -> None:
        """Restart the simulation in a scene file, '' for the scene of the parameters. Raises Mismatch.

        The simulator itself executes the entries of the file `timeline`, whose Timeline.digest must be `digest`.
        """
        self.error, self.starts = "", 0
        files = {"scene_file": scene, "timeline_file": timeline}
        old_files = {name: self.parameter(name) for name in files}
        for name, file in files.items():
            self.set_parameter(name, file)
        try:
            answer = self._call("load_scene")
        finally:
            for name, old_file in old_files.items():
                self.set_parameter(name, old_file)
        found = _TIMELINE.search(answer)
        if (found[1] if found else "") != digest:
            raise Mismatch(f"{self.node} executes another timeline than the plan's: somebody has replaced it")

    def stop(self) -> None:
        """Stop the simulation, which runs the script's cleanup. Raises Mismatch."""
        self._call("stop")

    def _call(self, service: str) -> str:
        """Return the answer of a service. Raises Mismatch if it did not succeed."""
        success, message = self.call(service)
        if not success:
            raise Mismatch(f"{self.node}/{service}: {message}")
        return message

    def _on_state(self, message: String) -> None:
        self.starts += self.state == _STOPPED and message.data != _STOPPED
        self.state = message.data

    def _on_log(self, message: Log) -> None:
        if message.name == self.node and message.msg.startswith(_SCRIPT_ERROR):
            self.error = self.error or message.msg.removeprefix(_SCRIPT_ERROR)


def _start_conditions(parameters: Parameters) -> dict[str, Any]:
    """Return the parameters that a seed may change."""
    vehicles = {vehicle.name: vehicle.model_dump() for vehicle in parameters.fleet}
    return {**parameters.model_dump(include={"scene", "weather"}), "vehicles": vehicles}


def lookup(call: str, name: str) -> str:
    """Return the URI of a service ("lookupService") or a node ("lookupNode"), '' if the master knows none."""
    try:
        return str(getattr(rosgraph.Master(rospy.get_name()), call)(name))
    except (rosgraph.MasterError, OSError):
        return ""


def _differences(wanted: Any, running: Any, above: tuple[str, ...]) -> Iterator[str]:
    """Yield a line for each key in which two parameter trees differ, with both values."""
    if isinstance(wanted, Mapping) and isinstance(running, Mapping):
        for key in sorted({*wanted, *running}, key=str):
            if key not in _IGNORED or (above and above[0] != "vehicles"):
                yield from _differences(wanted.get(key), running.get(key), (*above, str(key)))
    elif wanted != running:
        yield f"{'/'.join(above)} = {shown(running)}, the plan's is {shown(wanted)}"


# ---- files for the simulator


def scene_file(plan: Plan, seed: int) -> str:
    """Return a scene file with the start conditions of a seed; for seed 0 the plan's own. Raises OSError."""
    if not seed:
        return plan.parameters().scene_file
    parameters = plan.parameters(seed)
    values = parameters.model_dump(
        mode="json", include={"scene", "weather", "physics", "time_step", "sub_step", "gravity"}
    )
    own = parameters.in_scene_file.get("vehicles") or {}  # a vehicle with a script of its own keeps it
    vehicles = {
        vehicle.name: {
            **vehicle.model_dump(mode="json", exclude={"name", "script"}),
            **{key: value for key, value in own.get(vehicle.name, {}).items() if key == "script"},
        }
        for vehicle in parameters.fleet
    }
    content = {**values.pop("scene"), **values, "vehicles": vehicles}
    return _write(f"{plan.name}-{seed}.yaml", content)


def timeline_file(plan: Plan) -> str:
    """Return a file with the timeline of a plan, '' if it has none. Raises OSError."""
    return _write(f"{plan.name}-timeline.yaml", plan.timeline) if plan.timeline else ""


def _write(name: str, content: Any) -> str:
    folder = cache_path() / "grading" / "seeds"
    folder.mkdir(parents=True, exist_ok=True)
    path = Path(folder, name)  # is not removed, because the simulator may be restarted with it
    writing.write(path, dump(content))
    return str(path)
