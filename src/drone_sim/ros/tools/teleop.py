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
from std_srvs.srv import SetBool, Trigger

from drone_sim.mechanics import frames
from drone_sim.ros.tools import keys
from drone_sim.ros.tools.commands import Command, CommandInForce

_SILENCE = 1.0  # s of real time; a simulator says something in every step, and while it stands, too
_REQUESTS = {"t": "takeoff", "l": "land", "x": "reset"}  # topics, by key
_STANDING = {"stopped": ", in vain: s starts the simulation", "paused": ": done once p lets the simulation go on"}
_FAREWELL = 0.2  # s; a message leaves in rospy's own time, and a node that is gone delivers nothing
_FAILURES = (rospy.ServiceException, rospy.ROSException, rospy.exceptions.ROSInternalException, OSError)


class Teleop:
    """Commands one drone, and starts, stops and pauses its simulation.

    The private parameters `drone` and `simulator` name the drone's namespace and the simulator's node.
    """

    def __init__(self) -> None:
        """Advertise and subscribe; init_node must have been called."""
        drone, self._simulator = rospy.get_param("~drone", "drone"), rospy.get_param("~simulator", "drone_sim")
        self.drone = drone  # its namespace
        self.said = ""  # one line for the user
        self.farewell = ""  # the last one
        self._in_force = CommandInForce()
        self._odometry: Odometry | None = None
        self._heard = -math.inf  # when something came from the simulator
        self._told = ""  # the simulator's state
        self._flight_state = ""  # the drone's
        self._calling = ""
        self._stopping = threading.Lock()
        self._publisher = rospy.Publisher(f"{drone}/cmd_vel", Twist, queue_size=1)
        names = ((key, f"{drone}/{topic}") for key, topic in _REQUESTS.items())
        self._requests = {key: rospy.Publisher(name, Empty, queue_size=1) for key, name in names}
        rospy.Subscriber(f"{drone}/state", String, self._on_flight_state, queue_size=1)
        rospy.Subscriber(f"{drone}/odom", Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber(f"{drone}/command", TwistStamped, self._on_command, queue_size=1)
        self._states = rospy.Subscriber(f"{self._simulator}/state", String, self._on_state, queue_size=1)
        rospy.on_shutdown(self.stop)  # before `rosnode kill` closes the topics

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry, self._heard = message, time.monotonic()

    def _on_command(self, message: TwistStamped) -> None:
        linear, angular = message.twist.linear, message.twist.angular
        self._in_force.hear(Command(linear.x, linear.y, linear.z, angular.z))
        self._heard = time.monotonic()

    def _on_state(self, message: String) -> None:
        self._told = message.data

    def _on_flight_state(self, message: String) -> None:
        self._flight_state = message.data

    # ---- keys

    @property
    def connected(self) -> bool:
        """Whether a command would reach somebody."""
        return self._publisher.get_num_connections() > 0

    def press(self, key: str) -> bool:
        """Do what a key means; return False for one that means nothing."""
        self.said = ""
        if key == "s":
            self._call("start" if self._told == "stopped" else "stop", Trigger)
        elif key == "p":
            self._call("pause", SetBool, self._told != "paused")
        elif key == keys.BACKSPACE:
            self._call("restart", Trigger)
        elif key in self._requests:
            self._ask_for(key)
        else:
            return self._command(key)
        return True

    def _ask_for(self, key: str) -> None:
        publisher, name = self._requests[key], _REQUESTS[key]
        listened = publisher.get_num_connections() > 0
        sent = f"{name} sent{_STANDING.get(self._told, '')}"
        self.said = sent if listened else f"nobody listens on {publisher.resolved_name}: nothing sent"
        publisher.publish(Empty())

    def _command(self, key: str) -> bool:
        command = self._in_force.next.after(key)
        if command is None:
            return False
        self.send(command)
        return True

    @property
    def topic(self) -> str:
        """The topic of the commands."""
        return str(self._publisher.resolved_name)

    def send(self, command: Command) -> bool:
        """Send a command; where nobody would hear it, return False, and `said` says so."""
        if not self.connected:
            self.said = f"nobody listens on {self.topic}: nothing sent"
            return False
        self._in_force.send(command)
        self._publisher.publish(_message(command))
        return True

    def stop(self) -> None:
        """Send the last command, a stop, once; `farewell` says so."""
        with self._stopping:  # whoever comes second waits until it has left
            if self.farewell:
                return
            topic = self._publisher.resolved_name
            self.farewell = f"stop sent on {topic}" if self.connected else f"no stop sent: nobody listens on {topic}"
            with contextlib.suppress(rospy.ROSException):
                self._publisher.publish(_message(Command()))
            time.sleep(_FAREWELL)

    def _call(self, name: str, kind: type[Any], *request: Any) -> None:
        """Call a service of the simulator in a thread of its own, for the keys must go on."""
        if self._calling:
            self.said = f"{self._calling}: no answer yet"
            return
        self._calling = name
        self.said = f"{name} ..."

        def call() -> None:
            try:
                answer = rospy.ServiceProxy(f"{self._simulator}/{name}", kind)(*request)
                said = answer.message if answer.success else f"failed: {answer.message}"
            except _FAILURES as error:
                said = f"failed: {error}"
            self._calling = ""
            self.said = f"{name}: {' '.join(said.split())}"

        threading.Thread(target=call, name=name, daemon=True).start()

    # ---- the read-out

    def lines(self) -> list[str]:
        """Return the read-out: state, command in force, what the drone does, and what there is to say."""
        state = self._state()
        return [f"state    {state}", f"command  {self._told_command()}", *_motion(self._odometry), self.said]

    def _told_command(self) -> str:
        if self._in_force.heard is not None:
            return str(self._in_force.heard)
        return f"{self._in_force.sent}   (as sent)" if self.connected else "-"

    def _state(self) -> str:
        known = self._states.get_num_connections() > 0
        silent = time.monotonic() - self._heard
        if silent < _SILENCE:
            told = self._told if known and self._told else "flying"
            return told if self._flight_state in ("", told) else f"{told}, the drone: {self._flight_state}"
        self._odometry = None
        if known:
            return f"no answer for {silent:.0f} s (it was {self._told})" if math.isfinite(silent) else self._told
        self._in_force.forget()
        self._told = ""
        return "no simulator"


def _message(command: Command) -> Twist:
    twist = Twist()
    twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.z = command
    return twist


def _motion(odometry: Odometry | None) -> list[str]:
    """Return velocity in the track frame, and pose; both are exact."""
    if odometry is None:
        return ["drone    no odometry", ""]
    turn, place = odometry.pose.pose.orientation, odometry.pose.pose.position
    matrix = frames.from_quaternion((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
    yaw = frames.to_rpy(matrix)[2]
    level = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, -yaw))
    linear, angular = odometry.twist.twist.linear, odometry.twist.twist.angular
    velocity = frames.rotate(level, frames.rotate(matrix, (linear.x, linear.y, linear.z)))
    turning = frames.rotate(matrix, (angular.x, angular.y, angular.z))[2]
    return [
        f"drone    {Command(*velocity, turning)}",
        f"         height {place.z:.2f} m   yaw {math.degrees(yaw):+.0f} deg   x {place.x:+.2f}  y {place.y:+.2f} m",
    ]
