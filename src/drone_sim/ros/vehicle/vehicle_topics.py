"""All topics of all vehicles; they follow as vehicles are added and removed."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree as Xml

import rospy

from drone_sim.files.resources import read_bytes
from drone_sim.ros.core.inbox import Gate, Inbox, open_gate
from drone_sim.ros.core.publishing import NewSubscribers, Stamp
from drone_sim.ros.vehicle.cameras import CameraOutput
from drone_sim.ros.vehicle.driver_topics import DriverOutputs
from drone_sim.ros.vehicle.inputs import VehicleInputs
from drone_sim.ros.vehicle.outputs import SensorOutput, Transforms, VehicleOutputs
from drone_sim.ros.vehicle.tuning_server import TuningServer
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.scene_document import PLACE
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_LARGEST_URDF = 4 * 2**20  # bytes


class VehicleTopics:
    """The topics in the namespace of one vehicle. Each start may replace the vehicle object, but not the topics."""

    def __init__(self, simulation: Simulation, vehicle: Vehicle, inbox: Inbox, gate: Gate):
        """Advertise, subscribe, and set the vehicle's robot_description.

        The simulation's thread runs the jobs in `inbox`; `gate` wraps the callback of each topic.
        """
        self._simulation = simulation
        self.vehicle, parameters = vehicle, vehicle.parameters
        self.inputs = VehicleInputs(simulation, parameters, inbox, gate)
        self.new_subscribers = NewSubscribers()  # to pictures or state
        self.outputs = VehicleOutputs(parameters, self.new_subscribers, is_in_lockstep=gate is not open_gate)
        self.driver = DriverOutputs(vehicle, self.new_subscribers)
        self.cameras = [
            (name, CameraOutput(parameters, camera, parameters.cameras[name], self.new_subscribers))
            for name, camera in vehicle.cameras.items()
        ] + self.driver.cameras
        self.sensors = [
            (name, SensorOutput(parameters, sensor)) for name, sensor in vehicle.instruments.by_name.items()
        ] + self.driver.sensors
        self._tuning: TuningServer | None = None
        if rospy.resolve_name(vehicle.name) == rospy.get_name():  # the node has its own server there
            rospy.logwarn(f"vehicle {vehicle.name} cannot be tuned in flight, because it has the same name as the node")
        else:
            tuning = simulation.child_scripts[vehicle.name].tuning
            self._tuning = TuningServer(vehicle.name, tuning, inbox, tuned=lambda: self.inputs.follow(self.vehicle))
        _set_description(parameters)

    def follow(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        for name, camera in self.cameras:
            camera.follow(vehicle.cameras[name])
        for name, sensor in self.sensors:
            sensor.follow(vehicle.instruments.by_name[name])
        self.show_tuning()

    def show_tuning(self) -> None:
        """Publish the tuned values if they have changed, and check commands against the new limits."""
        self.inputs.follow(self.vehicle)
        if self._tuning is not None:
            self._tuning.follow(self._simulation.child_scripts[self.vehicle.name].tuning)

    def close(self) -> None:
        outputs = [output for _, output in (*self.cameras, *self.sensors)]
        parts: list[Any] = [self.inputs, self.outputs, self.driver, self._tuning, *outputs]
        for part in filter(None, parts):
            part.close()


class FleetTopics:
    """The topics and frames of all vehicles of a simulation."""

    def __init__(self, simulation: Simulation, inbox: Inbox, stamp: Stamp, gate: Gate = open_gate):
        """Advertise for the vehicles of `simulation`, whose thread runs the jobs in `inbox`.

        `stamp` returns the stamp of messages that are sent now; `gate` wraps the callback of each topic.
        """
        self._simulation = simulation
        self._inbox, self._gate = inbox, gate
        self._stamp = stamp
        self._topics: dict[str, VehicleTopics] = {}
        self._transforms = Transforms(simulation, stamp)
        self._topology_version = -1
        self._tuned: tuple[int, int, bool] | None = None
        self.descriptions: tuple[str, ...] = ()  # names of the parameters that hold the URDFs; any thread may read it
        self.follow()

    def follow(self) -> None:
        """Add topics of new vehicles, remove those of removed vehicles, and publish tuned values."""
        simulation = self._simulation
        context = simulation.context
        # After the first step it is known which parameters the scripts read.
        tuned = context.tunings, context.scripts.asked, simulation.steps > 0
        if self._topology_version != simulation.topology_version:
            self._follow_vehicles()
        elif self._tuned != tuned:
            for topics in self._topics.values():
                topics.show_tuning()
        self._tuned = tuned

    def _follow_vehicles(self) -> None:
        self._topology_version = self._simulation.topology_version
        vehicles = self._simulation.vehicles
        for name, topics in list(self._topics.items()):
            if name not in vehicles or _topic_parameters(topics.vehicle.parameters) != _topic_parameters(
                vehicles[name].parameters
            ):
                del self._topics[name]
                topics.close()
        for name, vehicle in vehicles.items():
            if name in self._topics:
                self._topics[name].follow(vehicle)
            else:
                self._topics[name] = VehicleTopics(self._simulation, vehicle, self._inbox, self._gate)
        self.descriptions = tuple(rospy.resolve_name(f"{name}/robot_description") for name in vehicles)
        self._transforms.publish_static()
        # rospy's topics are in reference cycles, and each has an open descriptor (epoll) until it is collected.
        gc.collect()

    def command_logs(self) -> dict[str, CommandLog]:
        """Return the log of received messages by vehicle."""
        return {name: topics.inputs.log for name, topics in self._topics.items()}

    def publish_state(self) -> None:
        """Publish the state of every vehicle."""
        for topics in self._topics.values():
            topics.outputs.publish_state(topics.vehicle, self._stamp)
            for message in topics.driver.messages:
                message.publish(topics.vehicle, self._stamp)

    @contextlib.contextmanager
    def hurrying(self) -> Iterator[None]:
        """In a late step, leave out some of the pictures that are only sent compressed."""
        cameras = [camera for topics in self._topics.values() for _, camera in topics.cameras]
        for camera in cameras:
            camera.late_step = self._simulation.steps + 1
        try:
            yield
        finally:
            for camera in cameras:
                camera.late_step = None

    def publish_pictures(self) -> None:
        for topics in self._topics.values():
            for _, camera in topics.cameras:
                camera.publish(self._stamp)

    def publish_readings(self) -> None:
        """Publish the readings of every vehicle's sensors in the last step."""
        for topics in self._topics.values():
            for _, sensor in topics.sensors:
                sensor.publish(self._stamp, self._simulation.time)

    def publish_transforms(self) -> None:
        """Publish joint states and transforms: tf2 takes only one transform for each stamp."""
        for topics in self._topics.values():
            topics.outputs.publish_joints(topics.vehicle, self._stamp)
        self._transforms.publish()

    def tell_new_subscribers(self) -> bool:
        """Send transforms to new subscribers; return whether there are new subscribers to pictures or state."""
        self._transforms.tell_new_subscribers()
        return any([topics.new_subscribers.take() for topics in self._topics.values()])

    def publish_command(self) -> None:
        """Publish the current commands, which may also change while the simulation is paused."""
        for topics in self._topics.values():
            topics.outputs.publish_command(topics.vehicle, self._stamp)


def _topic_parameters(parameters: VehicleParameters) -> tuple[str, Any]:
    """Return the parameters that a vehicle's topics may depend on: without its start place and random seeds.

    Topics are not advertised again without need: their subscribers would miss the first steps.
    """
    return parameters.frame_prefix, _without_seeds(parameters.model_dump(exclude={*PLACE}))


def _without_seeds(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_seeds(inner) for key, inner in value.items() if key != "seed"}
    return value


def _set_description(parameters: VehicleParameters) -> None:
    """Set the parameter `robot_description` in the namespace of a vehicle: its URDF, without inertias.

    Programs that only compute poses need no inertias, and KDL warns of a root link that has one.
    """
    robot = Xml.fromstring(read_bytes(parameters.urdf, _LARGEST_URDF))
    for link in robot.iter("link"):
        for inertial in link.findall("inertial"):
            link.remove(inertial)
    rospy.set_param(f"{parameters.name}/robot_description", Xml.tostring(robot, encoding="unicode"))
