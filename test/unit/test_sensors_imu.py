"""The IMU compared with closed-form solutions: at rest, falling, turning, accelerating."""

import math

import numpy as np
import pytest
from carried import GRAVITY, SUB_STEP, Carried, Circling, Flown

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, State
from drone_sim.sensors.imu import ImuParameters

FAST = ImuParameters(kind="imu", rate=200)
TILTED = frames.to_quaternion(frames.from_rpy((0, 0, 0), (0.7, -0.4, 2.0)))


def forces(carried, imu):
    return np.array([value.specific_force for value in carried.values(imu)])


def test_imu_at_rest_measures_the_supporting_force():
    drone = Flown(Pose((0, 0, 0.05)))
    imu = drone.fit(FAST)
    drone.step(400)
    drone.values(imu)
    drone.step(200)
    measured = forces(drone, imu)
    assert len(measured) == 200
    assert np.linalg.norm(measured, axis=1) == pytest.approx(np.full(200, 9.81), abs=1e-6)
    assert measured[:, 2] == pytest.approx(np.full(200, 9.81), abs=1e-6)
    assert drone.values(imu) == []


def test_imu_in_free_fall_measures_no_force_while_tumbling():
    drone = Flown(Pose((1, 2, 50), TILTED))
    mean = frames.from_rpy(drone.world.inertial_frame(drone.body)[3::4], (0, 0, 0))
    imu = drone.fit(FAST, mean)
    drone.step(1, torque=(1e-3, -2e-3, 3e-3))
    drone.values(imu)
    drone.step(200)
    assert math.hypot(*drone.state.angular_velocity) > 1e-3
    assert np.abs(forces(drone, imu)).max() < 1e-6


@pytest.mark.parametrize("rate", [200, 50, 20])
def test_imu_on_a_circle_measures_the_centripetal_acceleration(rate):
    body = Circling(radius=3.0, rate=1.2)
    imu = body.fit(ImuParameters(kind="imu", rate=rate))
    for _ in range(400):
        body.step()
    inwards = 3.0 * 1.2**2
    for value in body.values(imu):  # x points ahead, so the centre is on the left
        assert value.specific_force == pytest.approx((0.0, inwards, -GRAVITY), abs=0.005 * inwards)
        assert value.angular_velocity == pytest.approx((0, 0, 1.2), abs=1e-9)


def test_imu_off_the_axis_of_a_rotating_body_measures_the_centripetal_acceleration():
    drone = Flown(gravity=0.0, floor=False)
    imu = drone.fit(FAST, frames.from_rpy((0.2, 0.0, 0.0), (0, 0, 0)))
    drone.step(100, torque=(0, 0, 0.05))
    drone.values(imu)
    drone.step(100)
    rate = drone.state.angular_velocity[2]
    assert rate > 2.0
    assert forces(drone, imu) == pytest.approx(np.tile([-0.2 * rate**2, 0, 0], (100, 1)), rel=0.01, abs=0.01 * rate**2)


def test_mounted_imu_measures_in_its_own_axes():
    drone = Carried()
    imu = drone.fit(FAST, frames.from_rpy((0, 0, 0), (math.pi, 0, 0)))
    drone.look()
    (value,) = drone.values(imu)
    assert value.specific_force == pytest.approx((0, 0, -9.81))
    assert value.orientation == pytest.approx((1, 0, 0, 0), abs=1e-12)


