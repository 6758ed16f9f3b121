"""Sensors on the tutorial's drone in a complete simulation: rates, snapshots, restarts, scripts."""

import math

import numpy as np
import pytest

from drone_sim.files.resources import package_path
from drone_sim.forces.pushes import Push
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.stepping import Diverged
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.modules import make_sim

ALL = {"config": str(package_path() / "config" / "sensors.yaml")}
EXACT = {"imu": {"kind": "imu", "rate": 200}, "odd": {"kind": "imu", "rate": 40, "topic": "odd"}}
FLYING = Twist(Vector3(0.8, -0.4, 0.1), Vector3(0, 0, 0.5))


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    def simulate(overrides=None, **others):
        return new_simulation(overrides or ALL, **others)

    return simulate


@pytest.fixture(name="still")
def _still(tmp_path):
    (tmp_path / "still.py").write_text("")
    return str(tmp_path / "still.py")


def fly(simulation, steps):
    """Run `steps` steps; return vehicle, sensor name and reading for each reading."""
    entries = []
    for _ in range(steps):
        simulation.step()
        for vehicle in simulation.vehicles.values():
            for name, sensor in vehicle.instruments.by_name.items():
                entries += [(vehicle.name, name, reading) for reading in sensor.readings]
    return entries


def test_every_sensor_measures_at_its_rate(simulate):
    readings = fly(simulate(), 100)
    counts = {name: sum(one[1] == name for one in readings) for name in parameters.load(ALL).sensors}
    expected = {"imu": 1000, "magnetic_field": 250, "pressure": 250, "range": 100, "contacts": 100, "battery": 50}
    assert counts == {**expected, "fix": 24}  # one more is delayed by its latency
    at = [reading.at for _, name, reading in readings if name == "imu"]
    assert at == list(range(1, 1001))


def test_sensors_do_not_change_the_flight(simulate):
    with_sensors, without = simulate(), simulate({"cameras": {}})
    for simulation in (with_sensors, without):
        simulation.drone.commands.receive(FLYING)
        fly(simulation, 100)
    assert with_sensors.drone.body.state == without.drone.body.state


def test_the_same_flight_has_the_same_readings(simulate):
    first, second = simulate(), simulate()
    for simulation in (first, second):
        simulation.drone.commands.receive(FLYING)
    assert fly(first, 60) == fly(second, 60)


def test_readings_are_the_same_after_a_restore_and_a_restart(simulate):
    simulation = simulate()
    beginning = fly(simulation, 20)
    simulation.drone.commands.receive(FLYING)
    fly(simulation, 3)
    snapshot = simulation.snapshot()
    first = fly(simulation, 40)
    for _ in range(2):
        simulation.restore(snapshot)
        assert fly(simulation, 40) == first
    simulation.stop()
    simulation.start()
    assert fly(simulation, 20) == beginning


def test_two_drones_have_independent_noise(simulate, still):
    simulation = simulate({**ALL, "vehicles": 2}, script=still)
    readings = fly(simulation, 10)
    biases = {
        name: np.mean([one.value.specific_force for who, what, one in readings if (who, what) == (name, "imu")], axis=0)
        for name in simulation.vehicles
    }
    assert np.abs(biases["drone1"] - biases["drone2"]).max() > 0.02
    assert {"imu", "imu#0"} <= set(simulation.context.objects.names)


def test_contacts_name_the_touched_object(simulate, still):
    box = {"shape": "box", "size": [9, 9, 0.2], "position": [0, 0, 0.1]}
    for named, expected in (({"name": "Table"}, "Table"), ({}, "Cuboid")):
        scene = {"objects": [{**box, **named}]}
        simulation = simulate({**ALL, "scene": scene, "drone": {"position": [0, 0, 0.4]}}, script=still)
        samples = [one.value for _, name, one in fly(simulation, 20) if name == "contacts"]
        touched = {contact.what for sample in samples for contact in sample.contacts}
        assert touched == {expected}


