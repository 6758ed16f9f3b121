"""Force, wind and contact markers in rviz: position and length of the arrows, and no effect on the flight."""

import itertools

import numpy as np
import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.world.queries import Queries

force_markers = pytest.importorskip("drone_sim.ros.rviz.force_markers")
marker_topics = pytest.importorskip("drone_sim.ros.rviz.marker_topics")
pytestmark = pytest.mark.ros

SOUND = (1.0, 1.0, 1.0, 1.0)
WALL = {"shape": "box", "size": [0.2, 3, 3], "position": [0.6, 0, 1.5]}
STANDING = {"start": "landed"}


class Topic:
    """Marker topic that records its messages; `has_subscribers` can be set."""

    has_subscribers = True

    def __init__(self, name, _period):
        self.name, self.messages = name, []

    def is_due(self):
        return self.has_subscribers

    def show(self, markers):
        self.messages.append(markers)


@pytest.fixture(name="shown")
def _shown(monkeypatch, new_simulation):
    monkeypatch.setattr(marker_topics, "MarkerTopic", Topic)

    def shown(steps=0, **overrides):
        simulation = new_simulation(overrides)
        markers = force_markers.ForceMarkers(simulation)
        for _ in range(steps):
            simulation.step()
        markers.update()
        return simulation, markers

    return shown


def arrows(marker):
    """Return (start, vector), each (3,), of every arrow of a marker. An arrow is a shaft and four barbs."""
    points = np.array([(one.x, one.y, one.z) for one in marker.points]).reshape(-1, 10, 3)
    for lines in points:
        assert (lines[2::2] == lines[1]).all(), "every barb starts at the tip"
        assert all((lines[3::2] - lines[1]) @ (lines[1] - lines[0]) < 0), "every barb points backwards"
    return [(lines[0], lines[1] - lines[0]) for lines in points]


def in_world(marker, vehicle):
    """Return the points of a marker on base_link in the world frame, (n, 3)."""
    place, turn = marker.pose.position, marker.pose.orientation
    pose = Pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
    matrix = frames.multiply(vehicle.body.matrix, pose.matrix)
    return np.array([frames.transform(matrix, (one.x, one.y, one.z)) for one in marker.points])


def scale_of(vehicle):
    return force_markers.metres_per_newton(vehicle.body.mass, -9.81)


def is_red(color):
    return color.r > 2 * color.g


def test_thrust_arrows_at_hover_start_at_the_propellers_and_equal_the_weight(shown):
    simulation, markers = shown(steps=40)
    drone, sums = simulation.drone, []
    for _ in range(20):
        simulation.step()
        markers.update()
        thrust, *others = markers._topic.messages[-1]
        assert others == [None] * 4, "there are no wind and contact markers"
        found = arrows(thrust)
        for (start, vector), link, newtons in zip(found, drone.propulsion.rotors.links, drone.body.thrusts):
            assert start == pytest.approx(frames.position(link))
            assert vector == pytest.approx(np.array((link[2], link[6], link[10])) * newtons * scale_of(drone), abs=5e-5)
        sums.append(sum(np.linalg.norm(vector) for _, vector in found))
    assert (thrust.header.frame_id, thrust.frame_locked, thrust.ns) == ("base_link", True, "thrust")
    assert np.mean(sums) / scale_of(drone) == pytest.approx(drone.body.mass * 9.81, rel=0.005)
    assert np.mean(sums) / 4 == pytest.approx(force_markers.HOVER, rel=0.005)
    assert not any(is_red(color) for color in thrust.colors)


def test_a_weak_propeller_has_a_red_arrow_and_a_failed_one_a_cross(shown):
    simulation, markers = shown(faults={"propellers": [0.8, 1, 0, 1]}, steps=1)
    thrust = markers._topic.messages[-1][0]
    assert len(thrust.points) == len(thrust.colors) == 3 * 10 + 8
    assert [is_red(one) for one in thrust.colors] == [True] * 10 + [False] * 10 + [True] * 8 + [False] * 10
    corners = np.array([(one.x, one.y, one.z) for one in thrust.points[20:28]])
    middle = frames.position(simulation.drone.propulsion.rotors.links[2])
    assert corners.mean(axis=0) == pytest.approx(middle)
    assert np.ptp(corners, axis=0) == pytest.approx([0.09] * 3)


