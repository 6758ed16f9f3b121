"""Callbacks in rospy's threads: they check messages without the simulation and leave jobs for its thread."""

import math
import threading
from queue import Queue
from unittest import mock

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import roslib.launcher
import rospkg
import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped, Vector3Stamped, WrenchStamped
from std_msgs.msg import Empty, Header
from visualization_msgs.msg import InteractiveMarkerFeedback

from drone_sim.ros.core import message_conversion
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.node import diagnostics, scene_editing, services
from drone_sim.ros.rviz import handles
from drone_sim.ros.vehicle import cameras
from drone_sim.ros.vehicle.inputs import VehicleInputs
from drone_sim.vehicles.commands import EMPTY, REQUESTS


class OwnThreadOnly:
    """A proxy of a simulation that fails when another thread reads it."""

    def __init__(self, simulation):
        self._simulation, self._owner = simulation, threading.get_ident()

    def __getattr__(self, name):
        assert threading.get_ident() == self._owner, f"simulation.{name} is read in another thread"
        return getattr(self._simulation, name)


@pytest.fixture
def simulation(new_simulation):
    made = new_simulation({"script": ""})
    return OwnThreadOnly(made)


@pytest.fixture
def callbacks(monkeypatch):
    """Return the subscribed callbacks, by topic."""
    callbacks_by_topic = {}

    def subscriber(topic, _kind, callback, **_):
        callbacks_by_topic[topic] = callback
        return mock.MagicMock()

    monkeypatch.setattr(rospy, "Subscriber", subscriber)
    monkeypatch.setattr(handles, "MarkerServer", mock.MagicMock())
    return callbacks_by_topic


def in_another_thread(callback, message):
    failures = []

    def run():
        try:
            callback(message)
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert not failures, failures[0]


def at_position(message, x=1.0):
    pose = getattr(message.pose, "pose", message.pose)
    pose.position.x, pose.position.z, pose.orientation.w = x, 1.0, 1.0
    return message


MESSAGES = {
    "cmd_vel": Twist(),
    "cmd_vel_stamped": TwistStamped(),
    "goto": at_position(PoseStamped()),
    **{topic: Empty() for topic, kind in REQUESTS.items() if kind == EMPTY},
    "set_pose": at_position(PoseStamped(), 2.0),
    "initialpose": at_position(PoseWithCovarianceStamped(), 3.0),
    "target_pose": at_position(PoseStamped()),
    "push": WrenchStamped(),
    "set_wind": Vector3Stamped(),
    "weather": KeyValue("wind", "[1, 0, 0]"),
    "faults": KeyValue("commands/loss", "0.2"),
}


def test_messages_for_a_vehicle_are_checked_without_reading_the_simulation(simulation, callbacks):
    inbox = Inbox()
    inputs = VehicleInputs(simulation, simulation.drone.parameters, inbox)
    assert callbacks.keys() == {f"drone/{topic}" for topic in MESSAGES}
    for topic, message in MESSAGES.items():
        in_another_thread(callbacks[f"drone/{topic}"], message)
    assert inputs.log.taken.keys() == MESSAGES.keys() - {"cmd_vel_stamped"} and not inputs.log.refused
    inbox.run_jobs()
    assert simulation.drone.body.state.position[0] == pytest.approx(3.0)


def test_a_command_is_checked_against_the_tuned_limits(simulation, callbacks):
    inputs = VehicleInputs(simulation, simulation.drone.parameters, Inbox())
    fast = Twist()
    fast.linear.x = simulation.drone.parameters.cmd_vel_limits.linear + 1
    in_another_thread(callbacks["drone/cmd_vel"], fast)
    assert inputs.log.is_refusing("cmd_vel")
    simulation.child_scripts["drone"].tuning.change({"cmd_vel_limits/linear": fast.linear.x})
    inputs.follow(simulation.drone)
    in_another_thread(callbacks["drone/cmd_vel"], fast)
    assert not inputs.log.is_refusing("cmd_vel")


