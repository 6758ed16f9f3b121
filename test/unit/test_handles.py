"""A handle that is dragged while the simulation starts anew, or its vehicle goes."""

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
    """Return a simulation, and the inbox in which a drag to x = 2 m waits."""
    monkeypatch.setattr(handles, "MarkerServer", mock.MagicMock())
    simulation, inbox = new_simulation({"script": ""}), Inbox()
    shown = handles.VehicleHandles(simulation, inbox)
    feedback = InteractiveMarkerFeedback(event_type=InteractiveMarkerFeedback.POSE_UPDATE, marker_name="Drone")
    feedback.pose.position.x, feedback.pose.position.z, feedback.pose.orientation.w = 2.0, 1.0, 1.0
    shown._on_feedback(feedback)
    return simulation, inbox


def test_it_moves_the_vehicle_that_is_there_by_then(dragged):
    simulation, inbox = dragged
    simulation.start()
    inbox.run_jobs()
    assert simulation.drone.body.state.position == pytest.approx((2, 0, 1))


def test_it_moves_nothing_where_the_vehicle_has_gone(dragged):
    simulation, inbox = dragged
    simulation.set_vehicles({"other": {}})
    inbox.run_jobs()
    assert simulation.vehicles["other"].body.state.position[0] == 0


class Hand:
    """Somebody who holds the drone's handle, and says so."""

    def __init__(self, shown, simulation, inbox):
        self.shown, self.simulation, self.inbox = shown, simulation, inbox

    def tell(self, kind, *place):
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
    return Hand(handles.VehicleHandles(simulation, inbox), simulation, inbox)


DOWN, MOVED, UP = (
    InteractiveMarkerFeedback.MOUSE_DOWN,
    InteractiveMarkerFeedback.POSE_UPDATE,
    InteractiveMarkerFeedback.MOUSE_UP,
)


def test_a_vehicle_stands_still_while_it_is_held_and_flies_on_from_rest(hand):
    hand.fly(20)
    hand.tell(DOWN)
    held = hand.state.position
    hand.fly(20)
    assert hand.state.position == held and hand.state.linear_velocity == (0, 0, 0)
    hand.tell(MOVED, 1.0, 2.0, 3.0)
    hand.simulation.drone.pushes.add(Push((3, 0, 0), (0, 0, 0), 0.2))
    hand.fly(40)
    assert hand.state.position == pytest.approx((1, 2, 3)) and hand.state.linear_velocity == (0, 0, 0)
    objects = hand.simulation.context.objects
    base = objects.handle("Quadricopter_base")
    assert hand.simulation.context.velocities.velocity(base)[0] == (0, 0, 0), "nor does the script measure a speed"
    hand.tell(UP)
    hand.fly(1)
    assert abs(hand.state.linear_velocity[2]) < 0.5, "let go at rest"
    hand.fly(100)
    assert hand.state.position[2] == pytest.approx(0.8, abs=0.05), "the controller goes on"


def test_who_is_silent_for_a_second_lets_go(hand):
    hand.shown._held._clock = lambda: 0.0
    hand.tell(DOWN)
    assert hand.simulation.drone.body.is_held
    hand.shown._held._clock = lambda: 5.0
    hand.fly(1)
    assert not hand.simulation.drone.body.is_held


@pytest.mark.parametrize("begin", ["start", "stop"])
def test_a_start_and_a_stop_let_go(hand, begin):
    hand.tell(DOWN)
    getattr(hand.simulation, begin)()
    assert not hand.simulation.drone.body.is_held


def test_a_restored_snapshot_lets_go_and_flies_on_as_before(hand):
    hand.fly(5)
    snapshot = hand.simulation.snapshot()
    hand.fly(20)
    flown = hand.state
    hand.simulation.restore(snapshot)
    hand.tell(DOWN)
    hand.simulation.restore(snapshot)
    hand.tell(UP)
    hand.fly(20)
    assert hand.state == flown


def test_a_held_vehicle_may_go(hand):
    hand.tell(DOWN)
    hand.simulation.set_vehicles({"other": {}})
    hand.fly(1)
    hand.tell(UP)
    hand.fly(1)
    assert not hand.simulation.vehicles["other"].body.is_held


# ---- handles that somebody holds


TAKEN, HELD, LET_GO = (
    InteractiveMarkerFeedback.MOUSE_DOWN,
    InteractiveMarkerFeedback.KEEP_ALIVE,
    InteractiveMarkerFeedback.MOUSE_UP,
)


def told(held, kind, client):
    held.on_feedback(InteractiveMarkerFeedback(marker_name="Drone", client_id=client, event_type=kind))


def test_a_handle_is_held_until_it_is_let_go_of(clock):
    held = HeldHandles(clock)
    told(held, TAKEN, "rviz 1")
    told(held, TAKEN, "rviz 2")
    told(held, LET_GO, "rviz 1")
    assert held.names() == {"Drone"}
    told(held, LET_GO, "rviz 2")
    assert held.names() == set()


def test_a_hand_that_says_nothing_has_let_go(clock):
    held = HeldHandles(clock)
    told(held, TAKEN, "rviz")
    for _ in range(10):
        clock.now += 0.75 * TIMEOUT
        assert held.names() == {"Drone"}
        told(held, HELD, "rviz")
        told(held, HELD, "another rviz, which does not hold it")
    clock.now += TIMEOUT
    assert held.names() == set()
    told(held, HELD, "rviz")
    assert held.names() == set(), "it comes back only when it is taken again"