@pytest.mark.parametrize("gusts", [{}, {"deviation": [3, 3, 1.5]}])
def test_the_wind_arrow_shows_the_wind_in_the_world_for_a_tilted_drone(shown, gusts):
    simulation, markers = shown(weather={"wind": [3, -4, 0], "gusts": gusts}, drone={"yaw": 1.0}, steps=30)
    drone = simulation.drone
    _, arrow, text, *_ = markers._topic.messages[-1]
    start, tip = in_world(arrow, drone)[:2]
    assert tip - start == pytest.approx(force_markers.WIND * np.array(drone.body.wind))
    assert start[:2] == pytest.approx(drone.body.state.position[:2])
    assert abs(frames.to_euler(drone.body.matrix)[0]) > 0.01, "the drone is tilted"
    assert text.text == f"wind {np.linalg.norm(drone.body.wind):.1f} m/s"
    assert (arrow.ns, text.ns) == ("wind", "wind")
    assert gusts or text.text == "wind 5.0 m/s"


def test_without_wind_there_is_no_arrow_and_the_text_shows_0(shown):
    simulation, markers = shown()
    simulation.drone.context.change_weather({"wind": [0, 0, 0]})
    simulation.step()
    markers.update()
    _, arrow, text, *_ = markers._topic.messages[-1]
    assert arrow is None and text.text == "wind 0.0 m/s"


def test_contact_forces_of_a_standing_drone_equal_its_weight(shown):
    simulation, markers = shown(**STANDING, steps=20)
    thrust, *_, points, forces = markers._topic.messages[-1]
    drone, found = simulation.drone, arrows(forces)
    assert thrust is None
    assert all(abs(one.z) < 0.01 for one in points.points) and len(points.points) >= 3
    assert {tuple(start) for start, _ in found} <= {(one.x, one.y, one.z) for one in points.points}
    pushed = sum(vector for _, vector in found) / scale_of(drone)
    assert pushed == pytest.approx([0, 0, drone.body.mass * 9.81], abs=0.03 * drone.body.mass * 9.81)


def test_the_arrow_of_a_large_contact_force_is_limited():
    contact = force_markers.Contact("Wall", (1.0, 2.0, 3.0), (0.0, 1.0, 0.0), (0.0, 5000.0, 0.0))
    _, forces = force_markers._contacts([contact], 0.1)
    assert arrows(forces)[0][1] == pytest.approx([0, force_markers.LONGEST, 0])


def test_a_moved_or_stopped_drone_has_no_contact_markers_before_the_next_step(shown):
    simulation, markers = shown(**STANDING, steps=5)
    simulation.drone.body.move(Pose((3.0, 0.0, 2.0)))
    markers.update()
    assert markers._topic.messages[-1][3:] == [None, None]
    simulation.stop()
    markers.update()
    assert markers._topic.messages[-1][3:] == [None, None]


def test_unchanged_markers_are_not_sent_again_and_each_vehicle_has_its_own(shown, monkeypatch):
    monkeypatch.setattr(marker_topics, "namespace", lambda _simulation: "drone_sim")
    simulation, markers = shown(vehicles={"a": {}, "b": {"position": [0, 2, 0.8]}}, steps=2)
    markers.update()
    (message,) = markers._topic.messages
    assert markers._topic.name == "drone_sim/view/forces"
    assert [one and one.header.frame_id for one in message] == ["a/base_link", *[None] * 4, "b/base_link", *[None] * 4]
    simulation.step()
    markers.update()
    assert len(markers._topic.messages) == 2


def crash_into_wall(simulation, markers):
    """Crash the drone into a wall and let it fall; return its state after each step."""
    simulation.drone.commands.receive(Twist(Vector3(1.0, 0, 0)))
    simulation.drone.change_faults({"propellers": [0, 1, 1, 1]})
    states = []
    for _ in range(80):
        simulation.step()
        markers.update()
        states.append(simulation.drone.body.state)
    return states


def test_subscribers_do_not_change_the_flight_and_contacts_are_read_only_for_them(shown, monkeypatch):
    query_count = itertools.count()
    read = Queries.contacts
    monkeypatch.setattr(Queries, "contacts", lambda *of: (next(query_count), read(*of))[1])
    wall = {"scene": {"objects": [WALL]}}
    monkeypatch.setattr(Topic, "has_subscribers", False)
    states = crash_into_wall(*shown(**wall))
    assert next(query_count) == 0
    monkeypatch.setattr(Topic, "has_subscribers", True)
    watched = shown(**wall)
    assert crash_into_wall(*watched) == states
    assert sum(message[4] is not None for message in watched[1]._topic.messages) > 30, "it lies on the floor"
