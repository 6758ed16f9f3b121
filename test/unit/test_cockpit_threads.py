"""What two threads of the cockpit do at once: a vehicle comes, or goes, that is flown."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.ros.cockpit import teleop
from drone_sim.ros.tools.commands import Command


class Publisher:
    def __init__(self, *_, **__):
        self.there = True
        self.sent = 0
        self.connections = iter(())

    def publish(self, _message):
        if not self.there:
            raise rospy.ROSException("publish() to an unregistered() handle")
        self.sent += 1

    def get_num_connections(self):
        return next(self.connections, 0)

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


def test_a_request_waits_until_a_vehicle_that_has_just_come_hears_it(monkeypatch):
    monkeypatch.setattr(teleop.rospy, "Publisher", Publisher)
    told = teleop.CommandPublisher(patience=60.0)
    told.choose("drone")
    land = told._requests["land"]
    land.connections = iter((0, 0, 1))
    assert told.request("land") == "land sent to drone"
    assert land.sent == 1


@pytest.mark.parametrize("vehicle", ["", "drone"])
def test_a_request_that_nobody_hears_says_so(monkeypatch, vehicle):
    monkeypatch.setattr(teleop.rospy, "Publisher", Publisher)
    told = teleop.CommandPublisher(patience=0.0)
    told.choose(vehicle)
    with pytest.raises(ValueError, match=r"^no subscriber on land$"):
        told.request("land")