def test_contacts_between_two_drones_are_measured(simulate, still):
    """drone2 falls onto drone1, which lies on the floor."""
    pair = {"drone1": {"position": [0, 0, 0.1]}, "drone2": {"position": [0, 0, 0.5]}}
    simulation = simulate({**ALL, "vehicles": pair}, script=still)
    touched = {name: set() for name in pair}
    for who, name, one in fly(simulation, 30):
        if name == "contacts":
            touched[who] |= {contact.what for contact in one.value.contacts}
    assert "drone2" in touched["drone1"] and "Floor" in touched["drone1"]
    assert "drone1" in touched["drone2"]


def test_measured_acceleration_matches_the_odometry(simulate):
    simulation = simulate({"sensors": EXACT})
    fly(simulation, 20)
    simulation.drone.commands.receive(Twist(Vector3(1.5, 0.5, 0)))
    velocities, measured = [simulation.drone.body.state.linear_velocity], []
    for _ in range(60):
        mean = np.zeros(3)
        simulation.step()
        for reading in simulation.drone.instruments.by_name["imu"].readings:
            mean += np.array(frames.turned(reading.value.orientation, reading.value.specific_force)) / 10
        measured.append(mean)
        velocities.append(simulation.drone.body.state.linear_velocity)
    expected = np.diff(velocities, axis=0) / 0.05
    assert np.abs(expected[:, :2]).max() > 1.0
    assert np.array(measured)[:, :2] == pytest.approx(expected[:, :2], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("size", [5.3, 10.0, 20.0, 60.0])
def test_imu_of_a_drone_on_a_floor_of_any_size_measures_gravity(simulate, still, size):
    scene = {"floor": {"size": size}}
    simulation = simulate({"sensors": EXACT, "scene": scene, "drone": {"position": [0, 0, 0.05]}}, script=still)
    fly(simulation, 100)
    measured = np.array([one.value.specific_force for _, _, one in fly(simulation, 40)])
    assert measured[:, 2] == pytest.approx(np.full(len(measured), 9.81), abs=1e-6)
    assert np.linalg.norm(measured, axis=1) == pytest.approx(measured[:, 2], abs=1e-6)


def test_moving_and_restoring_cause_no_acceleration(simulate):
    simulation = simulate({"sensors": EXACT})
    simulation.drone.commands.receive(Twist(Vector3(2, 0, 0)))
    fly(simulation, 40)
    snapshot = simulation.snapshot()
    fly(simulation, 20)
    simulation.drone.body.move(Pose((0, 0, 3)))
    fly(simulation, 1)
    strongest = [math.hypot(*one.value.specific_force) for _, _, one in fly(simulation, 1)]
    assert max(strongest) < 12
    simulation.restore(snapshot)
    assert max(math.hypot(*one.value.specific_force) for _, _, one in fly(simulation, 1)) < 12


def test_snapshot_in_the_middle_of_a_camera_period(simulate):
    small = {"width": 8, "height": 6, "every": 3}
    simulation = simulate({"cameras": {"front": small}})
    front = simulation.drone.cameras["front"]
    front.viewers.add(lambda: True)
    fly(simulation, 3)
    assert front.latest.at == 3 and front.image is front.latest.value
    fly(simulation, 1)
    assert front.image is None and front.latest.at == 3
    snapshot, latest = simulation.snapshot(), front.latest
    fly(simulation, 2)
    assert front.latest.at == 6
    simulation.restore(snapshot)
    assert front.latest is latest
    simulation.stop()
    assert front.latest is None and front.image is None


def test_diverged_flight_with_sensors_ends_as_without_them(simulate):
    simulation = simulate()
    fly(simulation, 3)
    simulation.drone.pushes.add(Push((0.0, 0.0, float("nan")), (0.0, 0.0, 0.0), 1.0))
    with pytest.raises(Diverged, match="the simulation has diverged"):
        fly(simulation, 3)


def test_the_stock_range_sensor_of_a_landed_drone_is_above_the_floor(simulate):
    simulation = simulate({**ALL, "start": "landed"})
    fly(simulation, 2)
    sensor = simulation.drone.instruments.by_name["range"]
    reading = sensor.latest.value
    assert 0 < frames.position(sensor.mounting.pose())[2] < sensor.parameters.min_range
    assert reading.distance == -math.inf  # REP-117: nearer than the minimum range
    assert (reading.hit.what, reading.hit.distance) == ("Floor", pytest.approx(0, abs=2e-3))
    assert reading.hit.normal == pytest.approx((0, 0, 1), abs=1e-9)
    assert reading.normal == pytest.approx((0, 0, -1), abs=1e-9)


# ---- scripts


@pytest.fixture(name="sim")
def _sim(simulate):
    box = {"name": "Box", "shape": "box", "size": [1, 1, 0.3], "position": [0, 0, 0.15]}
    sensors = {"down": {"kind": "range", "rate": 20, "min_range": 0.05, "max_range": 2.0}, **EXACT}
    simulation = simulate({"sensors": sensors, "scene": {"objects": [box]}})
    sim = make_sim(simulation.child_scripts["drone"], SceneServices(operations=simulation.operations))
    return simulation, sim


def test_script_reads_a_range_sensor_as_in_v_rep(sim):
    simulation, sim = sim
    ray = sim.getObject("/down")
    assert sim.readProximitySensor(ray) == (-1, 0.0, [0.0, 0.0, 0.0], -1, [0.0, 0.0, 0.0])
    simulation.step()
    state, distance, point, hit_object, normal = sim.readProximitySensor(ray)
    height = simulation.drone.body.state.position[2]
    assert (state, hit_object) == (1, sim.getObject("/Box"))
    assert distance == pytest.approx(height - 0.3, abs=1e-3)
    in_world = sim.multiplyVector(sim.getObjectMatrix(ray, -1), point)
    assert in_world == pytest.approx([0, 0, 0.3], abs=1e-3)
    assert normal == pytest.approx([0, 0, -1], abs=1e-3)
    simulation.drone.body.move(Pose((0, 0, 3)))
    simulation.step()
    assert sim.readProximitySensor(ray)[0] == 0
    simulation.drone.body.move(Pose((3, 0, 1)))
    simulation.step()
    assert sim.readProximitySensor(ray)[3] == sim.getObject("/Floor")


def test_script_reads_a_sensor_as_its_message(sim):
    simulation, sim = sim
    imu = sim.getObject("/imu")
    assert sim.readSensor(imu) is None
    simulation.step()
    read = sim.readSensor(imu)
    assert read["header"] == {"stamp": pytest.approx(0.05), "frame_id": "imu_link"}
    assert read["linear_acceleration"]["z"] > 9
    assert sim.readSensor(sim.getObject("/down"))["range"] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda sim: sim.readProximitySensor(sim.getObject("/imu")), "'imu' is neither a range sensor"),
        (lambda sim: sim.readSensor(sim.getObject("/Box")), "known are down, imu, odd"),
        (lambda sim: sim.readSensor(9999), "no object with the handle 9999"),
    ],
)
def test_invalid_sensor_handle_is_reported(sim, call, words):
    with pytest.raises((TypeError, ValueError), match=words):
        call(sim[1])


