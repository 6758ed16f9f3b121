"""What two threads of the cockpit do at once: what is drawn is sent, a gain is moved, a vehicle goes that is flown."""

import asyncio
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")
pytest.importorskip("viser")

import rospy
from dynamic_reconfigure.encoding import encode_config
from viser import _messages
from viser.infra import _infra

from drone_sim.ros.cockpit import teleop
from drone_sim.ros.cockpit.panel import tuning as tuning_module
from drone_sim.ros.cockpit.panel.tuning import VehicleTuning
from drone_sim.ros.cockpit.server.page_server import leave_to_the_loop
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
    tuning = VehicleTuning(SimpleNamespace(add_folder=lambda _name: None), print)
    field = tuning._fields["Kzref"] = SimpleNamespace(value=1.0)
    tuning._values, tuning._is_news = {"Kzref": 5.0}, True
    tuning.show()
    assert field.value == 5.0
    field.value = 6.0  # by a hand
    tuning.show()
    assert field.value == 6.0


def test_what_a_hand_goes_on_to_write_is_not_overwritten_by_the_answer_to_its_beginning(monkeypatch):
    """Who writes 2.5 asks for 2 first, which holds when the 5 is there."""
    tuning = VehicleTuning(SimpleNamespace(add_folder=lambda _name: None), print)
    field = tuning._fields["Kzref"] = SimpleNamespace(value=2.0)
    asked = []

    def answer(_server, name, value, _say):
        asked.append(value)
        if value == 2.0:
            tuning._wanted[name] = field.value = 2.5  # meanwhile
        return encode_config({name: value})

    monkeypatch.setattr(tuning_module, "_reconfigure", answer)
    tuning._wanted["Kzref"] = 2.0
    for _ in "2", "5":
        tuning._set("drone", "Kzref")
        tuning.show()
        assert field.value == 2.5
    tuning._set("drone", "Kzref")  # by a thread whose value another one has asked for
    assert asked == [2.0, 2.5] and not tuning._wanted


def test_a_vehicle_that_goes_while_commands_are_sent_ends_nobody(monkeypatch):
    told = teleop.CommandPublisher()
    monkeypatch.setattr(teleop.rospy, "Publisher", Publisher)
    monkeypatch.setattr(
        Publisher, "gone", lambda: told.send(Command(1.0, 0.0, 0.0, 0.0)), raising=False
    )  # another thread, just then
    told.choose("drone")
    told.choose("")
    assert told.vehicle == ""


def test_a_thread_that_draws_leaves_it_to_the_event_loop_to_wake_who_sends(monkeypatch):
    monkeypatch.setattr(_infra, "AsyncMessageBuffer", _infra.AsyncMessageBuffer)  # put back afterwards
    leave_to_the_loop()

    async def draw():
        loop = asyncio.get_running_loop()
        buffer = _infra.AsyncMessageBuffer(loop, persistent_messages=True)
        sender = loop.create_task(buffer.message_event.wait())
        await asyncio.sleep(0)  # it waits now
        (waiting,) = buffer.message_event._waiters

        def push():
            buffer.atomic_start()  # until its end the loop itself is not told
            buffer.push(_messages.ResetGuiMessage())
            is_touched = waiting.done()
            buffer.atomic_end()
            return is_touched

        touched = await asyncio.to_thread(push)
        await asyncio.wait_for(sender, 10)
        return touched

    assert not asyncio.run(draw())
