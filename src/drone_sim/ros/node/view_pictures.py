"""Where the pictures of floating views come from: a vehicle's camera, or a vision sensor of the scene."""

from __future__ import annotations

import re

import rospy
from cv_bridge import CvBridge
from sensor_msgs.msg import Image

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Vector
from drone_sim.ros.node.step_time import Stamp
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.vision import Eye
from drone_sim.vehicles.vehicle import Vehicle

_PERIOD = 0.04  # s of real time, between two pictures of a sensor of the scene: every step, at 20 Hz
_SAME = 0.95  # cosine of the angle between axes that look the same way
_AHEAD = (0.0, 0.0, 1.0)  # in the frame of whatever looks


class ViewPictures:
    """Topics of what is seen. A vision sensor of the scene has one, `~views/NAME`, as long as a view shows it."""

    def __init__(self, simulation: Simulation):
        """Begin without views."""
        self._simulation = simulation
        self._bridge = CvBridge()
        self._throttle = Throttle(_PERIOD)
        self._publishers: dict[str, rospy.Publisher] = {}  # of sensors of the scene, by name

    def follow(self, sensors: list[str]) -> list[str]:
        """Return the topics of what sensors see, by the names of their objects; '' where nobody takes pictures."""
        own = {name for name in sensors if self._eye(name) is not None}
        for name in self._publishers.keys() - own:
            self._publishers.pop(name).unregister()
        for name in own - self._publishers.keys():
            self._publishers[name] = rospy.Publisher(self._own_topic(name), Image, queue_size=1)
        return [self._own_topic(name) if name in own else self._vehicles_topic(name) for name in sensors]

    def publish(self, stamp: Stamp) -> None:
        """Publish what sensors of the scene see, a few times a second, where somebody listens."""
        watched = [name for name, one in self._publishers.items() if one.get_num_connections()]
        if not watched or not self._throttle.passes():
            return
        for name in watched:
            eye = self._eye(name)
            if eye is not None:
                message = self._bridge.cv2_to_imgmsg(eye.picture("color"), "rgb8")
                message.header.stamp = stamp()
                self._publishers[name].publish(message)

    def _eye(self, name: str) -> Eye | None:
        objects = self._simulation.shared.objects
        found = objects[objects.handle(name)] if name in objects else None
        return found if isinstance(found, Eye) else None

    def _own_topic(self, name: str) -> str:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
        objects = self._simulation.shared.objects
        return rospy.resolve_name(f"~views/{plain if plain == name else f'{plain}_{objects.handle(name)}'}")

    def _vehicles_topic(self, name: str) -> str:
        """Return the topic of a vehicle's camera.

        V-REP's two on its quadricopter have a picture in its window alone: the one that looks the same way shows it.
        """
        for vehicle in self._simulation.vehicles.values():
            topics = {one.object + vehicle.suffix: one.topic for one in vehicle.parameters.cameras.values()}
            name = name if name in topics else self._same_way(vehicle, name)
            if name in topics:
                return rospy.resolve_name(f"{vehicle.name}/{topics[name]}")
        return ""

    def _same_way(self, vehicle: Vehicle, name: str) -> str:
        """Return the object of a vehicle's camera that looks as another object of it does; its own name for none."""
        objects = self._simulation.shared.objects
        if name not in objects or not objects[objects.handle(name)].is_part_of(vehicle.own_object):
            return name
        axis = self._axis(name)
        colors = (one.object + vehicle.suffix for one in vehicle.parameters.cameras.values() if one.kind == "color")
        return next((one for one in colors if _dot(self._axis(one), axis) > _SAME), name)

    def _axis(self, name: str) -> Vector:
        objects = self._simulation.shared.objects
        return frames.rotate(objects[objects.handle(name)].matrix(), _AHEAD)


def _dot(one: Vector, other: Vector) -> float:
    return sum(a * b for a, b in zip(one, other))
