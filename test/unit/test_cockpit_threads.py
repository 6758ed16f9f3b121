"""What two threads of the cockpit do at once: a vehicle goes that is flown."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.ros.cockpit import teleop
from drone_sim.ros.tools.commands import Command


class Publisher:
    def __init__(self, *_, **__):
        self.there = True

    def publish(self, _message):
        if not self.there:
            raise rospy.ROSException("publish() to an unregistered() handle")

    def unregister(self):
        self.there = False
        Publisher.gone()


def test_a_vehicle_that_goes_while_commands_are_sent_ends_nobody(monkeypatch):
    told = teleop.CommandPublisher()
    monkeypatch.setattr(teleop.rospy, "Publisher", Publisher)
    monkeypatch.setattr(
        Publisher, "gone", lambda: told.send(Command(1.0, 0.0, 0.0, 0.0)), raising=False
    )  # another thread, just then
    told.choose("drone")
    told.choose("")
    assert told.vehicle == ""
