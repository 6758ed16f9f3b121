"""Flight markers in rviz: they are published only when their appearance changes."""

import numpy as np
import pytest

pytest.importorskip("visualization_msgs")

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.ros.rviz import flight_markers, marker_topics

_SETTLED = 300  # steps, after which the drone hovers or flies at constant velocity


class Topic:
    has_subscribers = True

    def __init__(self, _name, _period):
        self.messages = []

    def is_due(self):
        return True

    def show(self, markers):
        self.messages.append(markers)


@pytest.fixture(name="flown")
def _flown(monkeypatch, new_simulation):
    monkeypatch.setattr(marker_topics, "MarkerTopic", Topic)

    def flown(kind, command=None, steps=60):
        simulation = new_simulation({})
        markers = kind(simulation)
        for step in range(_SETTLED + steps):
            if command is not None and step == 0:
                simulation.drone.commands.receive(command)
            simulation.step()
            if step >= _SETTLED:
                markers.update()
        return simulation.drone, markers._topic.messages

    return flown


def test_shadow_and_plumb_line_of_a_hovering_drone_are_sent_once(flown):
    _, messages = flown(flight_markers.HeightMarkers)
    assert len(messages) == 1


def test_the_arrow_of_a_turning_drone_turns_with_it(flown):
    drone, messages = flown(flight_markers.CommandMarkers, Twist(Vector3(0.5), Vector3(0, 0, 0.4)))
    assert len(messages) < 20
    arrow, arc = messages[-1]
    turn = arrow.pose.orientation
    in_track = frames.relative_turn(drone.track.matrix(), drone.body.matrix)
    attached = frames.from_quaternion((0, 0, 0), (turn.x, turn.y, turn.z, turn.w))
    np.testing.assert_allclose(frames.multiply(in_track, attached), frames.IDENTITY, atol=2e-3)
    tip = arrow.points[-1]
    assert (tip.x, tip.y, tip.z) == pytest.approx((0.8, 0, 0))
    assert arc.points


def test_the_text_is_vertically_above_a_tilted_drone(flown):
    class Text(flight_markers.StateText):
        def __init__(self, simulation):
            super().__init__(simulation, None)

        def _text(self, vehicle):
            return "text"

    drone, messages = flown(Text, Twist(Vector3(1.0), Vector3(0, 0, 0.4)))
    (marker,) = messages[-1]
    place = marker.pose.position
    above = np.subtract(frames.transform(drone.body.matrix, (place.x, place.y, place.z)), drone.body.state.position)
    np.testing.assert_allclose(above, (0, 0, 0.34), atol=1e-3)
    assert len(messages) < 60
