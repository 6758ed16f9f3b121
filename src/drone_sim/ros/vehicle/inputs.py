"""What a vehicle listens to. Callbacks run in rospy's threads: they check, and leave a job for the next step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Vector3Stamped, WrenchStamped
from geometry_msgs.msg import Twist as TwistMessage
from std_msgs.msg import Empty

from drone_sim.config.changing import changed
from drone_sim.config.types import ParameterError
from drone_sim.mechanics.state import Pose
from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.vehicle.conditions import check_changes, read_changes
from drone_sim.ros.vehicle.messages import WORLD_FRAME
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import checks
from drone_sim.vehicles.parameters import EquipmentParameters, VehicleParameters
from drone_sim.vehicles.requests import EMPTY, REQUESTS
from drone_sim.vehicles.vehicle import Vehicle
from drone_sim.wording import shown

_QUIET = 5.0  # s, between two warnings
_Job = Callable[[Vehicle], Any]


class VehicleInputs:
    """The commands of one vehicle, in its namespace."""

    def __init__(self, simulation: Simulation, parameters: VehicleParameters, inbox: Inbox):
        """Subscribe."""
        self._simulation = simulation
        self._name, self._at_first = parameters.name, parameters
        self._inbox = inbox
        self.log = CommandLog()
        self._subscribers = [
            rospy.Subscriber(f"{self._name}/{topic}", kind, self._taking(topic, read), queue_size=1, tcp_nodelay=True)
            for topic, kind, read in (
                ("cmd_vel", TwistMessage, self._twist),
                ("goto", PoseStamped, self._goto),
                *((topic, Empty, self._asking(topic)) for topic, kind in REQUESTS.items() if kind == EMPTY),
                ("set_pose", PoseStamped, self._pose),
                ("initialpose", PoseWithCovarianceStamped, self._pose_estimate),
                ("target_pose", PoseStamped, self._target),
                ("push", WrenchStamped, self._push),
                ("set_wind", Vector3Stamped, self._wind),
                ("weather", KeyValue, self._weather),
                ("faults", KeyValue, self._faults),
            )
        ]
        self.log.senders = self._commanders

    def _commanders(self) -> list[str]:
        """Return the nodes that are connected to cmd_vel."""
        return sorted({one.callerid_pub for one in self._subscribers[0].impl.connections})

    @property
    def _parameters(self) -> VehicleParameters:
        """Those of the vehicle, which may be tuned."""
        vehicle = self._simulation.vehicles.get(self._name)
        return self._at_first if vehicle is None else vehicle.parameters

    def close(self) -> None:
        """Listen no more."""
        for subscriber in self._subscribers:
            subscriber.unregister()

    def _taking(self, topic: str, read: Callable[[Any], _Job]) -> Callable[[Any], None]:
        """Return a callback that leaves what a message asks for to the simulation's thread, or says why not."""
        kept = ", the last good one is kept" if topic == "cmd_vel" else ""
        throttle = Throttle(_QUIET)

        def take(message: Any) -> None:
            try:
                job = read(message)
            except (checks.Refused, ParameterError) as refused:
                said = str(refused).removeprefix("parameter ")
                self.log.refuse(topic, _sender(message), said)
                if throttle.passes():
                    rospy.logwarn(f"{topic} refused{kept}: {said}")
                return
            self.log.take(topic, _sender(message))
            self._inbox.put(lambda: self._carry_out(job))

        return take

    def _carry_out(self, job: _Job) -> None:
        vehicle = self._simulation.vehicles.get(self._name)
        if vehicle is not None:  # it may have gone meanwhile
            job(vehicle)

    # ---- what a message asks for; raise Refused

    def _twist(self, message: TwistMessage) -> _Job:
        twist = checks.twist(_numbers(message.linear), _numbers(message.angular), self._parameters)
        return lambda vehicle: vehicle.receive(twist)

    def _goto(self, message: PoseStamped) -> _Job:
        pose = checked_pose(message.header.frame_id, message.pose, self._parameters)
        return lambda vehicle: vehicle.ask("goto", pose)

    @staticmethod
    def _asking(topic: str) -> Callable[[Empty], _Job]:
        return lambda _message: lambda vehicle: vehicle.ask(topic)

    def _pose(self, message: PoseStamped) -> _Job:
        pose = checked_pose(message.header.frame_id, message.pose, self._parameters)
        return lambda vehicle: vehicle.move(pose)

    def _pose_estimate(self, message: PoseWithCovarianceStamped) -> _Job:
        """Take rviz's 2D Pose Estimate: a place on the floor, a yaw; the height stays as it is."""
        (x, y, _), turn = checked_pose(message.header.frame_id, message.pose.pose, self._parameters)
        return lambda vehicle: vehicle.move(Pose((x, y, vehicle.state.position[2]), turn))

    def _target(self, message: PoseStamped) -> _Job:
        pose = checked_pose(message.header.frame_id, message.pose, self._parameters)
        return lambda vehicle: vehicle.move_target(pose)

    def _push(self, message: WrenchStamped) -> _Job:
        _check_frame(message.header.frame_id)
        force, torque = _numbers(message.wrench.force), _numbers(message.wrench.torque)
        push = checks.push(force, torque, self._parameters)
        return lambda vehicle: vehicle.push(*push)

    def _wind(self, message: Vector3Stamped) -> _Job:
        """Take the steady wind, for all vehicles; the gusts stay."""
        _check_frame(message.header.frame_id)
        changes = {"wind": _numbers(message.vector)}
        check_changes(changes, self._simulation.parameters.weather)
        return lambda vehicle: vehicle.change_weather(changes)

    def _weather(self, message: KeyValue) -> _Job:
        changes = read_changes(message, self._simulation.parameters.weather)
        return lambda vehicle: vehicle.change_weather(changes)

    def _faults(self, message: KeyValue) -> _Job:
        changes = read_changes(message, self._parameters.faults)
        self._parameters.model_copy(update={"faults": changed(self._parameters.faults, changes)}).check_faults()
        return lambda vehicle: vehicle.change_faults(changes)


def _sender(message: Any) -> str:
    header = getattr(message, "_connection_header", {})  # rospy's, of what came over a wire
    return str(header.get("callerid", "?"))


def checked_pose(frame: str, message: PoseMessage, parameters: EquipmentParameters, lowest: float = 0.0) -> Pose:
    """Return a pose that came in a frame, at `lowest` or above (m); raises Refused."""
    _check_frame(frame)
    turn = message.orientation
    return checks.pose(_numbers(message.position), (turn.x, turn.y, turn.z, turn.w), parameters, lowest)


def _check_frame(frame: str) -> None:
    if frame.lstrip("/") not in ("", WORLD_FRAME):
        raise checks.Refused(f"frame_id {shown(frame)}: must be '{WORLD_FRAME}'")


def _numbers(message: PoseMessage) -> Sequence[float]:
    return message.x, message.y, message.z
