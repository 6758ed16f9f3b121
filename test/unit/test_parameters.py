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