@pytest.mark.parametrize("topic, message", [("cmd_vel", Twist()), ("cmd_vel_stamped", TwistStamped())])
def test_a_refusal_names_the_topic_of_the_command(simulation, callbacks, caplog, topic, message):
    inputs = VehicleInputs(simulation, simulation.drone.parameters, Inbox())
    (message.twist if topic == "cmd_vel_stamped" else message).linear.x = math.nan
    callbacks[f"drone/{topic}"](message)
    assert inputs.log.is_refusing("cmd_vel") and inputs.log.last_refusal().topic == topic
    assert f"{topic} refused, the last valid one is kept: " in caplog.text


@pytest.mark.parametrize("made", [handles.VehicleHandles, handles.ObjectHandles])
def test_the_callback_of_a_dragged_handle_does_not_read_the_simulation(simulation, callbacks, made):
    inbox = Inbox()
    shown = made(simulation, inbox)
    for event in ("MOUSE_DOWN", "POSE_UPDATE", "MOUSE_UP"):
        feedback = InteractiveMarkerFeedback(marker_name="Drone", client_id="rviz")
        feedback.event_type = getattr(InteractiveMarkerFeedback, event)
        feedback.pose.position.x, feedback.pose.position.z, feedback.pose.orientation.w = 2.0, 1.0, 1.0
        in_another_thread(shown._on_feedback, feedback)
    inbox.run_jobs()
    is_moved = made is handles.VehicleHandles
    assert simulation.drone.body.state.position[0] == pytest.approx(2.0 if is_moved else 0.0, abs=1e-3)


def test_faults_for_a_replaced_vehicle_are_refused_in_one_line(callbacks, caplog, new_simulation):
    simulation = new_simulation({"vehicles": {"drone": {"sensors": {"imu": {"kind": "imu", "rate": 20}}}}})
    inbox = Inbox()
    inputs = VehicleInputs(simulation, simulation.drone.parameters, inbox)
    callbacks["drone/faults"](KeyValue("sensors/imu", "silent"))
    assert not inputs.log.refused
    for vehicles in ({"other": {}}, {"drone": {}}):
        simulation.set_vehicles(vehicles)
    inbox.run_jobs()
    assert inputs.log.is_refusing("faults") and "imu" in inputs.log.refused["faults"].why
    assert not [one for one in caplog.records if one.exc_info]


def test_a_message_may_fail_any_propeller_of_a_hexacopter(callbacks, new_simulation):
    simulation = new_simulation({"config": "package://drone_sim/config/hexacopter.yaml"})
    inbox = Inbox()
    inputs = VehicleInputs(simulation, simulation.drone.parameters, inbox)
    callbacks["drone/faults"](KeyValue("propellers", "[1, 1, 1, 1, 1, 0]"))
    inbox.run_jobs()
    assert simulation.drone.faults.now.propellers == (1, 1, 1, 1, 1, 0)
    callbacks["drone/faults"](KeyValue("propellers", "[1, 1, 1, 1, 1]"))
    assert inputs.log.is_refusing("faults")


def test_a_picture_that_cannot_be_encoded_does_not_stop_the_encoder(monkeypatch):
    published, errors = Queue(), []
    monkeypatch.setattr(rospy, "resolve_name", lambda name: name)
    monkeypatch.setattr(rospy, "Publisher", mock.MagicMock())
    monkeypatch.setattr(
        cameras, "Server", lambda _, keep, __: (keep({"format": "png", "png_level": 1}, 0), mock.Mock())[1]
    )
    monkeypatch.setattr(rospy, "logerr_throttle", lambda _, line: (errors.append(line), published.put("failed")))
    output = cameras.CompressedPublisher("drone/camera/image", None)
    output.publisher.publish = published.put
    output.publish(Header(), np.zeros((0, 4, 3), np.uint8))
    assert published.get(timeout=60) == "failed" and len(errors) == 1
    output.publish(Header(), np.zeros((2, 4, 3), np.uint8))
    assert "png" in published.get(timeout=60).format
    output.unregister()


