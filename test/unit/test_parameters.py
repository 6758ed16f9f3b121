"""Parameters: checked when read, one line for a mistake."""

import pytest

from drone_sim import parameters


@pytest.mark.parametrize(
    "overrides, message",
    [
        ({"control": {"Kzreff": 4}}, "parameter control/Kzreff: unknown key; known are Kzref"),
        ({"time_step": 0.012}, "parameter time_step = 0.012: must be a whole multiple of sub_step = 0.005"),
        ({"time_step": 0}, "parameter time_step = 0: input should be greater than or equal to 0.0001"),
        ({"cameras": {"front": {"width": 0}}}, "parameter cameras/front/width = 0"),
        ({"cameras": {"front": {"near": 200}}}, "parameter cameras/front/near = 200.0: must be less than far = 100.0"),
        ({"real_time_factor": float("nan")}, "parameter real_time_factor = nan: input should be a finite number"),
        ({"drone": {"urdf": "/no/such.urdf"}}, "parameter drone/urdf = '/no/such.urdf': no such file"),
        ({"drone": {"urdf": "package://nowhere_at_all/x.urdf"}}, "no ROS package nowhere_at_all"),
        ({"control": {"thrust_limits": [8, 3]}}, "must be [lowest, highest] with lowest < highest"),
        ({"propellers": {"law": "5.x"}}, "parameter propellers/law = '5.x': input should be '3.x' or '4.x'"),
        ({"drone": {"position": [0, 0, -1]}}, "parameter drone/position/2 = -1: input should be greater than or equal"),
        ({"colour": "red"}, "parameter colour: unknown key"),
    ],
)
def test_a_mistake_gets_one_line(overrides, message):
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load(overrides)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 400


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
        "3: parameter control/Kzreff: unknown key; known are Kzref, Dzref",
        "4: parameter control/thrust_limits = [1]: must be 2 numbers, [lowest, highest] in m/s, or none",
        "6: parameter cameras/9x = '9x': must be a letter and then letters, digits or _",
        "6: parameter cameras/9x = 5: must hold `key: value` lines with object, topic, kind, frame, mount, "
        "every, width, height, horizontal_fov, near, far",
        "7: parameter cameras/rear/topic = '/a': must be like rear/image: "
        "letters, digits and _, a letter first, parted by /",
        "7: parameter cameras/rear/mount = 3: must hold `key: value` lines with parent, position, rpy",
        "7: parameter cameras/rear: kind, frame, every, width, height, horizontal_fov, near, far are missing; "
        "and 1 more",
    ]


@pytest.mark.parametrize(
    "text, line, words",
    [
        ("gravity: -9\ntime_step: 0.012", 2, "parameter time_step = 0.012: must be a whole multiple"),
        ("cameras:\n  front:\n    near: 200", 3, "parameter cameras/front/near = 200.0: must be less than far"),
        ("scene:\n  objects:\n  - {shape: cone}", 3, "parameter scene/objects/0/shape = 'cone': must be one of 'box'"),
        ("scene:\n  boxes: 1", 2, "parameter scene/boxes: unknown key; known are floor, objects"),
    ],
)
def test_a_mistake_in_a_config_file_has_its_line(tmp_path, text, line, words):
    file = tmp_path / "my.yaml"
    file.write_text(text)
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load({"config": str(file)})
    assert str(refused.value).startswith(f"{file}: line {line}: {words}")


def test_all_mistakes_of_a_command_line_are_named():
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load({"gravity": "down", "control": {"Kzreff": 3}})
    said = (
        "parameter gravity = 'down': input should be a valid number; parameter control/Kzreff: unknown key; known are "
    )
    assert str(refused.value).startswith(said)


def test_only_the_keys_that_change_are_needed():
    changed = parameters.load({"control": {"Kzref": 4.0}})
    assert changed.control.Kzref == 4.0
    assert changed.control.Dzref == parameters.load().control.Dzref == 3.0


@pytest.mark.parametrize("word", ["none", "null", [], None])
def test_no_limits_can_be_written_as_a_word(word):
    assert parameters.load({"control": {"thrust_limits": word}}).control.thrust_limits is None


def test_parameters_are_frozen():
    with pytest.raises(ValueError, match="frozen"):
        parameters.load().control.Kzref = 1.0
