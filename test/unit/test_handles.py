"""Dragging a vehicle's handle in rviz, also across start, stop, snapshots and removal of the vehicle."""

from unittest import mock

import pytest

pytest.importorskip("rospy", reason="needs ROS")
pytest.importorskip("visualization_msgs", reason="needs ROS")

from visualization_msgs.msg import InteractiveMarkerFeedback

from drone_sim.forces.pushes import Push
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.rviz import handles
from drone_sim.ros.rviz.handles import TIMEOUT, HeldHandles


@pytest.fixture
def dragged(monkeypatch, new_simulation):
    """Return a simulation and its inbox, in which a drag to x = 2 m is waiting."""
    monkeypatch.setattr(handles, "MarkerServer", mock.MagicMock())
    simulation, inbox = new_simulation({"script": ""}), Inbox()
    shown = handles.VehicleHandles(simulation, inbox)
    feedback = InteractiveMarkerFeedback(event_type=InteractiveMarkerFeedback.POSE_UPDATE, marker_name="Drone")
    feedback.pose.position.x, feedback.pose.position.z, feedback.pose.orientation.w = 2.0, 1.0, 1.0
    shown._on_feedback(feedback)
    return simulation, inbox


def test_a_waiting_drag_moves_the_vehicle_after_a_restart(dragged):
    simulation, inbox = dragged
    simulation.start()
    inbox.run_jobs()
    assert simulation.drone.body.state.position == pytest.approx((2, 0, 1))


def test_a_waiting_drag_of_a_removed_vehicle_moves_nothing(dragged):
    simulation, inbox = dragged
    simulation.set_vehicles({"other": {}})
    inbox.run_jobs()
    assert simulation.vehicles["other"].body.state.position[0] == 0


class HandleClient:
    """Client that sends feedback on the handle of the drone."""

    def __init__(self, shown, simulation, inbox):
        self.shown, self.simulation, self.inbox = shown, simulation, inbox

    def send(self, kind, *place):
        feedback = InteractiveMarkerFeedback(event_type=kind, marker_name="Drone", client_id="hand")
        feedback.pose.orientation.w = 1.0
        if place:
            feedback.pose.position.x, feedback.pose.position.y, feedback.pose.position.z = place
        self.shown._on_feedback(feedback)
        self.inbox.run_jobs()

    def fly(self, steps):
        for _ in range(steps):
            self.simulation.step()
            self.shown.update()

    @property
    def state(self):
        return self.simulation.drone.body.state


@pytest.fixture(name="hand")
def _hand(monkeypatch, new_simulation):
    monkeypatch.setattr(handles, "MarkerServer", mock.MagicMock())
    simulation, inbox = new_simulation({"script": "", "weather": {"wind": [5, 0, 0]}}), Inbox()
    return HandleClient(handles.VehicleHandles(simulation, inbox), simulation, inbox)


DOWN, MOVED, UP = (
    InteractiveMarkerFeedback.MOUSE_DOWN,
    InteractiveMarkerFeedback.POSE_UPDATE,
    InteractiveMarkerFeedback.MOUSE_UP,
)


def test_a_held_vehicle_stays_in_place_and_continues_from_rest(hand):
    hand.fly(20)
    hand.send(DOWN)
    held = hand.state.position
    hand.fly(20)
    assert hand.state.position == held and hand.state.linear_velocity == (0, 0, 0)
    hand.send(MOVED, 1.0, 2.0, 3.0)
    hand.simulation.drone.pushes.add(Push((3, 0, 0), (0, 0, 0), 0.2))
    hand.fly(40)
    assert hand.state.position == pytest.approx((1, 2, 3)) and hand.state.linear_velocity == (0, 0, 0)
    objects = hand.simulation.context.objects
    base = objects.handle("Quadricopter_base")
    assert hand.simulation.context.velocities.velocity(base)[0] == (0, 0, 0), "the script measures no velocity either"
    hand.send(UP)
    hand.fly(1)
    assert abs(hand.state.linear_velocity[2]) < 0.5, "it is at rest when released"
    hand.fly(100)
    assert hand.state.position[2] == pytest.approx(0.8, abs=0.05), "the controller returns it to its height"


def test_a_vehicle_is_released_when_its_client_stops_sending(hand):
    hand.shown._held._clock = lambda: 0.0
    hand.send(DOWN)
    assert hand.simulation.drone.body.is_held
    hand.shown._held._clock = lambda: 5.0
    hand.fly(1)
    assert not hand.simulation.drone.body.is_held


@pytest.mark.parametrize("begin", ["start", "stop"])
def test_start_and_stop_release_a_held_vehicle(hand, begin):
    hand.send(DOWN)
    getattr(hand.simulation, begin)()
    assert not hand.simulation.drone.body.is_held


def test_restoring_a_snapshot_releases_the_vehicle_and_repeats_the_flight(hand):
    hand.fly(5)
    snapshot = hand.simulation.snapshot()
    hand.fly(20)
    flown = hand.state
    hand.simulation.restore(snapshot)
    hand.send(DOWN)
    hand.simulation.restore(snapshot)
    hand.send(UP)
    hand.fly(20)
    assert hand.state == flown


def test_a_held_vehicle_can_be_removed(hand):
    hand.send(DOWN)
    hand.simulation.set_vehicles({"other": {}})
    hand.fly(1)
    hand.send(UP)
    hand.fly(1)
    assert not hand.simulation.vehicles["other"].body.is_held


# ---- HeldHandles


PRESSED, ALIVE, RELEASED = (
    InteractiveMarkerFeedback.MOUSE_DOWN,
    InteractiveMarkerFeedback.KEEP_ALIVE,
    InteractiveMarkerFeedback.MOUSE_UP,
)


def send_feedback(held, kind, client):
    held.on_feedback(InteractiveMarkerFeedback(marker_name="Drone", client_id=client, event_type=kind))


def test_a_handle_is_held_until_all_clients_release_it(clock):
    held = HeldHandles(clock)
    send_feedback(held, PRESSED, "rviz 1")
    send_feedback(held, PRESSED, "rviz 2")
    send_feedback(held, RELEASED, "rviz 1")
    assert held.names() == {"Drone"}
    send_feedback(held, RELEASED, "rviz 2")
    assert held.names() == set()


def test_a_handle_is_released_if_its_client_sends_no_keep_alive(clock):
    held = HeldHandles(clock)
    send_feedback(held, PRESSED, "rviz")
    for _ in range(10):
        clock.now += 0.75 * TIMEOUT
        assert held.names() == {"Drone"}
        send_feedback(held, ALIVE, "rviz")
        send_feedback(held, ALIVE, "another rviz, which does not hold it")
    clock.now += TIMEOUT
    assert held.names() == set()
    send_feedback(held, ALIVE, "rviz")
    assert held.names() == set(), "a keep-alive does not hold a released handle"
