"""Handles that somebody holds, told by what is said of them."""

import pytest

pytest.importorskip("visualization_msgs", reason="needs ROS")

from drone_sim.ros.rviz.held import PATIENCE, Held


class Clock:
    def __init__(self):
        self.now = 5.0

    def __call__(self):
        return self.now


def test_a_handle_is_held_until_it_is_let_go_of():
    held = Held(Clock())
    held.take("Drone", "rviz 1")
    held.take("Drone", "rviz 2")
    held.let_go("Drone", "rviz 1")
    assert held.names() == {"Drone"}
    held.let_go("Drone", "rviz 2")
    assert held.names() == set()


def test_a_hand_that_says_nothing_has_let_go():
    clock = Clock()
    held = Held(clock)
    held.take("Drone", "rviz")
    for _ in range(10):
        clock.now += 0.75 * PATIENCE
        assert held.names() == {"Drone"}
        held.keep("Drone", "rviz")
        held.keep("Drone", "another rviz, which does not hold it")
    clock.now += PATIENCE
    assert held.names() == set()
    held.keep("Drone", "rviz")
    assert held.names() == set(), "it comes back only when it is taken again"