def test_twist_topics_without_a_subscriber_are_found_through_the_master(monkeypatch):
    answers = {
        "getSystemState": [
            [["/cmd_vel", ["/teleop"]], ["/own", ["/drone_sim"]], ["/heard", ["/teleop"]], ["/text", ["/teleop"]]],
            [["/heard", ["/drone_sim"]], ["/cmd_vel", []]],
            [],
        ],
        "getTopicTypes": [
            *([topic, "geometry_msgs/Twist"] for topic in ("/cmd_vel", "/own", "/heard")),
            ["/text", "std_msgs/String"],
        ],
    }
    monkeypatch.setattr(rospy, "get_name", lambda: "/drone_sim")
    monkeypatch.setattr(diagnostics, "call", lambda _uri, method: answers[method])
    assert diagnostics.unheard_commands() == {"/cmd_vel": ["/teleop"]}
    monkeypatch.setattr(diagnostics, "call", mock.Mock(side_effect=ConnectionRefusedError))
    assert diagnostics.unheard_commands() == {}


def test_a_type_without_generated_code_is_distinguished_from_a_missing_type(monkeypatch, tmp_path):
    for ending in ("msg", "srv"):
        (tmp_path / "course_msgs" / ending).mkdir(parents=True)
        (tmp_path / "course_msgs" / ending / f"Gate.{ending}").touch()
    (tmp_path / "course_msgs" / "package.xml").write_text("<package><name>course_msgs</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    for look, ending in ((message_conversion.message_class, "msg"), (message_conversion.service_class, "srv")):
        with pytest.raises(ValueError, match=rf"Gate\.{ending}, but its Python code was never generated: build"):
            look("course_msgs/Gate")
        with pytest.raises(ValueError, match="'course_msgs/Gat' is not installed"):
            look("course_msgs/Gat")


@pytest.mark.parametrize("look", [message_conversion.message_class, message_conversion.service_class])
def test_a_type_of_an_unreadable_package_is_refused_with_the_reason(look, monkeypatch, tmp_path):
    (tmp_path / "a_msgs/msg").mkdir(parents=True)
    person = "<maintainer email='nobody'>N</maintainer><version>1.0.0</version><license>x</license>"
    text = f"<package format='2'><name>a_msgs</name><description>x</description>{person}</package>"
    (tmp_path / "a_msgs/package.xml").write_text(text)
    monkeypatch.setattr(roslib.launcher, "_rospack", rospkg.RosPack([str(tmp_path)]))
    with pytest.raises(ValueError, match=r"'a_msgs/Gate' cannot be found: .*Invalid email"):
        look("a_msgs/Gate")


def test_resuming_a_simulation_that_is_not_paused_explains_how_to_pause(simulation, monkeypatch):
    player = mock.Mock(playing=True, pause=lambda on: "paused" if on else "resumed")
    warnings = []
    monkeypatch.setattr(services, "VehiclesParameter", mock.Mock())
    monkeypatch.setattr(rospy, "Service", mock.Mock())
    monkeypatch.setattr(rospy, "get_param", lambda _name, default: default)
    monkeypatch.setattr(rospy, "logwarn", warnings.append)
    monkeypatch.setattr(services, "scene_parameter", str)
    offered = services.Services(player, mock.Mock(), Inbox(), lambda: None)
    assert "pause true` pauses" in offered.pause(False) and len(warnings) == 1
    assert offered.pause(True) == "paused"
    player.playing = False
    assert offered.pause(False) == "resumed" and len(warnings) == 1


def test_a_lone_surrogate_in_a_reply_of_the_editor_is_escaped(monkeypatch):
    editor_inbox = mock.Mock(ask=mock.Mock(side_effect=ValueError("no file \ud800.yaml")))
    success, reply = scene_editing.SceneEditing._attempt(mock.Mock(_inbox=editor_inbox), str, "", None)
    assert not success and reply.encode("utf-8") == rb"no file \ud800.yaml"
