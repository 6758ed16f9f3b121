"""What a sensor publishes, whatever its kind: its readings as the messages that it says they make."""

from __future__ import annotations

from typing import NamedTuple

import genpy
import rospy

from drone_sim.ros.node.step_time import Stamp
from drone_sim.ros.vehicle import frame_names
from drone_sim.ros.vehicle.filling import fill, message_class
from drone_sim.sensors.parameters import SensorParameters
from drone_sim.sensors.sensor import Instrument, Output
from drone_sim.vehicles.parameters import VehicleParameters

_QUEUE = 100  # messages: half a second at 200 Hz, which come ten at a time


class _Topic(NamedTuple):
    publisher: rospy.Publisher
    made: type[genpy.Message]
    output: Output


class SensorOutput:
    """One sensor: a topic for each of its outputs; a message that nobody listens to is not made."""

    def __init__(self, vehicle: VehicleParameters, sensor: Instrument):
        """Advertise in the vehicle's namespace. Raises ValueError for a message that is not installed."""
        own: SensorParameters = sensor.parameters
        self._frame = frame_names.frame(vehicle, own.frame)
        self._base = f"{vehicle.name}/{own.topic}"
        self._topics: list[_Topic] = []
        self.follow(sensor)

    def follow(self, sensor: Instrument) -> None:
        """Publish what this sensor reads from now on; it may have taken the place of the last one."""
        old = {topic.output.suffix: topic.publisher for topic in self._topics}
        self._sensor = sensor
        self._topics = []
        for output in sensor.outputs:
            made = message_class(output.kind)
            name = f"{self._base}{output.suffix}"
            publisher = old.get(output.suffix) or rospy.Publisher(name, made, queue_size=_QUEUE)
            self._topics.append(_Topic(publisher, made, output))

    def close(self) -> None:
        """Advertise no more."""
        for topic in self._topics:
            topic.publisher.unregister()

    def publish(self, stamp: Stamp, now: float) -> None:
        """Publish the readings of a step that ended at `now` (s of simulated time), each as of when it was measured."""
        sensor = self._sensor
        heard = [topic for topic in self._topics if topic.publisher.get_num_connections()]
        for reading in sensor.readings if heard else ():
            measured = sensor.header(reading)["stamp"]
            header = {"stamp": stamp(now - measured), "frame_id": self._frame}
            for publisher, made, output in heard:
                publisher.publish(fill(made(), output.fields(reading.value, header), output.kind))
