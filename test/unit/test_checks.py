"""Checks of twists and poses that arrive from outside: the refused values and their messages."""

import math

import pytest

from drone_sim.run import parameters
from drone_sim.vehicles import checks

PARAMETERS = parameters.load()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 21.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_twist_out_of_range_is_refused(value, axis):
    linear = [0.0, 0.0, 0.0]
    linear[axis] = value
    with pytest.raises(checks.Refused, match=f"linear.{'xyz'[axis]} = {value}: must lie within \\+-20.0 m/s"):
        checks.twist(linear, (0, 0, 0), PARAMETERS)


def test_a_valid_twist_passes_unchanged():
    assert checks.twist((1, -2, 3), (0.1, 0.2, -0.3), PARAMETERS) == ((1, -2, 3), (0.1, 0.2, -0.3))


@pytest.mark.parametrize(
    "position, orientation, message",
    [
        ((math.nan, 0, 1), (0, 0, 0, 1), "position.x = nan"),
        ((0, 1e9, 1), (0, 0, 0, 1), "position.y = 1000000000.0: must lie between -1000.0 and 1000.0 m"),
        ((0, 0, -1), (0, 0, 0, 1), "position.z = -1: must lie between 0.0 and 1000.0 m"),
        ((0, 0, 1), (0, 0, 0, 0), "must be a unit quaternion, its length is 0"),
        ((0, 0, 1), (0, 0, math.nan, 1), "must be a unit quaternion, its length is nan"),
    ],
)
def test_an_invalid_pose_is_refused(position, orientation, message):
    with pytest.raises(checks.Refused, match=message):
        checks.pose(position, orientation, PARAMETERS)


def test_a_nearly_unit_quaternion_is_normalised():
    orientation = checks.pose((0, 0, 1), (0, 0, 0.7072, 0.7072), PARAMETERS).orientation
    assert math.hypot(*orientation) == pytest.approx(1, abs=1e-15)
