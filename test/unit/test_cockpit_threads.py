"""What two threads of the cockpit do at once: a gain that is moved, and a vehicle that goes while a key is held."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.ros.cockpit.flying import commanding
from drone_sim.ros.cockpit.panel.tuning import Tuning
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


def test_a_field_that_was_moved_is_not_overwritten_before_it_is_read():
    tuning = Tuning(SimpleNamespace(add_folder=lambda _name: None), print)
    field = tuning._fields["Kzref"] = SimpleNamespace(value=1.0)
    tuning._values, tuning._is_news = {"Kzref": 5.0}, True
    tuning.show()
    assert field.value == 5.0
    field.value = 6.0  # by a hand
    tuning.show()
    assert field.value == 6.0


def test_a_vehicle_that_goes_while_commands_are_sent_ends_nobody(monkeypatch):
    told = commanding.Commanding()
    monkeypatch.setattr(commanding.rospy, "Publisher", Publisher)
    monkeypatch.setattr(
        Publisher, "gone", lambda: told.send(Command(1.0, 0.0, 0.0, 0.0)), raising=False
    )  # another thread, just then
    told.choose("drone")
    told.choose("")
    assert told.vehicle == ""
