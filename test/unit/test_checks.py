"""Commands from outside: what is refused, and with which words."""

import math

import pytest

from drone_sim.run import parameters
from drone_sim.vehicles import checks

PARAMETERS = parameters.load()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 21.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_twists_that_no_drone_could_fly(value, axis):
    linear = [0.0, 0.0, 0.0]
    linear[axis] = value
    with pytest.raises(checks.Refused, match=f"linear.{'xyz'[axis]} = {value}: must lie within \\+-20.0 m/s"):
        checks.twist(linear, (0, 0, 0), PARAMETERS)


def test_a_good_twist_passes_unchanged():
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
def test_poses_where_nothing_could_stand(position, orientation, message):
    with pytest.raises(checks.Refused, match=message):
        checks.pose(position, orientation, PARAMETERS)


def test_a_nearly_unit_quaternion_is_made_unit():
    orientation = checks.pose((0, 0, 1), (0, 0, 0.7072, 0.7072), PARAMETERS).orientation
    assert math.hypot(*orientation) == pytest.approx(1, abs=1e-15)
