"""What stands behind the keys of key_teleop: topics and services of the simulator, and the read-out."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from typing import Any

import rospy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Empty, String

from drone_sim.config.types import ParameterError
from drone_sim.message_text import shown
from drone_sim.ros.core import message_conversion
from drone_sim.ros.core.simulator import Simulator
from drone_sim.ros.tools.commands import BACKSPACE, ENTER, KEY_MAPS, Command, CommandInForce

_SILENCE = 1.0  # s of real time; a simulator says something in every step, and while it stands, too
_REQUESTS = {"t": "takeoff", "l": "land", "x": "reset"}  # topics, by key
_STANDING = {
    "stopped": ", without effect: Enter starts the simulation",
    "paused": ": takes effect once p resumes the simulation",
}
_FAREWELL = 0.2  # s; a message leaves in rospy's own time, and a node that is gone delivers nothing


class Teleop:
    """Commands one drone, and starts, stops and pauses its simulation.

    The private parameters `drone` and `simulator` name the drone's namespace and the simulator's node, `keys` one of
    KEY_MAPS.
    """

    def __init__(self) -> None:
        """Advertise and subscribe; init_node must have been called. Raises ParameterError."""
        self.map: str = rospy.get_param("~keys", "cockpit")
        if self.map not in KEY_MAPS:
            raise ParameterError(f"must be {' or '.join(KEY_MAPS)}", ("keys",), shown(self.map))
        self.drone = drone = rospy.get_param("~drone", "drone")  # its namespace
        self._simulator = Simulator(rospy.get_param("~simulator", "drone_sim"))
        self.said = ""  # one line for the user
        self.farewell = ""  # the last one
        self._in_force = CommandInForce()
        self._odometry: Odometry | None = None
        self._heard = -math.inf  # when something came from the simulator
        self._node_state = ""  # the simulator's state
        self._flight_state = ""  # the drone's
        self._calling = ""
        self._stopping = threading.Lock()
        self._publisher = rospy.Publisher(f"{drone}/cmd_vel", Twist, queue_size=1)
        self._requests = {one: rospy.Publisher(f"{drone}/{one}", Empty, queue_size=1) for one in _REQUESTS.values()}
        rospy.Subscriber(f"{drone}/state", String, self._on_flight_state, queue_size=1)
        rospy.Subscriber(f"{drone}/odom", Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber(f"{drone}/command", TwistStamped, self._on_command, queue_size=1)
        self._states = rospy.Subscriber(f"{self._simulator.node}/state", String, self._on_state, queue_size=1)
        rospy.on_shutdown(self.stop)  # before `rosnode kill` closes the topics

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry, self._heard = message, time.monotonic()

    def _on_command(self, message: TwistStamped) -> None:
        linear, angular = message.twist.linear, message.twist.angular
        self._in_force.hear(Command(linear.x, linear.y, linear.z, angular.z))
        self._heard = time.monotonic()

    def _on_state(self, message: String) -> None:
        self._node_state = message.data

    def _on_flight_state(self, message: String) -> None:
        self._flight_state = message.data

    # ---- keys

    @property
    def connected(self) -> bool:
        """Whether a command would reach somebody."""
        return self._publisher.get_num_connections() > 0

    def press(self, key: str) -> bool:
        """Do what a key means; one that means nothing stops the drone, as in the course's own node: return False."""
        self.said = ""
        if key == ENTER:
            self._call("start" if self._node_state == "stopped" else "stop")
        elif key == "p":
            self._call("pause", self._node_state != "paused")
        elif key == BACKSPACE:
            self._call("restart")
        elif key in _REQUESTS:
            self.ask_for(_REQUESTS[key])
        else:
            command = self._in_force.next.after(key, KEY_MAPS[self.map])
            self.send(command or Command())
            return command is not None
        return True

    def ask_for(self, name: str) -> bool:
        """Ask for `takeoff`, `land` or `reset`; return whether somebody hears it, `said` says so."""
        publisher = self._requests[name]
        listened = publisher.get_num_connections() > 0
        sent = f"{name} sent{_STANDING.get(self._node_state, '')}"
        self.said = sent if listened else f"no subscriber on {publisher.resolved_name}: nothing was sent"
        publisher.publish(Empty())
        return listened

    @property
    def topic(self) -> str:
        """The topic of the commands."""
        return str(self._publisher.resolved_name)

    def send(self, command: Command) -> bool:
        """Send a command; where nobody would hear it, return False, and `said` says so."""
        if not self.connected:
            self.said = f"no subscriber on {self.topic}: nothing was sent"
            return False
        self._in_force.send(command)
        self._publisher.publish(_twist(command))
        return True

    def stop(self) -> None:
        """Send the last command, a stop, once; `farewell` says so."""
        with self._stopping:  # whoever comes second waits until it has left
            if self.farewell:
                return
            topic = self._publisher.resolved_name
            self.farewell = f"stop sent on {topic}" if self.connected else f"no stop was sent: no subscriber on {topic}"
            with contextlib.suppress(rospy.ROSException):
                self._publisher.publish(_twist(Command()))
            time.sleep(_FAREWELL)

    def _call(self, service: str, *request: Any) -> None:
        """Call a service of the simulator in a thread of its own, for the keys must go on."""
        if self._calling:
            self.said = f"{self._calling}: no answer yet"
            return
        self._calling = service
        self.said = f"{service} ..."

        def then(done: bool, said: str) -> None:
            self._calling = ""
            self.said = f"{service}: {'' if done else 'failed: '}{said}"

        self._simulator.call_async(service, *request, then=then)

    # ---- the read-out

    def lines(self) -> list[str]:
        """Return the read-out: state, command in force, what the drone does, and what there is to say."""
        state = self._state()
        return [f"state    {state}", f"command  {self._shown_command()}", *_motion(self._odometry), self.said]

    def _shown_command(self) -> str:
        if self._in_force.heard is not None:
            return str(self._in_force.heard)
        return f"{self._in_force.sent}   (as sent)" if self.connected else "-"

    def _state(self) -> str:
        known = self._states.get_num_connections() > 0
        silent = time.monotonic() - self._heard
        if silent < _SILENCE:
            told = self._node_state if known and self._node_state else "flying"
            return told if self._flight_state in ("", told) else f"{told}, the drone: {self._flight_state}"
        self._odometry = None
        if known:
            return (
                f"no answer for {silent:.0f} s (it was {self._node_state})"
                if math.isfinite(silent)
                else self._node_state
            )
        self._in_force.forget()
        self._node_state = ""
        return "no simulator"


def _twist(command: Command) -> Twist:
    return message_conversion.twist((command.vx, command.vy, command.vz), (0.0, 0.0, command.wz))


def _motion(odometry: Odometry | None) -> list[str]:
    """Return velocity in the track frame, and pose; both are exact."""
    if odometry is None:
        return ["drone    no odometry", ""]
    row = message_conversion.odometry_row(odometry)
    (x, y, height), (_, _, yaw), velocity = message_conversion.level_motion(row)
    return [
        f"drone    {Command(*velocity, row[12])}",
        f"         height {height:.2f} m   yaw {math.degrees(yaw):+.0f} deg   x {x:+.2f}  y {y:+.2f} m",
    ]
