"""Profiles of drone drivers: loading, one-line errors, and the meaning of a Twist."""

import math

import pytest

from drone_sim.config.types import ParameterError
from drone_sim.run import parameters
from drone_sim.run.profiles import command_topics, profile_cure, profiles

NAMES = ["ardrone", "bebop", "hector", "sjtu", "tello"]


def load_first_vehicle(tmp_path, text, **overrides):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    return parameters.load({"profile": str(file), **overrides}).first


def error_message(tmp_path, text):
    with pytest.raises(ParameterError) as error:
        load_first_vehicle(tmp_path, text)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("name", NAMES)
def test_every_profile_is_read(name):
    vehicle = parameters.load({"profile": name}).first
    assert vehicle.start == "landed"
    assert any(topic.takes == "cmd_vel" for topic in vehicle.topics.values())


def test_the_list_of_profiles_is_complete():
    assert sorted(profiles()) == NAMES


def test_config_file_and_arguments_override_the_profile(tmp_path):
    config = tmp_path / "config.yaml"
    config.write_text("cmd_vel_timeout: 3.0\ncmd_vel_meaning: {forward: {one: 0.1}}\n")
    vehicle = parameters.load({"profile": "bebop", "config": str(config), "start": "flying"}).first
    assert (vehicle.cmd_vel_timeout, vehicle.start, vehicle.name) == (3.0, "flying", "bebop")
    assert vehicle.cmd_vel_meaning.forward.one == 0.1
    assert vehicle.cmd_vel_meaning.forward.largest == 1.0  # still the profile's


def test_the_error_for_an_unknown_profile_suggests_near_names():
    with pytest.raises(ParameterError, match="profile = 'bebob': no such profile; near names are bebop;"):
        parameters.load({"profile": "bebob"})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("topics: {a: {topic: a}}", "must have one of takes, copies and fields, not none"),
        ("topics: {a: {topic: a, takes: land, copies: front}}", "not takes and copies"),
        ("topics: {a: {topic: a b, takes: land}}", "must be like /cmd_vel or rear/image"),
        ("topics: {a: {topic: a, takes: landd}}", "topics/a/takes = 'landd'"),
        ("topics: {a: {topic: a, fields: {x: yaw}}}", "must have the key type"),
        ("topics: {a: {topic: a, type: Pose, fields: {x: yaw}}}", "must be like geometry_msgs/Pose"),
        ("topics: {a: {topic: a, type: geometry_msgs/Pose, fields: {x: jaw}}}", "no such quantity; near names are yaw"),
        ("topics: {a: {topic: a, takes: motors}}", "a topic cannot take motors"),
        ("topics: {a: {topic: a, takes: land, colour: red}}", "topics/a/colour"),
        ("cmd_vel_meaning: {forwards: {field: linear.x}}", "cmd_vel_meaning/forwards"),
        ("profile: bebop", "must not have the key `profile`"),
    ],
)
def test_a_wrong_key_or_value_gives_a_one_line_error(tmp_path, text, said):
    assert said in error_message(tmp_path, text)


def test_a_tilt_command_becomes_roll_and_pitch():
    meaning = parameters.load({"profile": "bebop"}).first.cmd_vel_meaning
    linear, angular = meaning.converted((0.5, 1.0, -2.0), (9.0, 9.0, 1.0))
    assert linear == (0.0, 0.0, -1.0)  # clipped to 1, which means 1 m/s
    assert angular == pytest.approx((-0.349, 0.5 * 0.349, 1.745))  # to the left is a negative roll


def test_stick_commands_have_other_axes():
    meaning = parameters.load({"profile": "tello"}).first.cmd_vel_meaning
    assert meaning.converted((1.0, 0.5, 0.0), (0.0, 0.0, 1.0)) == ((1.0, -2.0, 0.0), (0.0, 0.0, -0.87))


def test_without_a_profile_a_twist_is_unchanged():
    meaning = parameters.load().first.cmd_vel_meaning
    linear, angular = (30.0, 1.0, 2.0), (0.1, 0.2, 0.3)
    assert meaning.is_ours and meaning.converted(linear, angular) == (linear, angular)


def test_nan_is_not_clipped():
    meaning = parameters.load({"profile": "bebop"}).first.cmd_vel_meaning
    assert math.isnan(meaning.converted((0.0, 0.0, math.nan), (0.0, 0.0, 0.0))[0][2])


def test_the_advice_for_an_unheard_topic_names_its_profile():
    assert profile_cure("/bebop/takeoff") == "start with profile:=bebop"
    assert profile_cure("/cmd_vel") == "start with profile:=ardrone or hector or sjtu"
    assert profile_cure("/drone/cmd_vel") == "" and "/drone/takeoff" not in command_topics()
