"""Everything that one vehicle hears and publishes."""

from __future__ import annotations

from collections.abc import Callable

import rospy

from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.node.newcomers import Newcomers
from drone_sim.ros.node.step_time import Stamp
from drone_sim.ros.vehicle.cameras import CameraOutput
from drone_sim.ros.vehicle.description import set_description
from drone_sim.ros.vehicle.inputs import VehicleInputs
from drone_sim.ros.vehicle.outputs import VehicleOutputs
from drone_sim.ros.vehicle.sensors import SensorOutput
from drone_sim.ros.vehicle.tuning_server import TuningServer
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.vehicle import Vehicle


class VehicleTopics:
    """The topics in the namespace of one vehicle, which may be another object after every start."""

    def __init__(self, simulation: Simulation, vehicle: Vehicle, inbox: Inbox):
        """Advertise, subscribe, and set its robot_description."""
        self.vehicle = vehicle
        self._inputs = VehicleInputs(simulation, vehicle.parameters, inbox)
        self._newcomers = Newcomers()
        self._outputs = VehicleOutputs(vehicle.parameters, self._newcomers)
        self._cameras = {
            name: CameraOutput(vehicle.parameters, camera, vehicle.parameters.cameras[name], self._newcomers)
            for name, camera in vehicle.cameras.items()
        }
        self._sensors = {
            name: SensorOutput(vehicle.parameters, sensor) for name, sensor in vehicle.instruments.by_name.items()
        }
        self._tuning = _tuning_server(vehicle, inbox)
        set_description(vehicle.parameters)

    @property
    def command_log(self) -> CommandLog:
        """What has come in."""
        return self._inputs.log

    def fits(self, vehicle: Vehicle) -> bool:
        """Whether these would be the topics of this vehicle, too."""
        return vehicle.parameters == self.vehicle.parameters

    def follow(self, vehicle: Vehicle) -> None:
        """Serve this vehicle from now on."""
        self.vehicle = vehicle
        for name, camera in vehicle.cameras.items():
            self._cameras[name].follow(camera)
        for name, sensor in vehicle.instruments.by_name.items():
            self._sensors[name].follow(sensor)
        self.show_tuning()

    def show_tuning(self) -> None:
        """Say what holds now of what may be tuned, where that is news."""
        if self._tuning is not None:
            self._tuning.follow(self.vehicle.tuning)

    def close(self) -> None:
        """Hear and publish no more."""
        self._inputs.close()
        self._outputs.close()
        if self._tuning is not None:
            self._tuning.close()
        for camera in self._cameras.values():
            camera.close()
        for sensor in self._sensors.values():
            sensor.close()

    def have_newcomers(self) -> bool:
        """Tell, once, whether somebody has begun to listen to pictures or state."""
        return bool(self._newcomers.take())

    def publish_state(self, stamp: Stamp) -> None:
        """Publish pictures and state."""
        for camera in self._cameras.values():
            camera.publish(stamp)
        self._outputs.publish_state(self.vehicle, stamp)

    def publish_readings(self, stamp: Stamp, now: float) -> None:
        """Publish what the sensors read in a step that ended at `now` (s of simulated time)."""
        for sensor in self._sensors.values():
            sensor.publish(stamp, now)

    def publish_joints(self, stamp: Callable[[], rospy.Time]) -> None:
        """Publish what becomes transforms elsewhere, too."""
        self._outputs.publish_joints(self.vehicle, stamp)

    def publish_command(self, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the command in force."""
        self._outputs.publish_command(self.vehicle, stamp)


def _tuning_server(vehicle: Vehicle, inbox: Inbox) -> TuningServer | None:
    """Return what tunes a vehicle, None for one in whose namespace the node's own server is."""
    if rospy.resolve_name(vehicle.name) != rospy.get_name():
        return TuningServer(vehicle.name, vehicle.tuning, inbox)
    rospy.logwarn(f"vehicle {vehicle.name} cannot be tuned in flight: it has the name of the node")
    return None
