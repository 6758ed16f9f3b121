"""Topics of vehicles when another scene is loaded, time stamps, and what late steps skip."""

import contextlib
from types import SimpleNamespace
from typing import ClassVar
from unittest import mock

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.grading import plan as plans
from drone_sim.ros.core.publishing import StepTime
from drone_sim.ros.grading.simulator import scene_file
from drone_sim.ros.node.node import Node
from drone_sim.ros.vehicle import cameras, vehicle_topics
from drone_sim.run import parameters

PLAN = """
duration: 1
spread: {position: [0.2, 0.2, 0], yaw: 0.2}
criteria: [{kind: reach, places: [[1, 0, 1]], within: 0.3}]
"""


class Topics:
    """The topics of one vehicle, without a ROS master."""

    def __init__(self, _simulation, vehicle, _inbox, _gate):
        self.vehicle, self.is_open = vehicle, True

    def follow(self, vehicle):
        self.vehicle = vehicle

    def close(self):
        self.is_open = False


class Transforms:
    def __init__(self, _simulation, _stamp):
        pass

    def publish_static(self):
        pass


@pytest.fixture(name="fleet")
def _fleet(monkeypatch, tmp_path, new_simulation):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(vehicle_topics, "VehicleTopics", Topics)
    monkeypatch.setattr(vehicle_topics, "Transforms", Transforms)
    simulation = new_simulation(started=False)
    return vehicle_topics.FleetTopics(simulation, None, None)


def test_vehicle_with_another_start_position_keeps_its_topics(fleet, tmp_path):
    simulation, (topics,) = fleet._simulation, fleet._topics.values()
    (tmp_path / "plan.yaml").write_text(PLAN)
    simulation.load_scene(scene_file(plans.read(tmp_path / "plan.yaml"), 3))
    fleet.follow()
    assert simulation.drone.parameters.position != parameters.load().drone.position
    assert (topics.is_open, topics.vehicle) == (True, simulation.drone)


@pytest.mark.parametrize(
    ("said", "stays"),
    [
        ("position: [2, 1, 1], yaw: 1, tilt: [0.1, 0]", True),
        ("faults: {seed: 7}", True),
        ("cameras: {front: {width: 320}}", False),
        ("script: target", False),
    ],
)
def test_topics_are_closed_only_if_cameras_or_script_change(fleet, tmp_path, said, stays):
    (topics,) = fleet._topics.values()
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"vehicles: {{drone: {{{said}}}}}\n")
    fleet._simulation.load_scene(str(scene))
    fleet.follow()
    assert topics.is_open == stays


# ---- stamps of messages when the machine's clock is set


STEP = 0.05  # s
NOW = 1.7e9  # s


@pytest.mark.parametrize(
    ("moved", "apart"),
    [
        (STEP, 0.01),  # the clock was not set
        (STEP / 2, 0.005),  # a shorter step after a late one
        (3600.0, 0.01),
        (-0.5, 0.01),
        (-3600.0, 0.01),
        (-NOW + 1, 0.01),  # 1970
    ],
)
def test_measurement_within_a_step_is_stamped_before_the_end_of_the_step(monkeypatch, moved, apart):
    clock = [NOW]
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time.from_sec(clock[0]))
    parameters = SimpleNamespace(time_step=STEP, real_time_factor=1.0)
    time = StepTime(SimpleNamespace(parameters=parameters), simulated=False)
    time.begin()
    clock[0] += moved
    time.begin()
    assert time.stamp() == rospy.Time.from_sec(clock[0])
    assert (time.stamp() - time.stamp(ago=0.01)).to_sec() == pytest.approx(apart, abs=1e-6)


class Publisher:
    """A publisher with given numbers of subscribers that publishes nothing."""

    subscribers: ClassVar[dict] = {}  # by topic

    def __init__(self, topic, *_, **__):
        self.topic = topic

    def get_num_connections(self):
        return self.subscribers.get(self.topic, 0)


@pytest.fixture(name="pictures")
def _pictures(monkeypatch, new_simulation, fleet):
    """Return a function that returns `fly`, which runs 16 steps and returns the steps that have a picture."""
    monkeypatch.setattr(rospy, "resolve_name", lambda name: name)
    monkeypatch.setattr(rospy, "Publisher", Publisher)
    monkeypatch.setattr(cameras, "Server", mock.Mock())

    def begin(every=1, **faults):
        small = {"width": 16, "height": 12, "every": every}
        simulation = fleet._simulation = new_simulation({"cameras": {"front": small}, "faults": faults})
        vehicle = simulation.drone
        camera, own = vehicle.cameras["front"], vehicle.parameters
        output = cameras.CameraOutput(own, camera, own.cameras["front"], None)
        fleet._topics = {"drone": SimpleNamespace(cameras=[("front", output)])}

        def fly(is_late, *subscribed):
            Publisher.subscribers = dict.fromkeys(subscribed, 1)
            before, step_numbers = simulation.steps, []
            for _ in range(16):
                with fleet.hurrying() if is_late else contextlib.nullcontext():
                    simulation.step()
                if camera.image is not None:
                    step_numbers.append(simulation.steps - before)
            return step_numbers

        return fly

    return begin


RAW, COMPRESSED = "drone/front", "drone/front/compressed"


@pytest.mark.parametrize("every", [1, 2])
def test_late_steps_skip_pictures_with_only_compressed_subscribers(pictures, every):
    fly, all_steps = pictures(every), list(range(every, 17, every))
    assert fly(False, COMPRESSED) == all_steps
    assert fly(True, COMPRESSED) == all_steps[3::4], "at most three are skipped in a row"
    assert fly(True, COMPRESSED, RAW) == all_steps
    assert fly(True) == []
    assert fly(False, COMPRESSED) == all_steps


def test_late_steps_do_not_change_the_delay_of_pictures_by_a_fault(pictures):
    fly = pictures(images={"latency": 0.15})
    assert fly(True, COMPRESSED) == list(range(4, 17))


@pytest.mark.parametrize(("lockstep", "shown"), [(None, [3, 7, 11]), (mock.Mock(), list(range(12)))])
def test_late_steps_skip_markers_at_most_three_times_in_a_row(lockstep, shown):
    node, markers, step_numbers = Node.__new__(Node), mock.Mock(), []
    vars(node).update(_pacer=SimpleNamespace(is_late=True), _lockstep=lockstep, _rviz=[markers], _left_out=0)
    vars(node).update(_parameters=SimpleNamespace(gui=False))
    others = ("topics", "windows", "signals", "inspection", "editing", "interventions", "beat")
    vars(node).update({f"_{other}": mock.Mock() for other in others})
    for step in range(12):
        markers.update.side_effect = lambda step=step: step_numbers.append(step)
        node._publish_displays()
    assert step_numbers == shown and node._editing.update.call_count == len(shown)
    assert node._topics.publish_command.call_count == 12
    node._pacer.is_late = False
    node._publish_displays()
    assert step_numbers == [*shown, 11], "the next punctual step publishes them"
