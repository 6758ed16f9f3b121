"""The topics of all vehicles, as they come and go."""

from __future__ import annotations

import gc
from collections.abc import Callable

import rospy

from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.node.step_time import Stamp
from drone_sim.ros.vehicle.transforms import Transforms
from drone_sim.ros.vehicle.vehicle_topics import VehicleTopics
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.simulation import Simulation


class FleetTopics:
    """Topics for every vehicle of a simulation, and their frames."""

    def __init__(self, simulation: Simulation, inbox: Inbox, stamp: Stamp):
        """Advertise for those that are there; `stamp` returns that of what is sent now."""
        self._simulation = simulation
        self._inbox = inbox
        self._stamp = stamp
        self._topics: dict[str, VehicleTopics] = {}
        self._transforms = Transforms()
        self._era = self._tunings = -1
        self.follow()

    def follow(self) -> None:
        """Advertise for vehicles that have come, and no more for those that have gone; say what has been tuned."""
        simulation = self._simulation
        if self._era != simulation.era:
            self._follow_vehicles()
        elif self._tunings != simulation.shared.tunings:
            for topics in self._topics.values():
                topics.show_tuning()
        self._tunings = simulation.shared.tunings

    def _follow_vehicles(self) -> None:
        self._era = self._simulation.era
        vehicles = self._simulation.vehicles
        for name, topics in list(self._topics.items()):
            if name not in vehicles or not topics.fits(vehicles[name]):
                del self._topics[name]
                topics.close()
        for name, vehicle in vehicles.items():
            if name in self._topics:
                self._topics[name].follow(vehicle)
            else:
                self._topics[name] = VehicleTopics(self._simulation, vehicle, self._inbox)
        self._transforms.tell_fixed(vehicles.values(), self._stamp)
        # rospy's topics hold on to themselves, and each has a descriptor (epoll) open until the collector comes by.
        gc.collect()

    def command_logs(self) -> dict[str, CommandLog]:
        """Return what has come in, by vehicle."""
        return {name: topics.command_log for name, topics in self._topics.items()}

    def publish_state(self, stamp: Stamp) -> None:
        """Publish pictures and state of every vehicle, under what `stamp` returns."""
        for topics in self._topics.values():
            topics.publish_state(stamp)

    def publish_readings(self, stamp: Stamp) -> None:
        """Publish what the sensors of every vehicle read in the step that has just been."""
        for topics in self._topics.values():
            topics.publish_readings(stamp, self._simulation.time)

    def publish_transforms(self, stamp: Callable[[], rospy.Time]) -> None:
        """Publish what is or becomes transforms: tf2 takes but one for each stamp."""
        for topics in self._topics.values():
            topics.publish_joints(stamp)
        self._transforms.publish(self._simulation.vehicles.values(), stamp)

    def tell_newcomers(self, stamp: Callable[[], rospy.Time]) -> bool:
        """Tell transforms to those who have not heard them; return whether somebody waits for pictures or state."""
        self._transforms.tell_newcomers(self._simulation.vehicles.values(), stamp)
        return any([topics.have_newcomers() for topics in self._topics.values()])

    def publish_command(self, stamp: Callable[[], rospy.Time]) -> None:
        """Publish the commands in force; they may change while the simulation stands."""
        for topics in self._topics.values():
            topics.publish_command(stamp)
