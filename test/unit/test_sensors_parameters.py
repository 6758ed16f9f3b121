"""The parameter `sensors` and the messages for its errors."""

import pytest

from drone_sim.files.resources import package_path
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

ALL = str(package_path() / "config" / "sensors.yaml")
IMU = {"kind": "imu", "rate": 200}
RANGE = {"kind": "range", "rate": 20, "min_range": 0.1, "max_range": 4.0}
BATTERY = {
    **{"kind": "battery", "rate": 10, "cells": 3, "capacity": 1.0, "full": 4.2, "empty": 3.3, "resistance": 0.1},
    **{"hover_power": 60.0, "idle_power": 6.0},
}
DOWN = {"position": [0, 0, -0.1], "rpy": [0, 1.5708, 0]}


def load_error(overrides):
    with pytest.raises(parameters.ParameterError) as error:
        Simulation(parameters.load(overrides)).close()
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    "sensors, words",
    [
        ({"imu": 3}, "sensors/imu = 3: must have `key: value` lines, one of them `kind`"),
        ({"imu": {"rate": 200}}, "sensors/imu/kind: missing; must be one of 'imu', 'range', 'magnetic_field'"),
        ({"imu": {"kind": "lidar"}}, "sensors/imu/kind = 'lidar': must be one of 'imu', 'range'"),
        ({"imu": {**IMU, "rat": 1}}, "sensors/imu/rat: unknown key; near names are rate"),
        ({"imu": {"kind": "imu"}}, "sensors/imu/rate: missing"),
        (
            {"imu": {**IMU, "rate": 150}},
            "sensors/imu/rate = 150: its period must be a whole multiple of sub_step = 0.005",
        ),
        ({"imu": {**IMU, "rate": 150}}, "200 Hz is near"),
        ({"imu": {**IMU, "rate": 1000}}, "sensors/imu/rate = 1000: its period must be"),
        ({"imu": {**IMU, "rate": 0}}, "sensors/imu/rate = 0: input should be greater"),
        ({"imu": {**IMU, "latency": 0.007}}, "sensors/imu/latency = 0.007: must be a whole multiple of sub_step"),
        ({"imu": {**IMU, "noise": {"angular_velocity": {"density": -1}}}}, "noise/angular_velocity/density = -1"),
        ({"imu": {**IMU, "noise": {"gyro": {}}}}, "sensors/imu/noise/gyro: unknown key; known are"),
        ({"imu": {**IMU, "seed": -1}}, "sensors/imu/seed = -1"),
        ({"imu": {**IMU, "mount": {"rpy": [0, 0]}}}, "sensors/imu/mount/rpy = [0, 0]: must be 3 numbers"),
        ({"imu": {**IMU, "topic": "odom/"}}, "sensors/imu/topic = 'odom/': must be like rear/image"),
        (
            {"range": {**RANGE, "topic": "odom"}},
            "sensors/range/topic = 'odom': its range would be odom, which is the drone's",
        ),
        (
            {"range": {**RANGE, "topic": "imu/data"}, "imu": IMU},
            "sensors/imu/topic = 'imu': its data would be imu/data",
        ),
        ({"range": {**RANGE, "topic": "front"}}, "which is the image of cameras/front"),
        ({"a": IMU, "b": {**IMU, "topic": "b", "object": "a"}}, "sensors/b/object = 'a': is the object of sensors/a"),
        ({"a": {**IMU, "object": "FrontVision"}}, "sensors/a/object = 'FrontVision': is the object of cameras/front"),
        ({"range": {**RANGE, "min_range": 4.0}}, "sensors/range/min_range = 4: must be less than max_range = 4"),
        ({"range": {**RANGE, "radiation": "sound"}}, "radiation = 'sound': input should be 'ultrasound' or 'infrared'"),
        ({"battery": {**BATTERY, "empty": 5.0}}, "sensors/battery/empty = 5: must be at most full = 4.2"),
        ({"battery": {**BATTERY, "idle_power": 99}}, "sensors/battery/idle_power = 99: must be at most hover_power"),
        ({"battery": {"kind": "battery", "rate": 10}}, "sensors/battery: cells, capacity, full, empty, resistance"),
        (
            {"a": IMU, "b": {**IMU, "topic": "b", "mount": DOWN}},
            "sensors/b/frame = 'imu_link': is already the frame of sensors/a",
        ),
        ({"a": {**IMU, "frame": "Track_base"}}, "sensors/a/frame = 'Track_base': is already the frame of the vehicle"),
        (
            {"a": {**IMU, "frame": "track_optical"}},
            "sensors/a/frame = 'track_optical': is already the frame of cameras/track",
        ),
        ({f"s{number}": {} for number in range(70)}, "parameter sensors"),
        ({"a": {**IMU, "frame": "base_link", "mount": DOWN}}, "sensor a: the URDF already has a link base_link"),
        ({"a": {**IMU, "mount": {**DOWN, "parent": "Nobody"}}}, "sensor a: no object is named Nobody"),
        ({"Drone": IMU}, "sensor Drone: an object named 'Drone' already exists"),
    ],
)
def test_an_invalid_sensor_raises_a_one_line_error(sensors, words):
    assert words in load_error({"sensors": sensors})


def test_error_names_the_line_of_the_file(tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text("sensors:\n  imu:\n    kind: imu\n    rate: 150\n")
    assert load_error({"config": str(file)}).startswith(f"{file}: line 4: parameter sensors/imu/rate = 150")
    file.write_text("sensors:\n  imu:\n    kind: imu\n    rate: 100\n    noise: {angular_velocity: {densty: 1}}\n")
    assert f"{file}: line 5: parameter sensors/imu/noise/angular_velocity/densty: unknown key" in load_error(
        {"config": str(file)}
    )


def test_error_in_one_vehicle_names_the_vehicle():
    fleet = {"drone1": {}, "drone2": {"sensors": {"imu": {"rate": 150}}}}
    assert "vehicles/drone2/sensors/imu/rate = 150" in load_error({"sensors": {"imu": IMU}, "vehicles": fleet})


def test_there_are_no_sensors_by_default():
    assert parameters.load().sensors == {}


def test_sensors_yaml_defines_every_kind_of_sensor():
    loaded = parameters.load({"config": ALL})
    assert {sensor.kind for sensor in loaded.sensors.values()} == {
        *("imu", "range", "magnetic_field", "pressure", "fix", "contacts", "battery")
    }
    assert [*loaded.sensors] == [*loaded.fleet[0].sensors]


@pytest.mark.parametrize("datum", [{"latitude": 91}, {"longitude": 200}, {"altitude": 1e5}, {"height": 3}])
def test_invalid_datum_is_refused(datum):
    assert f"scene/datum/{next(iter(datum))}" in load_error({"scene": {"datum": datum}})


def test_scene_file_may_set_datum_and_magnetic_field(tmp_path, new_simulation):
    file = tmp_path / "scene.yaml"
    file.write_text("datum: {latitude: -33.5, altitude: 10}\nmagnetic_field: [0, 2.4e-5, 5.1e-5]\n")
    loaded = parameters.load({"scene_file": str(file)}).scene
    assert (loaded.datum.latitude, loaded.datum.longitude, loaded.datum.altitude) == (-33.5, 8.545594, 10.0)
    assert loaded.magnetic_field == (0.0, 2.4e-5, 5.1e-5)
    simulation = new_simulation({"scene_file": str(file)})
    simulation.save_scene(tmp_path / "saved.yaml")
    assert parameters.load({"scene_file": str(tmp_path / "saved.yaml")}).scene.datum == loaded.datum