@pytest.mark.parametrize(
    "name, text",
    [
        (
            "reads.py",
            "def sysCall_init():\n    self.down = sim.getObject('/down')\n"
            "def sysCall_sensing():\n    found = sim.readProximitySensor(self.down)\n"
            "    sim.setFloatSignal('distance', found[1])\n"
            "    sim.setFloatSignal('felt', sim.readSensor(sim.getObject('/imu'))['linear_acceleration']['z'])\n",
        ),
        (
            "reads.lua",
            "function sysCall_init() down = sim.getObject('/down') end\n"
            "function sysCall_sensing()\n    local state, distance = sim.readProximitySensor(down)\n"
            "    sim.setFloatSignal('distance', distance)\n"
            "    sim.setFloatSignal('felt', sim.readSensor(sim.getObject('/imu')).linear_acceleration.z)\nend\n",
        ),
    ],
)
def test_python_and_lua_scripts_read_sensors(simulate, tmp_path, name, text):
    (tmp_path / name).write_text(text)
    sensors = {"down": {"kind": "range", "rate": 20, "min_range": 0.05, "max_range": 2.0}, **EXACT}
    simulation = simulate({"sensors": sensors, "gravity": 0.0}, script=str(tmp_path / name))
    fly(simulation, 2)
    assert simulation.context.signals.get(float, "distance") == pytest.approx(0.8, abs=1e-3)
    assert simulation.context.signals.get(float, "felt") == pytest.approx(0.0, abs=1e-9)
