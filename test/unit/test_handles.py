"""A handle that is dragged while the simulation starts anew, or its vehicle goes."""

from unittest import mock

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from visualization_msgs.msg import InteractiveMarkerFeedback

from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.rviz import vehicle_handles
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation


@pytest.fixture
def dragged(monkeypatch):
    """Return a simulation, and the inbox in which a drag to x = 2 m waits."""
    monkeypatch.setattr(vehicle_handles, "MarkerServer", mock.MagicMock())
    simulation, inbox = Simulation(parameters.load({"script": ""})), Inbox()
    shown = vehicle_handles.VehicleHandles(simulation, inbox)
    feedback = InteractiveMarkerFeedback(event_type=InteractiveMarkerFeedback.POSE_UPDATE, marker_name="Drone")
    feedback.pose.position.x, feedback.pose.position.z, feedback.pose.orientation.w = 2.0, 1.0, 1.0
    shown._on_feedback(feedback)
    yield simulation, inbox
    simulation.close()


def test_it_moves_the_vehicle_that_is_there_by_then(dragged):
    simulation, inbox = dragged
    simulation.start()
    inbox.empty()
    assert simulation.drone.body.state.position == pytest.approx((2, 0, 1))


def test_it_moves_nothing_where_the_vehicle_has_gone(dragged):
    simulation, inbox = dragged
    simulation.set_vehicles({"other": {}})
    inbox.empty()
    assert simulation.vehicles["other"].body.state.position[0] == 0
