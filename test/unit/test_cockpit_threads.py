"""Races between threads of the cockpit: the selected vehicle appears or is removed while a command is sent."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.ros.cockpit import teleop
from drone_sim.ros.tools.commands import Command


class Publisher:
    def __init__(self, *_, **__):
        self.is_registered = True
        self.sent = 0
        self.connections = iter(())

    def publish(self, _message):
        if not self.is_registered:
            raise rospy.ROSException("publish() to an unregistered() handle")
        self.sent += 1

    def get_num_connections(self):
        return next(self.connections, 0)

    def unregister(self):
        self.is_registered = False
        Publisher.gone()


def test_a_vehicle_removed_while_a_command_is_sent_raises_no_error(monkeypatch):
    commands = teleop.CommandPublisher()
    monkeypatch.setattr(teleop.rospy, "Publisher", Publisher)
    monkeypatch.setattr(
        Publisher, "gone", lambda: commands.send(Command(1.0, 0.0, 0.0, 0.0)), raising=False
    )  # as another thread would
    commands.choose("drone")
    commands.choose("")
    assert commands.vehicle == ""


def test_a_request_waits_until_a_new_vehicle_has_subscribed(monkeypatch):
    monkeypatch.setattr(teleop.rospy, "Publisher", Publisher)
    commands = teleop.CommandPublisher(patience=60.0)
    commands.choose("drone")
    land = commands._requests["land"]
    land.connections = iter((0, 0, 1))
    assert commands.request("land") == "land sent to drone"
    assert land.sent == 1


@pytest.mark.parametrize("vehicle", ["", "drone"])
def test_a_request_without_a_subscriber_is_refused(monkeypatch, vehicle):
    monkeypatch.setattr(teleop.rospy, "Publisher", Publisher)
    commands = teleop.CommandPublisher(patience=0.0)
    commands.choose(vehicle)
    with pytest.raises(ValueError, match=r"^no subscriber on land$"):
        commands.request("land")
