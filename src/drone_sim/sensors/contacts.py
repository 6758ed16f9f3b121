"""Contact sensor: the vehicle's contacts as visualization_msgs/MarkerArray, and their sum as a wrench.

Each marker is one contact: `ns` is the name of the other object, `text` the force, and the arrow goes from the contact
point `points[0]` along the force on the vehicle, 1 m per 10 N. The usual message for contacts,
gazebo_msgs/ContactsState, comes with Gazebo, not with ROS 1. A sample is the sub-step with the largest force since the
last sample, so that even a short impact is reported.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from drone_sim.config.types import Name
from drone_sim.mechanics.frames import Vector, cross, position, rotate_back
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.sensors.sensor import Contact, Fields, Instrument, Mounting, Output, SensorParameters, Topic, xyz

_NEWTONS = 10.0  # per metre of a marker's arrow
_ARROW, _ADD = 0, 0  # visualization_msgs/Marker
_WIDTHS = {"x": 0.01, "y": 0.02, "z": 0.03}  # m: shaft, head, and the head's length
_RED = {"r": 0.9, "g": 0.1, "b": 0.1, "a": 1.0}
_MIN_LIFETIME = 0.1  # s, of a marker in rviz


class ContactsParameters(SensorParameters):
    """A contact sensor of all collision shapes of the vehicle, without noise."""

    kind: Literal["contacts"]
    topic: Topic = "contacts"
    frame: Name = "base_link"

    suffixes = ("", "/wrench")

    def make(self, mounting: Mounting) -> Contacts:
        return Contacts(self, mounting)


class ContactsSample(NamedTuple):
    """The contacts of a sub-step, and the sum of their wrenches (N, N m) in the sensor's frame at that time."""

    contacts: tuple[Contact, ...] = ()
    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)


class Contacts(Instrument):
    """Reads the contacts after every sub-step."""

    def __init__(self, parameters: ContactsParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        self.outputs = (
            Output("", "visualization_msgs/MarkerArray", self._markers),
            Output("/wrench", "geometry_msgs/WrenchStamped", self._wrench),
        )
        self._clear()

    def _clear(self) -> None:
        self._hardest, self._max_force = ContactsSample(), 0.0  # since the last sample; sum of force magnitudes, N

    def reset(self) -> None:
        super().reset()
        self._clear()

    def look(self, count: int) -> None:
        """Keep the contacts with the largest force, then sample if due."""
        contacts = self.carrier.contacts()
        force = sum(math.hypot(*contact.force) for contact in contacts)
        if contacts and force >= self._max_force:
            self._hardest, self._max_force = self._sum(contacts), force
        super().look(count)

    def sample(self) -> ContactsSample:
        """Return the contacts of the sub-step with the largest force since the last sample."""
        hardest = self._hardest
        self._clear()
        return hardest

    def _sum(self, contacts: list[Contact]) -> ContactsSample:
        pose = self.mounting.pose()
        x, y, z = position(pose)
        forces = [contact.force for contact in contacts]
        torques = [cross((c.point[0] - x, c.point[1] - y, c.point[2] - z), c.force) for c in contacts]
        force, torque = (rotate_back(pose, [sum(axis) for axis in zip(*vectors)]) for vectors in (forces, torques))
        return ContactsSample(tuple(contacts), force, torque)

    def save_state(self) -> Restore:
        return in_turn(super().save_state(), saved(self, "_hardest", "_max_force"))

    # ---- messages

    def read(self) -> Fields | None:
        """Return the contacts for scripts, each with `what`, `point`, `normal` and `force`."""
        if self.latest is None:
            return None
        contacts = [
            {"what": c.what, "point": [*c.point], "normal": [*c.normal], "force": [*c.force]}
            for c in self.latest.value.contacts
        ]
        return {"header": self.header(self.latest), "contacts": contacts}

    def _markers(self, value: ContactsSample, header: Mapping[str, Any]) -> Fields:
        header = {**header, "frame_id": "world"}
        return {"markers": [self._marker(number, contact, header) for number, contact in enumerate(value.contacts)]}

    def _marker(self, number: int, contact: Contact, header: Mapping[str, Any]) -> Fields:
        end = [place + newtons / _NEWTONS for place, newtons in zip(contact.point, contact.force)]
        return {
            "header": header,
            "ns": contact.what,
            "id": number,
            "type": _ARROW,
            "action": _ADD,
            "pose": {"orientation": {"w": 1.0}},
            "scale": _WIDTHS,
            "color": _RED,
            "lifetime": max(_MIN_LIFETIME, 2 * self.interval),
            "points": [xyz(contact.point), xyz(end)],
            "text": f"{math.hypot(*contact.force):.6g} N",
        }

    def _wrench(self, value: ContactsSample, header: Mapping[str, Any]) -> Fields:
        return {"header": header, "wrench": {"force": xyz(value.force), "torque": xyz(value.torque)}}
