"""Parameters are checked when they are read; an error has one line."""

from typing import Annotated, Literal

import pytest
from pydantic import Field, ValidationError

from drone_sim.config.errors import problems
from drone_sim.config.types import Checked, Length, one_of
from drone_sim.files.resources import package_path
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

BALL = {"name": "Ball", "shape": "sphere", "size": [1], "position": [9, 0, 1]}


@pytest.mark.parametrize(
    "overrides, message",
    [
        ({"Kzref": 4}, "parameter Kzref: unknown key; did you mean control/Kzref"),
        ({"control": {"position": 4}}, "parameter control/position: unknown key; known are "),  # not `drone/position`
        ({"control": {"Kzreff": 4}}, "parameter control/Kzreff: unknown key; near names are Kzref"),
        ({"time_step": 0.012}, "parameter time_step = 0.012: must be a whole multiple of sub_step = 0.005"),
        ({"time_step": 0}, "parameter time_step = 0: input should be greater than or equal to 0.0001"),
        ({"cameras": {"front": {"width": 0}}}, "parameter cameras/front/width = 0"),
        ({"cameras": {"front": {"near": 200}}}, "parameter cameras/front/near = 200.0: must be less than far = 100.0"),
        ({"real_time_factor": float("nan")}, "parameter real_time_factor = nan: input should be a finite number"),
        ({"drone": {"urdf": "/no/such.urdf"}}, "parameter drone/urdf = '/no/such.urdf': no such file"),
        pytest.param(
            {"drone": {"urdf": "package://nowhere_at_all/x.urdf"}},
            "no ROS package nowhere_at_all",
            marks=pytest.mark.ros,
        ),
        ({"control": {"thrust_limits": [8, 3]}}, "must be [lowest, highest] with lowest < highest"),
        ({"propellers": {"law": "5.x"}}, "parameter propellers/law = '5.x': input should be '3.x' or '4.x'"),
        ({"drone": {"position": [0, 0, -1]}}, "parameter drone/position/2 = -1: input should be greater than or equal"),
        ({"colour": "red"}, "parameter colour: unknown key"),
        (5, "parameters = 5: must be a mapping"),
        (
            {"time_step": 5e-324, "sub_step": 5e-324},
            "time_step = 5e-324: input should be greater than or equal to 0.0001",
        ),
        ({"time_step": 1e9}, "time_step = 1000000000.0: input should be less than or equal to 1"),
        ({"time_step": True}, "time_step = True: input should be a valid number"),
        ({"time_step": "0.05"}, "time_step = '0.05': input should be a valid number"),
        ({"sub_step": 1e-5}, "sub_step = 1e-05: makes 5000 "),
        ({"sub_step": 1e-300}, "sub_step = 1e-300: input should be greater than or equal to 0.00001"),
        ({"gravity": 10**5000}, "gravity = 1e+300: input should be less than or equal to 100"),
        ({"gravity": "9" * 10**7}, "input should be a valid number"),
        ({"gravity": "1:30"}, "gravity = '1:30': input should be a valid number"),
        ({"a" * 10**6: 1}, "unknown key"),
        ({"a\nb": 1}, "parameter 'a\\nb': unknown key"),
        ({"control": {"Kzref": 1e300}}, "control/Kzref = 1e+300: input should be less than or equal to 10000"),
        ({"real_time_factor": 1e-9}, "real_time_factor = 1e-09: must be 0, or from 0.001 to 1000"),
        ({"gui": 1}, "gui = 1: must be true or false"),
        ({"lockstep": {"wait_for": "cmd vel"}}, "wait_for/0/topic = 'cmd vel': must be a topic such as cmd_vel"),
        ({"lockstep": {"wait_for": [{"topic": "a", "evry": 2}]}}, "wait_for/0/evry: unknown key; near names are every"),
        ({"lockstep": {"wait_for": 3}}, "lockstep/wait_for = 3: must be a list of topics such as [cmd_vel]"),
        ({"lockstep": {"trigger": "4 stepps"}}, "trigger = '4 stepps': must be step, a number of steps such as"),
        ({"lockstep": {"on_timeout": "stop"}}, "on_timeout = 'stop': input should be 'hold', 'go on' or 'end'"),
        ({"lockstep": {"timeout": 0}}, "lockstep/timeout = 0: input should be greater than or equal to 0.01"),
        ({"samples": False}, "samples = False"),
        ({"drone": {"position": [1, 2]}}, "drone/position = [1, 2]: must be 3 numbers"),
        ({"drone": {"position": [1, 2, 3, 4]}}, "drone/position = [1, 2, 3, 4]"),
        ({"drone": {"name": "a" * 100}}, "string should have at most 64 characters"),
        ({"drone": {"urdf": "x" * 300}}, "no such file"),
        ({"drone": {"urdf": "a\0b"}}, "no such file"),
        ({"drone": {"urdf": "~nobody_at_all/x"}}, "home folder does not exist"),
        ({"cameras": {"front": {"horizontal_fov": 5e-324}}}, "horizontal_fov = 5e-324: input should be greater than"),
        ({"cameras": {"front": {"width": 640.5}}}, "cameras/front/width = 640.5: input should be a valid integer"),
        ({"cameras": {"front": {"topic": "odom"}}}, "'odom': its image would be odom, which is the drone's own"),
        ({"cameras": {"front": {"topic": "markers/update"}}}, "markers/update, which is the drone's own"),
        ({"cameras": {"front": {"topic": "a//b"}}}, "must be like rear/image"),
        ({"cameras": {"track": {"topic": "camera_info"}}}, "which is the camera_info of cameras/front"),
        ({"cameras": {"track": {"topic": "rear/camera_info"}}}, "which is the image of cameras/track"),
        ({"cameras": {"track": {"topic": "front/compressed"}}}, "which is the compressed of cameras/front"),
        ({"cameras": {"track": {"topic": "track"}}}, "'track': its camera_info would be camera_info, which is the"),
        ({"cameras": {"track": {"object": "FrontVision"}}}, "object = 'FrontVision': is the object of cameras/front"),
        ({"cameras": {"track": {"width": 4096, "height": 4096}}}, "at most 16777216 are allowed"),
        ({"cameras": {f"c{n}": {} for n in range(20)}}, "parameter cameras"),
        ({"scene": {"objects": [BALL, BALL]}}, "scene/objects/1/name = 'Ball': is used twice"),
        ({"scene": {"objects": [{**BALL, "mass": 1e-300}]}}, "mass = 1e-300: must be 0, or from 1e-06 to 1e+06"),
        ({"scene": {"objects": [{**BALL, "mass": float("nan")}]}}, "mass = nan: input should be a finite number"),
        ({"config": 5}, "config = 5: must be the name of a file"),
        ({"config": "no.yaml"}, "config = 'no.yaml': no such file"),
        ({"script": "a\nb.py"}, "must be printable"),
    ],
)
def test_an_invalid_parameter_raises_a_one_line_error(overrides, message):
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load(overrides)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 1200


