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
from std_srvs.srv import Trigger

from drone_sim.grading.plan import Plan
from drone_sim.ros.node.given import parameters_of, use_sim_time
from drone_sim.run.parameters import Parameters
from drone_sim.wording import shown

_LOOK = 0.05  # s of real time, between two looks
_MOST = 3  # differences in a message
# What a plan says nothing of, or what is brought about by other means.
_OTHER = ("config", "gui", "script", "script_time_limit", "real_time_factor", "remote_api", "scene_file", "samples")
_SCRIPT_ERROR = "script error: "


class Unfit(ValueError):
    """The plan cannot be graded on this simulator; one line."""


class Simulator:
    """A node of `drone.launch` or `fleet.launch`, by its name."""

    def __init__(self, name: str, patience: float):
        """Wait for it, for `patience` s of real time at most. Raises Unfit."""
        self.name = rospy.resolve_name(f"/{name.strip('/')}")
        self._patience = patience
        self.wait(lambda: _is_advertised(f"{self.name}/pause"), f"no simulator {self.name}: start drone.launch")
        self.state = ""
        self.error = ""
        self._subscribers = [
            rospy.Subscriber(f"{self.name}/state", String, self._hear_state),
            rospy.Subscriber("/rosout", Log, self._hear_log),
        ]

    def wait(self, condition: Callable[[], bool], otherwise: str) -> None:
        """Wait until something is so. Raises Unfit with what is said `otherwise`."""
        end = time.monotonic() + self._patience
        while not condition():
            if rospy.is_shutdown() or time.monotonic() > end:
                raise Unfit(f"{otherwise} (waited for {self._patience:g} s)")
            time.sleep(_LOOK)

    def fit(self, plan: Plan) -> Parameters:
        """Return what it will fly with in the plan's scene. Raises Unfit where that is not what the plan says."""
        if not use_sim_time():
            raise Unfit("grading goes by simulated time: start the simulator with use_sim_time:=true")
        wanted = plan.parameters()
        running = parameters_of(self.name, scene_file=wanted.scene_file)
        if list(running.vehicles) == [wanted.drone.name] and not wanted.vehicles:
            # Who flies is told there, with its place in the scene that is flown in now: the plan's may have another.
            running = parameters_of(self.name, scene_file=wanted.scene_file, vehicles=0)
        if plan.timeline and not self._factor():
            raise Unfit("real_time_factor = 0: a timeline by topics comes too late without a pace; 1 to 5 is well")
        found = [one for one in _differences(wanted.model_dump(), running.model_dump(), ()) if one]
        if found:
            more = f", and {len(found) - _MOST} more" if len(found) > _MOST else ""
            told = "; ".join(found[:_MOST])
            raise Unfit(f"the simulator flies with other parameters than the plan: {told}{more}; see its config:=")
        return running

    def _factor(self) -> float:
        """Return the real-time factor in force, which the parameters of its start do not know. Raises Unfit."""
        try:
            message = rospy.wait_for_message(f"{self.name}/parameter_updates", Config, self._patience)
        except rospy.ROSException:
            raise Unfit(f"no simulator {self.name} says at what real_time_factor it goes") from None
        return float(decode_config(message)["real_time_factor"])

    def start(self, scene: str) -> None:
        """Start anew, in the scene of a file, '' for that of the parameters. Raises Unfit."""
        self.error = ""
        key = f"{self.name}/scene_file"
        before = rospy.get_param(key, "")
        rospy.set_param(key, scene)
        try:
            self._call("load_scene")
        finally:
            rospy.set_param(key, before)

    def stop(self) -> None:
        """Stop, which runs the script's cleanup. Raises Unfit."""
        self._call("stop")

    def _call(self, service: str) -> None:
        try:
            answer = rospy.ServiceProxy(f"{self.name}/{service}", Trigger)()
        except rospy.ServiceException as error:
            raise Unfit(f"{self.name}/{service}: {error}") from None
        if not answer.success:
            raise Unfit(f"{self.name}/{service}: {answer.message}")

    def _hear_state(self, message: String) -> None:
        self.state = message.data

    def _hear_log(self, message: Log) -> None:
        if message.name == self.name and message.msg.startswith(_SCRIPT_ERROR):
            self.error = self.error or message.msg.removeprefix(_SCRIPT_ERROR)


def _is_advertised(service: str) -> bool:
    try:
        rosgraph.Master(rospy.get_name()).lookupService(service)
    except (rosgraph.MasterError, OSError):
        return False
    return True


def _differences(wanted: Any, there: Any, above: tuple[str, ...]) -> Iterator[str]:
    """Yield the keys in which two parameter trees differ, with both values."""
    if isinstance(wanted, Mapping) and isinstance(there, Mapping):
        for key in sorted({*wanted, *there}, key=str):
            if key not in _OTHER or (above and above[0] != "vehicles"):
                yield from _differences(wanted.get(key), there.get(key), (*above, str(key)))
    elif wanted != there:
        yield f"{'/'.join(above)} = {shown(there)}, the plan's is {shown(wanted)}"
