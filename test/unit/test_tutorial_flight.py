"""Flight of the tutorial's drone with V-REP's numbers: hover, commands, and return from displacements."""

import itertools
import math

import pytest

from drone_sim.mechanics.state import Pose, Twist, Vector3

pytestmark = pytest.mark.long

FORWARD, LEFT, UP = Twist(Vector3(1, 0, 0)), Twist(Vector3(0, 1, 0)), Twist(Vector3(0, 0, 1))
TURN = Twist(Vector3(), Vector3(0, 0, 1))
COMMANDS = {"vx": (FORWARD, 0), "vy": (LEFT, 1), "vz": (UP, 2), "wz": (TURN, 5)}  # command and its index in `velocity`
STARTS = list(
    itertools.product(
        (0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0),  # m, above the height to hold
        # rad, tilt, and azimuth of its axis
        [(0.0, 0.0), *itertools.product((0.3, 0.6, 0.9, 1.2), (0.0, math.pi / 4, math.pi / 2, 0.9 * math.pi))],
    )
)


@pytest.fixture(name="simulation")
def _simulation(new_simulation):
    return new_simulation()


def fly(simulation, seconds):
    for _ in range(round(seconds / simulation.parameters.time_step)):
        simulation.step()


def velocity(simulation):
    state = simulation.drone.body.state
    return (*state.linear_velocity, *state.angular_velocity)


def test_hover_holds_the_height_for_a_minute(simulation):
    for _ in range(1200):
        simulation.step()
        assert simulation.drone.body.state.position == pytest.approx((0, 0, 0.8), abs=1e-3)


@pytest.mark.parametrize("name, reached", [("vx", 0.911), ("vy", 0.923), ("vz", 0.998), ("wz", 1.0)])
def test_a_command_reaches_its_velocity_in_5_s_and_ends_at_rest_in_8_s(simulation, name, reached):
    command, index = COMMANDS[name]
    fly(simulation, 1)
    simulation.drone.commands.receive(command)
    fly(simulation, 5)
    assert velocity(simulation)[index] == pytest.approx(reached, rel=0.02)
    simulation.drone.commands.receive(Twist())
    fly(simulation, 8)
    assert velocity(simulation) == pytest.approx([0.0] * 6, abs=0.02)


BARE = {"thrust_limits": "none", "recovery_margin": "none"}


@pytest.mark.parametrize(
    "control, propellers, lowest, highest",
    [
        ({}, {}, 153, 153),
        ({"recovery_margin": "none"}, {"velocity_limits": "none"}, 149, 153),
        (BARE, {"velocity_limits": "none"}, 102, 112),
    ],
)
def test_displaced_starts_return_to_rest(control, propellers, lowest, highest, new_simulation):
    own = {"control": control, "propellers": propellers}
    simulation = new_simulation({**own, "drone": {"position": [0, 0, 5]}})
    begin = simulation.snapshot()
    returned = 0
    for start in STARTS:
        simulation.restore(begin)
        returned += returns_to_rest(simulation, *start)
    assert lowest <= returned <= highest


def returns_to_rest(simulation, above, tilted):
    """Return whether the drone is at rest at 5 m after 12 s, or before that for a whole second."""
    tilt, azimuth = tilted
    half = math.sin(tilt / 2)
    turn = (half * math.cos(azimuth), half * math.sin(azimuth), 0.0, math.cos(tilt / 2))
    simulation.drone.body.move(Pose((0.0, 0.0, 5.0 + above), turn))
    still = 0
    for _ in range(240):
        simulation.step()
        still = still + 1 if is_still(simulation.drone) else 0
        if still == 20:
            break
    return still > 0


def is_still(drone):
    speed, lean = math.hypot(*drone.body.state.linear_velocity), math.acos(min(1.0, drone.body.matrix[10]))
    return abs(drone.body.state.position[2] - 5.0) < 0.02 and speed < 0.05 and lean < 0.02
