"""Handles that somebody holds, told by what is said of them."""

import pytest

pytest.importorskip("visualization_msgs", reason="needs ROS")

from visualization_msgs.msg import InteractiveMarkerFeedback

from drone_sim.ros.rviz.handles import TIMEOUT, HeldHandles

TAKEN, HELD, LET_GO = (
    InteractiveMarkerFeedback.MOUSE_DOWN,
    InteractiveMarkerFeedback.KEEP_ALIVE,
    InteractiveMarkerFeedback.MOUSE_UP,
)


class Clock:
    def __init__(self):
        self.now = 5.0

    def __call__(self):
        return self.now


def told(held, kind, client):
    held.on_feedback(InteractiveMarkerFeedback(marker_name="Drone", client_id=client, event_type=kind))


def test_a_handle_is_held_until_it_is_let_go_of():
    held = HeldHandles(Clock())
    told(held, TAKEN, "rviz 1")
    told(held, TAKEN, "rviz 2")
    told(held, LET_GO, "rviz 1")
    assert held.names() == {"Drone"}
    told(held, LET_GO, "rviz 2")
    assert held.names() == set()


def test_a_hand_that_says_nothing_has_let_go():
    clock = Clock()
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
