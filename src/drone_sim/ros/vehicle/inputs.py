"""Topics that a vehicle subscribes to, and its services. Callbacks in rospy's threads check messages and queue jobs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped, Vector3Stamped, WrenchStamped
from geometry_msgs.msg import Twist as TwistMessage
from std_msgs.msg import Empty

from drone_sim.config.errors import changed
from drone_sim.config.types import ParameterError
from drone_sim.grading.permissions import CHANGE, MOVE, PUSH
from drone_sim.mechanics.state import Pose
from drone_sim.ros.core.inbox import Gate, Inbox, open_gate
from drone_sim.ros.core.message_conversion import full_name, message_class, service_class, xyz
from drone_sim.ros.core.validation import check_changes, check_frame, intervention, read_changes, read_pose, sender
from drone_sim.ros.vehicle.driver_topics import Missing
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import checks
from drone_sim.vehicles.commands import EMPTY, REQUESTS
from drone_sim.vehicles.driver import DriverTopic
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_COMMAND, _STAMPED_COMMAND = "cmd_vel", "cmd_vel_stamped"
_WARNING_PERIOD = 5.0  # s
# Sizes of queues of topics of which each message counts. Of other topics only the last message counts, unless a gate
# chooses among them.
_QUEUES = {"push": 100, "weather": 100, "faults": 100}
_GATED_QUEUE = 10
_INTERVENTIONS = {  # changes of the world, which a graded flight may forbid
    **dict.fromkeys(("set_pose", "initialpose", "reset"), MOVE),
    "push": PUSH,
    **dict.fromkeys(("weather", "set_wind", "faults"), CHANGE),
}
_SUCCESS = "success", "result"  # fields of a driver's responses that say whether it worked
_Job = Callable[[Vehicle], Any]
_Reader = tuple[type, Callable[[Any], _Job]]  # the type of a topic's messages, and their reader


class VehicleInputs:
    """Subscriptions and services in the namespace of one vehicle."""

    def __init__(self, simulation: Simulation, parameters: VehicleParameters, inbox: Inbox, gate: Gate = open_gate):
        """Subscribe for the vehicle with these parameters.

        The simulation's thread runs the jobs in `inbox`; `gate` wraps the callback of each topic.
        """
        self._simulation, self._gate = simulation, gate
        self._name, self._inbox = parameters.name, inbox
        # Copies of the limits, because callbacks must not read the simulation: it runs in another thread.
        self._parameters, self._weather_limits = parameters, simulation.parameters.weather
        self.log = CommandLog(senders=self._commanders)
        own: dict[str, _Reader] = {
            _COMMAND: (TwistMessage, self._twist),
            _STAMPED_COMMAND: (TwistStamped, lambda message: self._twist(message.twist)),
            "goto": (PoseStamped, self._posing(lambda vehicle, pose: vehicle.ask("goto", pose))),
            **{topic: (Empty, self._asking(topic)) for topic, kind in REQUESTS.items() if kind == EMPTY},
            "set_pose": (PoseStamped, self._posing(lambda vehicle, pose: vehicle.body.move(pose))),
            "initialpose": (PoseWithCovarianceStamped, self._pose_estimate),
            "target_pose": (PoseStamped, self._posing(lambda vehicle, pose: vehicle.target.put(pose.matrix))),
            "push": (WrenchStamped, self._push),
            "set_wind": (Vector3Stamped, self._wind),
            "weather": (KeyValue, self._weather),
            "faults": (KeyValue, self._faults),
        }
        drivers = {entry.topic: entry for entry in parameters.topics.values() if entry.takes and not entry.service}
        self._subscribers: list[rospy.Subscriber] = []
        self._commands: list[rospy.Subscriber] = []  # of the subscribers
        for topic, reader in own.items():
            if topic not in drivers:
                self._subscribe(topic, topic, *reader)
        missing = Missing()
        for topic, entry in drivers.items():
            with missing.noted(entry.type, full_name(self._name, topic)):
                self._subscribe(topic, str(entry.takes), *self._drivers_reader(entry, own))
        self._services: list[rospy.Service] = []
        for entry in parameters.topics.values():
            name = full_name(self._name, entry.topic)
            if entry.service:
                with missing.noted(entry.type, name):
                    kind = service_class(str(entry.type))
                    self._services.append(rospy.Service(name, kind, partial(self._serve, entry, kind._response_class)))
        missing.warn()

    def _drivers_reader(self, entry: DriverTopic, own: Mapping[str, _Reader]) -> _Reader:
        """Return message type and reader of a driver's topic. Raises ValueError if the type is not installed."""
        if entry.takes == "nothing":
            return message_class(entry.type or EMPTY), lambda _message: lambda _vehicle: None
        if entry.takes == _COMMAND:
            kind = message_class(entry.type or TwistMessage._type)
            return kind, lambda message: self._twist(getattr(message, "twist", message), entry)
        return own[str(entry.takes)]

    def _serve(self, entry: DriverTopic, make_response: type, request: Any) -> Any:
        """Do what a driver's service says: `motors` with a request for false stops the propellers."""
        stops = entry.takes == "motors" and not getattr(request, request.__slots__[0])
        topic = "emergency" if stops else str(entry.takes)

        def ask() -> None:
            vehicle = self._simulation.vehicles.get(self._name)
            if vehicle is not None:
                vehicle.ask(topic)

        if topic in REQUESTS:
            self._inbox.put(ask)
        response = make_response()
        for field in _SUCCESS:
            if hasattr(response, field):
                setattr(response, field, True)
        return response

    def _subscribe(self, topic: str, meaning: str, kind: type, read: Callable[[Any], _Job]) -> None:
        """Subscribe to a topic: queue the job of each valid message, and log why another one is refused.

        `meaning` is the name of our topic with this meaning.
        """
        name = full_name(self._name, topic)
        is_command = meaning in (_COMMAND, _STAMPED_COMMAND)
        consequence = ", the last valid one is kept" if is_command else ""
        logged = _COMMAND if is_command else meaning
        throttle, action = Throttle(_WARNING_PERIOD), _INTERVENTIONS.get(meaning)

        def take(message: Any) -> None:
            try:
                job = read(message)
            except (checks.Refused, ParameterError) as error:
                refuse(message, error)
                return
            twist = getattr(message, "twist", message)
            self.log.take(logged, sender(message), is_command and not any((*xyz(twist.linear), *xyz(twist.angular))))
            change = intervention(action, self._name, name, message) if action else None
            self._inbox.put(partial(execute, job, message), change)

        def execute(job: _Job, message: Any) -> None:
            vehicle = self._simulation.vehicles.get(self._name)  # may have been removed or replaced since the check
            try:
                if vehicle is not None:
                    job(vehicle)
            except (checks.Refused, ParameterError) as error:
                refuse(message, error)

        def refuse(message: Any, error: ValueError) -> None:
            why = error.text if isinstance(error, ParameterError) else str(error)
            self.log.refuse(logged, sender(message), why, meaning)
            if throttle.passes():
                rospy.logwarn(f"{meaning} refused{consequence}: {why}")

        queue = _QUEUES.get(meaning, 1 if self._gate is open_gate else _GATED_QUEUE)
        subscriber = rospy.Subscriber(name, kind, self._gate(name, take), queue_size=queue, tcp_nodelay=True)
        self._subscribers.append(subscriber)
        if is_command:
            self._commands.append(subscriber)

    def _commanders(self) -> list[str]:
        """Return the nodes that publish cmd_vel or cmd_vel_stamped."""
        return sorted({each.callerid_pub for topic in self._commands for each in topic.impl.connections})

    def follow(self, vehicle: Vehicle) -> None:
        """Use the limits of this vehicle from now on; it was tuned, or replaces the last one."""
        self._parameters, self._weather_limits = vehicle.parameters, self._simulation.parameters.weather

    def close(self) -> None:
        for subscriber in self._subscribers:
            subscriber.unregister()
        for service in self._services:
            service.shutdown("the vehicle is gone, or its topics have changed")

    # ---- readers of messages: each returns a job, or raises Refused

    def _twist(self, message: TwistMessage, entry: DriverTopic | None = None) -> _Job:
        """Read a velocity, or what the numbers mean on a driver's topic."""
        linear, angular, meaning = xyz(message.linear), xyz(message.angular), self._parameters.cmd_vel_meaning
        if entry is not None:
            linear, angular = meaning.converted(linear, angular)
        elif meaning.means == "tilt":
            angular = (0.0, 0.0, angular[2])
        twist = checks.twist(linear, angular, self._parameters)
        return lambda vehicle: vehicle.commands.receive(twist)

    def _posing(self, act: Callable[[Vehicle, Pose], Any]) -> Callable[[PoseStamped], _Job]:
        def read(message: PoseStamped) -> _Job:
            pose = read_pose(message.header.frame_id, message.pose, self._parameters)
            return lambda vehicle: act(vehicle, pose)

        return read

    @staticmethod
    def _asking(topic: str) -> Callable[[Empty], _Job]:
        return lambda _message: lambda vehicle: vehicle.ask(topic)

    def _pose_estimate(self, message: PoseWithCovarianceStamped) -> _Job:
        """Move to rviz's 2D Pose Estimate, x, y and yaw, at the same height."""
        (x, y, _), turn = read_pose(message.header.frame_id, message.pose.pose, self._parameters)
        return lambda vehicle: vehicle.body.move(Pose((x, y, vehicle.body.state.position[2]), turn))

    def _push(self, message: WrenchStamped) -> _Job:
        check_frame(message.header.frame_id)
        force, torque = xyz(message.wrench.force), xyz(message.wrench.torque)
        push = checks.push(force, torque, self._parameters)
        return lambda vehicle: vehicle.pushes.add(push)

    def _wind(self, message: Vector3Stamped) -> _Job:
        """Set the steady wind for all vehicles; gusts stay as they are."""
        check_frame(message.header.frame_id)
        changes = {"wind": xyz(message.vector)}
        check_changes(changes, self._weather_limits)
        return lambda vehicle: vehicle.context.change_weather(changes)

    def _weather(self, message: KeyValue) -> _Job:
        changes = read_changes(message, self._weather_limits)
        return lambda vehicle: vehicle.context.change_weather(changes)

    def _faults(self, message: KeyValue) -> _Job:
        parameters = self._parameters
        changes = read_changes(message, parameters.faults)
        parameters.model_copy(update={"faults": changed(parameters.faults, changes)}).check_faults()
        return lambda vehicle: vehicle.change_faults(changes)