def test_integrated_samples_give_the_motion_at_every_rate():
    """Integrate a flight with turns and a crash; no sample tells when in its period the crash was."""
    drone = Flown(Pose((0, 0, 1.0)))
    within = {200: 0.1, 40: 0.1, 20: 0.1}  # m/s
    imus = {rate: drone.fit(ImuParameters(kind="imu", rate=rate)) for rate in within}
    initial = drone.state
    for force, torque in [((1, 0, 5), (0, 2e-3, 0)), ((0, 1, 5), (1e-3, 0, 2e-3)), ((0.5, 0, 2), (0, 0, 0))] * 4:
        drone.step(20, force, torque)
    assert any(contact.body == drone.floor for contact in drone.world.queries.contacts(drone.body))
    for rate, imu in imus.items():
        velocity, turn = np.array(initial.linear_velocity), initial.orientation
        for value in drone.values(imu):
            turned = np.array(value.angular_velocity) / rate
            mean = (1 + rate / 200) / 2  # of the sub-steps' ends, in sample periods
            measured = frames.turned(frames.multiply_quaternions(turn, _rotation(turned * mean)), value.specific_force)
            turn = frames.multiply_quaternions(turn, _rotation(turned))
            velocity += np.add(measured, (0, 0, GRAVITY)) / rate
        assert velocity == pytest.approx(drone.state.linear_velocity, abs=within[rate])
        overlap = abs(np.dot(turn, drone.state.orientation))
        assert 2 * math.acos(min(1.0, overlap)) < 0.002


def _rotation(vector):
    angle = math.hypot(*vector)
    x, y, z = np.array(vector) * (math.sin(angle / 2) / angle if angle else 0.5)
    return x, y, z, math.cos(angle / 2)


def test_acceleration_matches_the_differentiated_odometry():
    drone = Flown(gravity=GRAVITY)
    imu = drone.fit(FAST)
    velocities, measured = [drone.state.linear_velocity], []
    for step in range(400):
        swing = math.sin(2 * math.pi * step * SUB_STEP)
        drone.step(1, (1.5 * swing, 0.8, 5.1012))
        velocities.append(drone.state.linear_velocity)
        measured += [frames.turned(drone.state.orientation, force) for force in forces(drone, imu)]
    expected = np.diff(velocities, axis=0)[:, :2] / SUB_STEP
    assert np.abs(expected).max() > 2.5
    assert np.array(measured)[:, :2] == pytest.approx(expected, rel=0.01, abs=1e-6)


def test_moving_the_body_causes_no_acceleration():
    drone = Flown(Pose((0, 0, 5)))
    imu = drone.fit(FAST)
    drone.step(100)  # 4.9 m/s downwards
    drone.values(imu)
    drone.move(Pose((3, 0, 5), TILTED))
    drone.step(2)
    assert np.abs(forces(drone, imu)).max() < 1e-6


def test_imu_messages():
    body = Carried(State((0, 0, 0), TILTED, (0, 0, 0), (0, 0, 0)))
    noise = {"linear_acceleration": {"density": 0.01}, "orientation": {"variance": 1e-4}}
    imu = body.fit(ImuParameters(kind="imu", rate=100, noise=noise))
    body.look()
    assert imu.readings == []
    body.look()
    header = imu.header(imu.latest)
    assert header == {"stamp": pytest.approx(0.01), "frame_id": "imu_link"}
    data, raw = (output.fields(imu.latest.value, header) for output in imu.outputs)
    assert [(output.suffix, output.kind) for output in imu.outputs] == [
        ("/data", "sensor_msgs/Imu"),
        ("/data_raw", "sensor_msgs/Imu"),
    ]
    assert raw["orientation_covariance"][0] == -1 and "orientation" not in raw
    assert data["orientation_covariance"] == [1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4]
    assert tuple(data["orientation"].values()) == pytest.approx(TILTED)
    assert raw["angular_velocity_covariance"] == [0.0] * 9
    assert raw["linear_acceleration_covariance"][4] == pytest.approx(0.01**2 * 100)
    assert raw["linear_acceleration"] == data["linear_acceleration"]
    assert imu.read() == data


def test_state_can_be_restored_in_the_middle_of_a_sample_period():
    noise = {"linear_acceleration": {"density": 0.01, "bias_walk": 0.1}, "angular_velocity": {"deviation": 0.1}}
    parameters = ImuParameters(kind="imu", rate=40, latency=0.02, noise=noise)
    body = Circling(2.0, 1.0)
    imu = body.fit(parameters)

    def fly(steps):
        for _ in range(steps):
            body.step()
        return list(imu.readings)

    fly(22)
    restore, count, state = imu.save_state(), body.count, body.state
    first = fly(30)
    for _ in range(2):
        restore()
        body.count, body.state = count, state
        assert fly(30) == first
    imu.reset()
    assert imu.latest is None and imu.readings == []
