"""Control of a drone and its simulation for key_teleop and joy_teleop: topics, services, and a text of the state."""

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

_SILENCE = 1.0  # s of real time; the simulator publishes more often than that, also while it is stopped or paused
_REQUESTS = {"t": "takeoff", "l": "land", "x": "reset"}  # topics, by key
_REQUEST_NOTES = {  # by state of the simulation
    "stopped": ", without effect: Enter starts the simulation",
    "paused": ": takes effect once p resumes the simulation",
}
_SEND_TIME = 0.2  # s; rospy sends the last message in another thread, which must not end before


class Teleop:
    """Sends commands to one drone, and starts, stops and pauses its simulation.

    The private parameters `drone` and `simulator` name the drone's namespace and the simulator's node, `keys` one of
    KEY_MAPS.
    """

    def __init__(self) -> None:
        """Advertise and subscribe, after init_node. Raises ParameterError."""
        self.key_map: str = rospy.get_param("~keys", "cockpit")
        if self.key_map not in KEY_MAPS:
            raise ParameterError(f"must be {' or '.join(KEY_MAPS)}", ("keys",), shown(self.key_map))
        drone = rospy.get_param("~drone", "drone")
        self._simulator = Simulator(rospy.get_param("~simulator", "drone_sim"))
        self.status = ""  # one line for the user
        self.farewell = ""  # the last line for the user, once a stop was sent
        self._in_force = CommandInForce()
        self._odometry: Odometry | None = None
        self._received_at = -math.inf  # time of the simulator's last message
        self._node_state = ""  # the simulator's state
        self._flight_state = ""  # the drone's
        self._pending_service = ""
        self._stop_lock = threading.Lock()
        self._publisher = rospy.Publisher(f"{drone}/cmd_vel", Twist, queue_size=1)
        self._requests = {name: rospy.Publisher(f"{drone}/{name}", Empty, queue_size=1) for name in _REQUESTS.values()}
        rospy.Subscriber(f"{drone}/state", String, self._on_flight_state, queue_size=1)
        rospy.Subscriber(f"{drone}/odom", Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber(f"{drone}/command", TwistStamped, self._on_command, queue_size=1)
        self._states = rospy.Subscriber(f"{self._simulator.node}/state", String, self._on_state, queue_size=1)
        rospy.on_shutdown(self.stop)  # `rosnode kill` closes the topics only after this

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry, self._received_at = message, time.monotonic()

    def _on_command(self, message: TwistStamped) -> None:
        linear, angular = message.twist.linear, message.twist.angular
        self._in_force.on_published(Command(linear.x, linear.y, linear.z, angular.z))
        self._received_at = time.monotonic()

    def _on_state(self, message: String) -> None:
        self._node_state = message.data

    def _on_flight_state(self, message: String) -> None:
        self._flight_state = message.data

    # ---- keys

    @property
    def is_connected(self) -> bool:
        return self._publisher.get_num_connections() > 0

    def press(self, key: str) -> bool:
        """Execute a key press. As in the course's own node, an unknown key stops the drone; then return False."""
        self.status = ""
        if key == ENTER:
            self._call("start" if self._node_state == "stopped" else "stop")
        elif key == "p":
            self._call("pause", self._node_state != "paused")
        elif key == BACKSPACE:
            self._call("restart")
        elif key in _REQUESTS:
            self.request(_REQUESTS[key])
        else:
            command = self._in_force.next.after(key, KEY_MAPS[self.key_map])
            self.send(command or Command())
            return command is not None
        return True

    def request(self, name: str) -> bool:
        """Request `takeoff`, `land` or `reset`; return whether there is a subscriber, and set `status`."""
        publisher = self._requests[name]
        is_sent = publisher.get_num_connections() > 0
        note = _REQUEST_NOTES.get(self._node_state, "")
        unsent = f"no subscriber on {publisher.resolved_name}: nothing was sent"
        self.status = f"{name} sent{note}" if is_sent else unsent
        publisher.publish(Empty())
        return is_sent

    @property
    def topic(self) -> str:
        return str(self._publisher.resolved_name)

    def send(self, command: Command) -> bool:
        """Send a command; if there is no subscriber, return False and say so in `status`."""
        if not self.is_connected:
            self.status = f"no subscriber on {self.topic}: nothing was sent"
            return False
        self._in_force.on_sent(command)
        self._publisher.publish(_twist(command))
        return True

    def stop(self) -> None:
        """Send a stop, once, as the last command, and set `farewell`."""
        with self._stop_lock:  # a second thread waits until the stop was sent
            if self.farewell:
                return
            unsent = f"no stop was sent: no subscriber on {self.topic}"
            self.farewell = f"stop sent on {self.topic}" if self.is_connected else unsent
            with contextlib.suppress(rospy.ROSException):
                self._publisher.publish(_twist(Command()))
            time.sleep(_SEND_TIME)

    def _call(self, service: str, *request: Any) -> None:
        """Call a service of the simulator without waiting for the reply, so that keys still work."""
        if self._pending_service:
            self.status = f"{self._pending_service}: no answer yet"
            return
        self._pending_service = service
        self.status = f"{service} ..."

        def then(is_done: bool, message: str) -> None:
            self._pending_service = ""
            self.status = f"{service}: {'' if is_done else 'failed: '}{message}"

        self._simulator.call_async(service, *request, then=then)

    # ---- text

    def lines(self) -> list[str]:
        """Return lines with the state, the command in force, the drone's motion, and `status`."""
        state = self._state()  # first, because it may reset the command and the odometry
        command = "-"
        if self._in_force.published is not None:
            command = str(self._in_force.published)
        elif self.is_connected:
            command = f"{self._in_force.sent}   (as sent)"
        return [f"state    {state}", f"command  {command}", *_motion(self._odometry), self.status]

    def _state(self) -> str:
        is_known = self._states.get_num_connections() > 0
        silence = time.monotonic() - self._received_at
        if silence < _SILENCE:
            state = self._node_state if is_known and self._node_state else "flying"
            return state if self._flight_state in ("", state) else f"{state}, the drone: {self._flight_state}"
        self._odometry = None
        if is_known:
            has_flown = math.isfinite(silence)
            return f"no answer for {silence:.0f} s (it was {self._node_state})" if has_flown else self._node_state
        self._in_force.reset()
        self._node_state = ""
        return "no simulator"


def _twist(command: Command) -> Twist:
    return message_conversion.twist((command.vx, command.vy, command.vz), (0.0, 0.0, command.wz))


def _motion(odometry: Odometry | None) -> list[str]:
    """Return two lines with the velocity in the frame Track_base, and with the pose."""
    if odometry is None:
        return ["drone    no odometry", ""]
    row = message_conversion.odometry_row(odometry)
    (x, y, height), (_, _, yaw), velocity = message_conversion.level_motion(row)
    return [
        f"drone    {Command(*velocity, row[12])}",
        f"         height {height:.2f} m   yaw {math.degrees(yaw):+.0f} deg   x {x:+.2f}  y {y:+.2f} m",
    ]