def test_every_wrong_key_of_a_config_file_is_named_with_its_line(tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text(
        "gui: 1\n"
        "control:\n  Kzreff: 3\n  thrust_limits: [1]\n"
        "cameras:\n  9x: 5\n  rear: {mount: 3, object: Rear, topic: /a}\n  front:\n    every: many\n"
    )
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load({"config": str(file)})
    assert str(refused.value).split("; line ") == [
        f"{file}: line 1: parameter gui = 1: must be true or false",
        "3: parameter control/Kzreff: unknown key; near names are Kzref, Dzref",
        "4: parameter control/thrust_limits = [1]: must be 2 numbers, [lowest, highest] in m/s, or none",
        "6: parameter cameras/9x = '9x': must begin with a letter and contain only letters, digits and _",
        "6: parameter cameras/9x = 5: must hold `key: value` lines with shutter, vignette, exposure, noise, object, "
        "topic, kind, frame, mount, every, width, height, horizontal_fov, lens, near, far, baseline, truth",
        "7: parameter cameras/rear/topic = '/a': must be like rear/image: "
        "letters, digits and _, beginning with a letter, separated by /",
        "7: parameter cameras/rear/mount = 3: must hold `key: value` lines with parent, position, rpy",
        "7: parameter cameras/rear: kind, frame, every, width, height, horizontal_fov, near, far are missing; "
        "and 1 more",
    ]


@pytest.mark.parametrize(
    "text, words",
    [
        ("gravity: -9\ntime_step: 0.012", "line 2: parameter time_step = 0.012: must be a whole multiple"),
        ("cameras:\n  front:\n    near: 200", "line 3: parameter cameras/front/near = 200.0: must be less than far"),
        ("scene:\n  objects:\n  - {shape: cone}", "line 3: parameter scene/objects/0/shape = 'cone': must be one of"),
        ("scene:\n  boxes: 1", "line 2: parameter scene/boxes: unknown key; near names are objects"),
        ("gravity: 1:30", "line 1: parameter gravity = '1:30'"),
        ("gravity: 1\ngravity: 2", "key 'gravity' is given twice (line 2, column 1)"),
        ("gravty: 1", "line 1: parameter gravty: unknown key; near names are gravity"),
        ("config: other.yaml", "a config file must not have the key `config`"),
        ("- 1", "must hold `key: value` lines"),
    ],
)
def test_an_error_in_a_config_file_names_its_line(tmp_path, text, words):
    file = tmp_path / "my.yaml"
    file.write_text(text)
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load({"config": str(file)})
    assert str(refused.value).startswith(f"{file}: {words}") and "\n" not in str(refused.value)


def test_all_errors_of_a_command_line_are_reported():
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load({"gravity": "down", "control": {"Kzreff": 3}})
    assert str(refused.value) == (
        "parameter control/Kzreff: unknown key; near names are Kzref, Dzref; "
        "parameter gravity = 'down': input should be a valid number"
    )


def test_only_the_keys_that_change_are_needed():
    changed = parameters.load({"control": {"Kzref": 4.0}})
    assert changed.control.Kzref == 4.0
    assert changed.control.Dzref == parameters.load().control.Dzref == 3.0


@pytest.mark.parametrize("word", ["none", "null", [], None])
def test_no_limits_can_be_written_as_a_word(word):
    assert parameters.load({"control": {"thrust_limits": word}}).control.thrust_limits is None


@pytest.mark.parametrize("topics, wanted", [("none", []), ("", []), ("goto, cmd_vel", ["goto", "cmd_vel"])])
def test_lockstep_topics_can_be_given_as_a_string(topics, wanted):
    assert [each.topic for each in parameters.load({"lockstep": {"wait_for": topics}}).lockstep.wait_for] == wanted


def test_parameters_are_frozen():
    with pytest.raises(ValueError, match="frozen"):
        parameters.load().control.Kzref = 1.0


def test_a_deeply_nested_value_is_shortened_in_the_error():
    deep = value = {}
    for _ in range(50_000):
        value["a"] = value = {}
    with pytest.raises(parameters.ParameterError, match=r"gravity = \{'a': ") as refused:
        parameters.load({"gravity": deep})
    assert len(str(refused.value)) < 200


def test_a_number_that_yaml_1_1_reads_as_a_string_is_accepted():
    assert parameters.load({"gravity": "1e1"}).gravity == 10.0


@pytest.mark.parametrize("name", ["Floor", "Drone", "target", "Track_base"])
def test_a_camera_cannot_have_the_name_of_an_existing_object(name):
    with pytest.raises(parameters.ParameterError, match=f"an object named '{name}' already exists"):
        Simulation(parameters.load({"cameras": {"front": {"object": name}}}))


def test_a_config_file_overrides_defaults_and_arguments_override_the_config_file(tmp_path):
    config = tmp_path / "config.yaml"
    config.write_text("gravity: -1\ncontrol: {Kzref: 1, Dzref: 2}")
    loaded = parameters.load({"config": str(config), "control": {"Kzref": 4}})
    assert (loaded.gravity, loaded.control.Kzref, loaded.control.Dzref, loaded.time_step) == (-1.0, 4.0, 2.0, 0.05)
    assert loaded.in_scene("").gravity == -1.0


def test_file_names_in_a_config_file_are_relative_to_it(tmp_path):
    (tmp_path / "own.urdf").write_text((package_path() / "urdf" / "drone.urdf").read_text())
    (tmp_path / "room.yaml").write_text("floor: {size: 7}")
    config = tmp_path / "config.yaml"
    config.write_text("drone: {urdf: own.urdf}\nscene_file: room.yaml\nscript: own.py\n")
    loaded = parameters.load({"config": str(config)})
    assert loaded.drone.urdf == str(tmp_path / "own.urdf")
    assert loaded.scene.floor.size == 7
    assert loaded.script == str(tmp_path / "own.py")
    config.write_text("script: target\n")
    assert parameters.load({"config": str(config)}).script == "target"


# ---- models that the key `kind` selects


class Ranger(Checked):
    kind: Literal["ultrasonic", "laser"]
    reach: Length


class Scale(Checked):
    kind: Literal["scale"]
    weight: Annotated[tuple[Length, Length], Field(description="2 numbers, [low, high] in N")] = (1.0, 2.0)


class Sensors(Checked):
    sensors: dict[str, one_of(Ranger, Scale)]
    spare: one_of(Ranger, Scale) | None = None
    places: list[one_of(Ranger, Scale)] | None = None


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"sensors": {"a": {"reach": 1}}}, "sensors/a/kind: missing; must be one of 'ultrasonic', 'laser', 'scale'"),
        (
            {"sensors": {"a": {"kind": "nose"}}},
            "sensors/a/kind = 'nose': must be one of 'ultrasonic', 'laser', 'scale'",
        ),
        ({"sensors": {"a": 3}}, "sensors/a = 3: must have `key: value` lines, one of them `kind`"),
        ({"sensors": {"a": {"kind": "laser"}}}, "sensors/a/reach: missing"),
        (
            {"sensors": {"scale": {"kind": "scale", "weight": 3}}},
            "sensors/scale/weight = 3: must be 2 numbers, [low, high] in N",
        ),
        (
            {"sensors": {"a": {"kind": "laser", "raech": 1, "reach": 1}}},
            "sensors/a/raech: unknown key; near names are reach",
        ),
        ({"sensors": {}, "spare": {"kind": 5}}, "spare/kind = 5: must be one of 'ultrasonic', 'laser', 'scale'"),
        ({"sensors": {}, "places": [{}]}, "places/0/kind: missing; must be one of 'ultrasonic', 'laser', 'scale'"),
    ],
)
def test_an_invalid_kind_or_field_gives_one_error(given, told):
    with pytest.raises(ValidationError) as refused:
        Sensors.model_validate(given)
    (problem,) = problems(refused.value, Sensors)
    assert problem.sentence == f"parameter {told}"
