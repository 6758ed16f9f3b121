"""The running simulator: there or not, as the plan wants it or not, started and stopped."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import rosgraph
import rospy
from dynamic_reconfigure.encoding import decode_config
from dynamic_reconfigure.msg import Config
from rosgraph_msgs.msg import Log
from std_msgs.msg import String

from drone_sim.grading.plan import Plan
from drone_sim.message_text import shown
from drone_sim.ros.core.launch_parameters import parameters_of, use_sim_time
from drone_sim.ros.core.simulator import Simulator
from drone_sim.run.parameters import Parameters

_LOOK = 0.05  # s of real time, between two looks
_MOST = 3  # differences in a message
# What a plan says nothing of, or what is brought about by other means.
_OTHER = (
    *("config", "gui", "script", "script_time_limit", "real_time_factor", "remote_api", "scene_file", "samples"),
    *("lockstep", "step_count", "timeline_file"),
)
_SCRIPT_ERROR = "script error: "


class Mismatch(ValueError):
    """The plan cannot be graded on this simulator; one line."""


class GradedSimulator(Simulator):
    """A node of `drone.launch` or `fleet.launch`, by its name."""

    def __init__(self, name: str, patience: float):
        """Wait for the node of that name, for `patience` s of real time at most. Raises Mismatch."""
        super().__init__(f"/{name.strip('/')}")
        self._patience = patience
        self.wait(
            lambda: lookup("lookupService", f"{self.node}/pause"), f"no simulator {self.node}: start drone.launch"
        )
        self.state = ""
        self.error = ""
        self._subscribers = [
            rospy.Subscriber(f"{self.node}/state", String, self._on_state),
            rospy.Subscriber("/rosout", Log, self._on_log),
        ]

    def wait(self, condition: Callable[[], Any], otherwise: str) -> None:
        """Wait until something is so. Raises Mismatch with what is said `otherwise`."""
        end = time.monotonic() + self._patience
        while not condition():
            if rospy.is_shutdown() or time.monotonic() > end:
                raise Mismatch(f"{otherwise} (waited for {self._patience:g} s)")
            time.sleep(_LOOK)

    def fit(self, plan: Plan) -> Parameters:
        """Return the parameters it will fly with in the plan's scene. Raises Mismatch if the plan has others."""
        if not use_sim_time():
            raise Mismatch("grading goes by simulated time: start the simulator with use_sim_time:=true")
        wanted = plan.parameters()
        running = parameters_of(self.node, scene_file=wanted.scene_file)
        if [*running.vehicles] == [*wanted.vehicles] == [wanted.drone.name]:
            # Who flies is told there, with its place in the scene that is flown in now: the plan's may have another.
            running = parameters_of(self.node, scene_file=wanted.scene_file, vehicles=0)
        if plan.lockstep and not running.lockstep.wait_for:
            raise Mismatch("the plan says lockstep: true: start the simulator with lockstep:=cmd_vel")
        if plan.timeline and not plan.lockstep and not self._factor():
            raise Mismatch("real_time_factor = 0: without a pace, a timeline by topics is too late; 1 to 5 works well")
        found = [one for one in _differences(wanted.model_dump(), running.model_dump(), ()) if one]
        if found:
            more = f", and {len(found) - _MOST} more" if len(found) > _MOST else ""
            told = "; ".join(found[:_MOST])
            raise Mismatch(f"the simulator flies with other parameters than the plan: {told}{more}; see its config:=")
        return running

    def check_seed(self, wanted: Parameters, scene_file: str) -> None:
        """Raise Mismatch if a scene file would not give the start conditions that the flight needs."""
        there = parameters_of(self.node, scene_file=scene_file, vehicles=0)
        for found in _differences(_beginning(wanted), _beginning(there), ()):
            raise Mismatch(f"the simulator cannot fly this seed of the plan: {found}")

    def _factor(self) -> float:
        """Return the real-time factor in force, which the parameters of its start do not know. Raises Mismatch."""
        try:
            message = rospy.wait_for_message(f"{self.node}/parameter_updates", Config, self._patience)
        except rospy.ROSException:
            raise Mismatch(f"no simulator {self.node} publishes its real_time_factor") from None
        return float(decode_config(message)["real_time_factor"])

    def start(self, scene: str, timeline: str = "") -> None:
        """Start anew, in the scene of a file, '' for that of the parameters. Raises Mismatch.

        The simulator itself executes the entries in the file `timeline`.
        """
        self.error = ""
        files = {"scene_file": scene, "timeline_file": timeline}
        before = {name: self.parameter(name, "") for name in files}
        for name, file in files.items():
            self.set_parameter(name, file)
        try:
            self._call("load_scene")
        finally:
            for name, file in before.items():
                self.set_parameter(name, file)

    def stop(self) -> None:
        """Stop, which runs the script's cleanup. Raises Mismatch."""
        self._call("stop")

    def _call(self, service: str) -> None:
        done, said = self.call(service)
        if not done:
            raise Mismatch(f"{self.node}/{service}: {said}")

    def _on_state(self, message: String) -> None:
        self.state = message.data

    def _on_log(self, message: Log) -> None:
        if message.name == self.node and message.msg.startswith(_SCRIPT_ERROR):
            self.error = self.error or message.msg.removeprefix(_SCRIPT_ERROR)


def _beginning(parameters: Parameters) -> dict[str, Any]:
    """Return what a seed may change."""
    vehicles = {one.name: one.model_dump() for one in parameters.fleet}
    return {**parameters.model_dump(include={"scene", "weather"}), "vehicles": vehicles}


def lookup(call: str, name: str) -> str:
    """Return where a service is ("lookupService"), or a node ("lookupNode"); '' where the master knows none."""
    try:
        return str(getattr(rosgraph.Master(rospy.get_name()), call)(name))
    except (rosgraph.MasterError, OSError):
        return ""


def _differences(wanted: Any, there: Any, above: tuple[str, ...]) -> Iterator[str]:
    """Yield the keys in which two parameter trees differ, with both values."""
    if isinstance(wanted, Mapping) and isinstance(there, Mapping):
        for key in sorted({*wanted, *there}, key=str):
            if key not in _OTHER or (above and above[0] != "vehicles"):
                yield from _differences(wanted.get(key), there.get(key), (*above, str(key)))
    elif wanted != there:
        yield f"{'/'.join(above)} = {shown(there)}, the plan's is {shown(wanted)}"
