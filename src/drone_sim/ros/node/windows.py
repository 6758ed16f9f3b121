"""~windows: what scripts have opened for a person to look at; ~window_answers: what that person says to a dialog.

What a floating view shows comes from a vehicle's camera, or from a vision sensor of the scene.
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
_SAME = 0.95  # cosine of the angle between axes that look the same way
_AHEAD = (0.0, 0.0, 1.0)  # in the frame of whatever looks
_LONGEST = 10_000  # characters of an answer


class WindowTopics:
    """Says what is open, as JSON, whenever it changes; who advertises answers may answer."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Advertise and subscribe for `simulation`, whose thread empties `inbox`."""
        self._simulation, self._inbox = simulation, inbox
        self._windows = rospy.Publisher("~windows", String, queue_size=1, latch=True)
        self._answers = rospy.Subscriber("~window_answers", String, self._on_answer, queue_size=10)
        simulation.windows.readers.add(lambda: self._answers.get_num_connections() > 0)
        self._pictures = ViewPictures(simulation)
        self._throttle = Throttle(_PERIOD)
        self._shown = 0  # the windows' changes, when they were

    def update(self, stamp: Stamp) -> None:
        """Say what is open, where that is news, and what views show."""
        self._pictures.publish(stamp)
        windows = self._simulation.windows
        if windows.changes == self._shown or not self._throttle.passes():
            return
        self._shown = windows.changes
        state: dict[str, list[dict[str, Any]]] = windows.state()
        topics = self._pictures.follow([one["sensor"] for one in state["views"]])
        for view, topic in zip(state["views"], topics):
            view["topic"] = topic
        self._windows.publish(json.dumps(state))

    def _on_answer(self, message: String) -> None:
        """Press a button before the next step."""
        try:
            if len(message.data) > _LONGEST:
                raise ValueError(f"has more than {_LONGEST} characters")
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
    """Topics of what is seen. A vision sensor of the scene has one, `~views/NAME`, as long as a view shows it."""

    def __init__(self, simulation: Simulation):
        """Take the simulation whose cameras and sensors are shown; begin without views."""
        self._simulation = simulation
        self._throttle = Throttle(_PICTURE_PERIOD)
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

        V-REP shows the pictures of its quadricopter's two vision sensors only in its window: here the camera that looks
        the same way stands for each.
        """
        for vehicle in self._simulation.vehicles.values():
            topics = {one.object + vehicle.suffix: one.topic for one in vehicle.parameters.cameras.values()}
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

        colors = (one.object + vehicle.suffix for one in vehicle.parameters.cameras.values() if one.kind == "color")
        return next((one for one in colors if np.dot(axis(one), axis(name)) > _SAME), name)
