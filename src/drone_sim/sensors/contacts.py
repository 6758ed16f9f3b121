"""What the vehicle touches: visualization_msgs/MarkerArray, for rviz and for programs, and the sum of it as a wrench.

Every marker is one contact: `ns` names what was touched, `text` says how hard, and the arrow goes from `points[0]`, the
place, along the force on the vehicle, one metre for each 10 N. ROS 1 has no message of its own for this: the usual
one, gazebo_msgs/ContactsState, comes with Gazebo. A sample is the hardest sub-step since the last one, so that no blow
is missed, however short.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from drone_sim.config.types import Name
from drone_sim.mechanics.frames import Vector, cross, position, rotate_back
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.sensors.sensor import Contact, Fields, Fitting, Instrument, Output, SensorParameters, Topic, xyz

_NEWTONS = 10.0  # of a marker's arrow, for each metre
_ARROW, _ADD = 0, 0  # visualization_msgs/Marker
_WIDTHS = {"x": 0.01, "y": 0.02, "z": 0.03}  # m: shaft, head, and the head's length
_RED = {"r": 0.9, "g": 0.1, "b": 0.1, "a": 1.0}
_SHOWN = 0.1  # s, at least, that rviz shows a marker


class ContactsParameters(SensorParameters):
    """All of the vehicle's collision shapes together; nothing is wrong with what is measured."""

    kind: Literal["contacts"]
    topic: Topic = "contacts"
    frame: Name = "base_link"

    suffixes = ("", "/wrench")

    def make(self, fitting: Fitting) -> Contacts:
        """Return the instrument; `reset` comes before its first look."""
        return Contacts(self, fitting)


class ContactsSample(NamedTuple):
    """The contacts of a sub-step, and their sum (N, N m) in the sensor's frame as it was then."""

    contacts: tuple[Contact, ...] = ()
    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)


class Contacts(Instrument):
    """Looks after every sub-step."""

    def __init__(self, parameters: ContactsParameters, fitting: Fitting):
        """Take when to report, and in which frame the sum is."""
        super().__init__(parameters, fitting)
        self.outputs = (
            Output("", "visualization_msgs/MarkerArray", self._markers),
            Output("/wrench", "geometry_msgs/WrenchStamped", self._wrench),
        )
        self._forget()

    def _forget(self) -> None:
        self._hardest, self._most = ContactsSample(), 0.0  # since the last sample, and its forces' sum in N

    def reset(self) -> None:
        """Begin anew."""
        super().reset()
        self._forget()

    def look(self, count: int) -> None:
        """Keep the hardest sub-step, then report it if it is time."""
        touched = self.carrier.contacts()
        force = sum(math.hypot(*one.force) for one in touched)
        if touched and force >= self._most:
            self._hardest, self._most = self._summed(touched), force
        super().look(count)

    def sample(self) -> ContactsSample:
        """Return the hardest sub-step since the last sample."""
        hardest = self._hardest
        self._forget()
        return hardest

    def _summed(self, contacts: list[Contact]) -> ContactsSample:
        pose = self.fitting.pose()
        x, y, z = position(pose)
        forces = [one.force for one in contacts]
        torques = [cross((one.point[0] - x, one.point[1] - y, one.point[2] - z), one.force) for one in contacts]
        force, torque = (rotate_back(pose, [sum(axis) for axis in zip(*vectors)]) for vectors in (forces, torques))
        return ContactsSample(tuple(contacts), force, torque)

    def save_state(self) -> Restore:
        """Return a function that brings back what it has seen since the last sample, too."""
        return in_turn(super().save_state(), saved(self, "_hardest", "_most"))

    # ---- messages

    def read(self) -> Fields | None:
        """Return the contacts as a script wants them: for each what, point, normal and force."""
        if self.latest is None:
            return None
        contacts = [
            {"what": one.what, "point": [*one.point], "normal": [*one.normal], "force": [*one.force]}
            for one in self.latest.value.contacts
        ]
        return {"header": self.header(self.latest), "contacts": contacts}

    def _markers(self, value: ContactsSample, header: Mapping[str, Any]) -> Fields:
        header = {**header, "frame_id": "world"}
        return {"markers": [self._marker(number, one, header) for number, one in enumerate(value.contacts)]}

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
            "lifetime": max(_SHOWN, 2 * self.interval),
            "points": [xyz(contact.point), xyz(end)],
            "text": f"{math.hypot(*contact.force):.6g} N",
        }

    def _wrench(self, value: ContactsSample, header: Mapping[str, Any]) -> Fields:
        return {"header": header, "wrench": {"force": xyz(value.force), "torque": xyz(value.torque)}}
