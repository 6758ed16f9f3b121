"""~windows: views, dialogs and consoles that scripts have opened; ~window_answers: a user's answers to dialogs.

A floating view shows the pictures of a vehicle's camera or of a vision sensor of the scene.
"""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import String

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Vector
from drone_sim.ros.core import image_messages
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.publishing import Stamp
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.vision import Eye
from drone_sim.scripting.api.windows import read_answer
from drone_sim.vehicles.vehicle import Vehicle

_PERIOD = 0.1  # s of real time, between two messages
_PICTURE_PERIOD = 0.04  # s of real time, between two pictures of a sensor of the scene: every step, at 20 Hz
_MIN_COSINE = 0.95  # of the angle between two cameras that look the same way
_AHEAD = (0.0, 0.0, 1.0)  # in the frame of a camera or sensor
_MAX_LENGTH = 10_000  # characters of an answer


class WindowTopics:
    """Publishes the open windows as JSON when they change, and takes answers."""

    def __init__(self, simulation: Simulation, inbox: Inbox, stamp: Stamp):
        """Advertise and subscribe for `simulation`, whose thread runs the jobs in `inbox`; `stamp` is for pictures."""
        self._simulation, self._inbox, self._stamp = simulation, inbox, stamp
        self._windows = rospy.Publisher("~windows", String, queue_size=1, latch=True)
        self._answers = rospy.Subscriber("~window_answers", String, self._on_answer, queue_size=10)
        simulation.windows.readers.add(lambda: self._answers.get_num_connections() > 0)
        self._pictures = ViewPictures(simulation)
        self._throttle = Throttle(_PERIOD)
        self._shown = 0  # number of changes of the windows at the last message

    def update(self) -> None:
        """Publish the windows if they have changed, and the pictures of views."""
        self._pictures.publish(self._stamp)
        windows = self._simulation.windows
        if windows.changes == self._shown or not self._throttle.passes():
            return
        self._shown = windows.changes
        state: dict[str, list[dict[str, Any]]] = windows.state()
        topics = self._pictures.follow([view["sensor"] for view in state["views"]])
        for view, topic in zip(state["views"], topics):
            view["topic"] = topic
        self._windows.publish(json.dumps(state))

    def _on_answer(self, message: String) -> None:
        """Press a button before the next step."""
        try:
            if len(message.data) > _MAX_LENGTH:
                raise ValueError(f"has more than {_MAX_LENGTH} characters")
            answer = read_answer(json.loads(message.data))
        except (ValueError, RecursionError) as error:
            rospy.logwarn_throttle(1, f"window_answers: refused: {error}")
            return
        self._inbox.put(lambda: self._answer(*answer))

    def _answer(self, handle: int, button: str, typed: str) -> None:
        try:
            self._simulation.windows.answer(handle, button, typed)
        except ValueError as error:
            rospy.logwarn_throttle(1, f"window_answers: refused: {error}")


class ViewPictures:
    """Topics of the pictures in views. A vision sensor of the scene has a topic `~views/NAME` while a view shows it."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._throttle = Throttle(_PICTURE_PERIOD)
        self._publishers: dict[str, rospy.Publisher] = {}  # of sensors of the scene, by name

    def follow(self, sensors: list[str]) -> list[str]:
        """Return the picture topics of objects with these names; '' for an object that takes no pictures."""
        of_scene = {name for name in sensors if self._eye(name) is not None}
        for name in self._publishers.keys() - of_scene:
            self._publishers.pop(name).unregister()
        for name in of_scene - self._publishers.keys():
            self._publishers[name] = rospy.Publisher(self._own_topic(name), Image, queue_size=1)
        return [self._own_topic(name) if name in of_scene else self._vehicles_topic(name) for name in sensors]

    def publish(self, stamp: Stamp) -> None:
        """Publish pictures of sensors of the scene to subscribers, at most every _PICTURE_PERIOD."""
        watched = [name for name, publisher in self._publishers.items() if publisher.get_num_connections()]
        if not watched or not self._throttle.passes():
            return
        for name in watched:
            if (eye := self._eye(name)) is not None:
                message = image_messages.image(eye.picture("color"), "rgb8")
                message.header.stamp = stamp()
                self._publishers[name].publish(message)

    def _eye(self, name: str) -> Eye | None:
        objects = self._simulation.context.objects
        found = objects[objects.handle(name)] if name in objects else None
        return found if isinstance(found, Eye) else None

    def _own_topic(self, name: str) -> str:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
        objects = self._simulation.context.objects
        return rospy.resolve_name(f"~views/{plain if plain == name else f'{plain}_{objects.handle(name)}'}")

    def _vehicles_topic(self, name: str) -> str:
        """Return the topic of a vehicle's camera.

        For the two vision sensors of V-REP's quadricopter, which take no pictures here, this is the camera that looks
        the same way.
        """
        for vehicle in self._simulation.vehicles.values():
            cameras = vehicle.parameters.cameras.values()
            topics = {camera.object + vehicle.suffix: camera.topic for camera in cameras}
            name = name if name in topics else self._same_way(vehicle, name)
            if name in topics:
                return rospy.resolve_name(f"{vehicle.name}/{topics[name]}")
        return ""

    def _same_way(self, vehicle: Vehicle, name: str) -> str:
        """Return the object of the vehicle's camera that looks the same way as the object `name`; `name` for none."""
        objects = self._simulation.context.objects
        if name not in objects or not objects[objects.handle(name)].is_part_of(vehicle.object):
            return name

        def axis(named: str) -> Vector:
            return frames.rotate(objects[objects.handle(named)].matrix(), _AHEAD)

        cameras = vehicle.parameters.cameras.values()
        candidates = (camera.object + vehicle.suffix for camera in cameras if camera.kind == "color")
        return next((other for other in candidates if np.dot(axis(other), axis(name)) > _MIN_COSINE), name)
