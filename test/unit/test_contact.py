"""Contact with a wall or a box: the drone stays stable and comes free after the command is reversed."""

import math

import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Twist, Vector3

pytestmark = pytest.mark.long

WALL = {"shape": "box", "size": [0.2, 60, 4], "position": [2.1, 0, 2]}
BOX = {"shape": "box", "size": [1, 1, 0.4], "position": [0, 0, 0.2]}
EDGE = {**BOX, "position": [0.45, 0, 0.2]}
MINUTE = 60.0  # s


class Flight:
    """A drone among objects, with the largest turn rate and tilt of its flight."""

    def __init__(self, new_simulation, *objects, yaw=0.0, **overrides):
        scene = {"floor": {"size": 60}, "objects": list(objects)}
        self.simulation = new_simulation({"scene": scene, "drone": {"yaw": yaw}, **overrides})
        self.fastest_turn = self.most_tilt = 0.0

    def fly(self, command, seconds):
        """Fly a command (vx, vy, vz, wz) whose vx and vy are along the world's axes at the present yaw."""
        (vx, vy, vz, wz), yaw = command, frames.to_euler(self.simulation.drone.track.matrix())[2]
        ahead, left = vx * math.cos(yaw) + vy * math.sin(yaw), vy * math.cos(yaw) - vx * math.sin(yaw)
        self.simulation.drone.commands.receive(Twist(Vector3(ahead, left, vz), Vector3(0, 0, wz)))
        for _ in range(round(seconds / 0.05)):
            self.simulation.step()
            drone = self.simulation.drone
            self.fastest_turn = max(self.fastest_turn, math.hypot(*drone.body.state.angular_velocity))
            self.most_tilt = max(self.most_tilt, math.acos(min(1.0, drone.body.matrix[10])))
        return self.simulation.drone.body.state

    def assert_comes_free(self):
        x = self.simulation.drone.body.state.position[0]
        for _ in range(
            9
        ):  # the wall turns the drone, so the direction is corrected every second: it sticks for 2 to 4 s
            away = self.fly((-1, 0, 0, 0), 1)
        assert away.position[0] < x - 1.5
        rest = self.fly((0, 0, 0, 0), 9)
        assert math.hypot(*rest.linear_velocity, *rest.angular_velocity) < 0.02
        assert self.most_tilt < 0.95
        assert self.fastest_turn < 5.0


@pytest.mark.parametrize(("speed", "yaw"), [(0.5, 0.0), (0.5, math.pi), (1.0, 0.0), (1.0, 0.5), (1.0, -1.2)])
def test_a_drone_comes_free_after_a_minute_against_a_wall(new_simulation, speed, yaw):
    flight = Flight(new_simulation, WALL, yaw=yaw)
    pushed = flight.fly((speed, 0, 0, 0), MINUTE)
    assert pushed.position[0] == pytest.approx(1.85, abs=0.05)
    assert pushed.position[2] == pytest.approx(0.8, abs=0.15)
    flight.assert_comes_free()


@pytest.mark.parametrize(
    "command",
    [(0.3, 1, 0, 0), (0.5, 1, 0, 0), (1, 1, 0, 0), (1, -1, 0, 0), (1, 0, 0.3, 0), (1, 0, 0, 1), (0.6, -0.6, 0, 0)],
)
def test_a_drone_comes_free_after_scraping_along_a_wall(new_simulation, command):
    flight = Flight(new_simulation, WALL)
    scraped = flight.fly(command, 10)
    assert scraped.position[0] < 1.9
    flight.assert_comes_free()


@pytest.mark.parametrize("things, top", [((), 0.0), ((BOX,), 0.4), ((EDGE,), 0.4)])
def test_a_drone_lands_on_floor_box_or_edge_and_takes_off_again(new_simulation, things, top):
    flight = Flight(new_simulation, *things)
    landed = flight.fly((0, 0, -0.5, 0), MINUTE)
    assert landed.position[2] == pytest.approx(top + 0.01, abs=0.01)
    flown = flight.fly((0, 0, 0.5, 0), 5)
    assert flown.position[2] > top + 1.0
    assert flight.most_tilt < 0.05


def test_propeller_velocity_limits_prevent_a_throw_off_the_wall(new_simulation):
    """Without limits the bare control law throws the drone off the wall with particle velocities of hundreds of m/s."""
    bare = {"thrust_limits": "none", "recovery_margin": "none"}
    without_limits = Flight(new_simulation, WALL, control=bare, propellers={"velocity_limits": "none"})
    without_limits.fly((1, 0, 0, 0), 10)
    with_limits = Flight(new_simulation, WALL, control=bare, propellers={"velocity_limits": [0, 12]})
    with_limits.fly((1, 0, 0, 0), 10)
    assert with_limits.fastest_turn < 5.0 < without_limits.fastest_turn
