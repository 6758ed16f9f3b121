"""The tutorial's control law: signs of the mixing, limits, the track frame, and the command's timeout."""

import math

import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, Twist, Vector3

FRONT_LEFT, BACK_LEFT, BACK_RIGHT, FRONT_RIGHT = range(4)


@pytest.fixture(name="fly")
def _fly(new_simulation):
    return lambda **overrides: new_simulation(overrides)


def velocities_after(simulation, twist):
    simulation.step()
    simulation.drone.commands.receive(twist)
    simulation.step()  # its sensing phase reads the command
    simulation.step()  # this actuation phase applies the result
    return simulation.drone.propulsion.particle_velocities


@pytest.mark.parametrize(
    "twist, faster, slower",
    [
        (Twist(Vector3(1, 0, 0)), (BACK_LEFT, BACK_RIGHT), (FRONT_LEFT, FRONT_RIGHT)),
        (Twist(Vector3(-1, 0, 0)), (FRONT_LEFT, FRONT_RIGHT), (BACK_LEFT, BACK_RIGHT)),
        (Twist(Vector3(0, 1, 0)), (BACK_RIGHT, FRONT_RIGHT), (FRONT_LEFT, BACK_LEFT)),
        (Twist(Vector3(0, -1, 0)), (FRONT_LEFT, BACK_LEFT), (BACK_RIGHT, FRONT_RIGHT)),
        (Twist(Vector3(), Vector3(0, 0, 1)), (BACK_LEFT, FRONT_RIGHT), (FRONT_LEFT, BACK_RIGHT)),
        (Twist(Vector3(), Vector3(0, 0, -1)), (FRONT_LEFT, BACK_RIGHT), (BACK_LEFT, FRONT_RIGHT)),
    ],
)
def test_a_command_speeds_up_the_right_propellers(fly, twist, faster, slower):
    velocities = velocities_after(fly(), twist)
    assert min(velocities[i] for i in faster) > max(velocities[i] for i in slower) + 0.1


def test_a_vertical_command_speeds_up_all_propellers_equally(fly):
    velocities = velocities_after(fly(), Twist(Vector3(0, 0, 1)))
    assert velocities == pytest.approx([velocities[0]] * 4)
    assert velocities[0] == pytest.approx(5.33 + 1.0, abs=0.2)


@pytest.mark.parametrize("limits, expected", [([3, 8], 8.0), ("none", 5.33 + 5 * 2)])
def test_the_mean_particle_velocity_stays_within_the_thrust_limits(fly, limits, expected):
    simulation = fly(control={"thrust_limits": limits}, drone={"position": [0, 0, 5]})
    simulation.drone.body.move(Pose((0, 0, 3)))
    simulation.step()
    simulation.step()
    assert sum(simulation.drone.propulsion.particle_velocities) / 4 == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize("roll, pitch, yaw", [(0.3, 0, 0), (0, 0.3, 0), (0.2, -0.3, 2.5)])
def test_track_frame_is_level_and_follows_the_yaw(fly, roll, pitch, yaw):
    simulation = fly()
    simulation.drone.body.move(Pose((1, 2, 3), frames.to_quaternion(frames.from_rpy((0, 0, 0), (roll, pitch, yaw)))))
    simulation.step()
    track, drone = simulation.drone.track.matrix(), simulation.drone.body.matrix
    base = simulation.context.objects.matrix(simulation.context.objects.handle("Quadricopter_base"))
    assert frames.position(track) == pytest.approx(frames.position(base))
    assert frames.rotate(track, (0, 0, 1)) == pytest.approx((0, 0, 1))
    assert frames.to_euler(track)[2] == pytest.approx(frames.to_euler(drone)[2])


def test_vx_is_along_the_track_frame(fly):
    simulation = fly(drone={"yaw": math.pi / 2})
    simulation.step()
    simulation.drone.commands.receive(Twist(Vector3(1, 0, 0)))
    for _ in range(40):
        simulation.step()
    vx, vy, _ = simulation.drone.body.state.linear_velocity
    assert vy > 0.5
    assert abs(vx) < 0.05


def test_without_a_timeout_the_last_command_stays_in_force(fly):
    simulation = fly()
    simulation.drone.commands.receive(Twist(Vector3(0, 0, 0.5)))
    for _ in range(400):
        simulation.step()
    assert simulation.drone.body.state.linear_velocity[2] == pytest.approx(0.5, rel=0.05)


def test_a_timeout_zeroes_the_command(fly):
    simulation = fly(cmd_vel_timeout=1.0)
    simulation.drone.commands.receive(Twist(Vector3(0, 0, 0.5)))
    for _ in range(20):
        simulation.step()
        assert simulation.drone.commands.now.linear.z == 0.5
    simulation.step()
    assert simulation.drone.commands.now == Twist()
