"""Faults of a vehicle: propellers against theory, a slow and lossy radio link, sensors; all reproducible."""

import collections
import math
import re
from pathlib import Path

import numpy as np
import pytest

from drone_sim.forces.pushes import Push
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.offline import timeline
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError
from drone_sim.vehicles.radio_link import LinkParameters, RadioLink
from drone_sim.vehicles.types import QUADRICOPTER

FORWARD = Twist(Vector3(0.5, 0.0, 0.0))
SMALL = {name: {"width": 16, "height": 12} for name in ("front", "depth")}
SENSORS = {
    "imu": {"kind": "imu", "rate": 100, "noise": {"linear_acceleration": {"deviation": 0.1}}},
    "range": {"kind": "range", "rate": 20, "min_range": 0.04, "max_range": 4.0, "noise": {"deviation": 0.01}},
}
WIFI = {"latency": 0.2, "jitter": 0.1, "loss": 0.2}


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    def simulate(**overrides):
        return new_simulation({"cameras": SMALL, "drone": {"position": [0, 0, 5]}, **overrides})

    return simulate


def fly(simulation, steps, each=lambda: None):
    """Return pairs of the state after each step and the result of `each`."""
    results = []
    for _ in range(steps):
        simulation.step()
        results.append((simulation.drone.body.state, each()))
    return results


# ---- propellers


@pytest.mark.parametrize("number", range(4))
@pytest.mark.parametrize("share", [0.7, 0.0])
def test_a_weak_propeller_causes_the_angular_acceleration_of_its_lost_torque(simulate, number, share):
    """I α = Σ (r × f + reaction torque) holds while the drone turns slowly, so only the first step is checked."""
    simulation = simulate()
    fly(simulation, 20)
    drone = simulation.drone
    before = np.array(drone.body.state.angular_velocity)
    shares = [share if index == number else 1.0 for index in range(4)]
    drone.change_faults({"propellers": shares})
    fly(simulation, 1)
    torque = np.zeros(3)
    for one, (_, sense), link in zip(range(4), QUADRICOPTER.rotors, drone.propulsion.rotors.links):
        velocity = shares[one] * drone.propulsion.particle_velocities[one]
        thrust = drone.body.thrusts[one]
        point = frames.position(frames.multiply(drone.body.inertial_from_root, link))
        torque += np.cross(point, (0, 0, thrust))
        torque[2] += sense * 0.002 * velocity
    acceleration = (np.array(drone.body.state.angular_velocity) - before) / 0.05
    expected = np.linalg.solve(drone.body.rigid.inertia, torque)
    assert acceleration[:2] == pytest.approx(expected[:2], rel=5e-3)
    assert acceleration[2] == pytest.approx(expected[2], rel=0.05)  # small, and the drone turns in the step


def test_a_propeller_with_a_tenth_less_thrust_causes_yaw_and_drift(simulate):
    """All four thrusts become equal again when every correction is d = -(1 - e) / (1 + 3e) for efficiency e."""
    simulation = simulate(faults={"propellers": [0.9, 1, 1, 1]})
    state = fly(simulation, 300)[-1][0]
    correction = -0.1 / 3.7
    track = frames.rotate(frames.invert(simulation.drone.track.matrix()), state.linear_velocity)
    assert state.angular_velocity[2] == pytest.approx(-correction, rel=1e-3)  # Dyaw = 1
    # When level, Pangle Kvcorr (0 - v) = d, both forwards and sideways.
    assert track[0] == pytest.approx(-correction / 0.3 / 0.5, rel=0.05)
    assert math.hypot(*state.angular_velocity[:2]) < 1e-3
    thrusts = simulation.drone.body.thrusts
    assert thrusts == pytest.approx([thrusts[0]] * 4, rel=1e-3)


def test_velocity_limits_apply_to_the_command_before_the_fault(simulate):
    simulation = simulate(propellers={"velocity_limits": [4, 5]}, faults={"propellers": [0.5, 0, 1, 1]})
    fly(simulation, 1)
    weak, stopped, *sound = simulation.drone.body.thrusts
    assert stopped == 0
    assert sound == [2 * weak] * 2


def test_propeller_faults_are_reset_by_start_and_restored_by_snapshots(simulate):
    simulation = simulate()
    first = fly(simulation, 30)
    simulation.start()
    fly(simulation, 10)
    sound = simulation.snapshot()
    simulation.drone.change_faults({"propellers": [1, 1, 0, 1]})
    broken = simulation.snapshot()
    falling = fly(simulation, 20)
    simulation.restore(sound)
    assert fly(simulation, 20) == first[10:]
    simulation.restore(broken)
    assert fly(simulation, 20) == falling != first[10:]
    simulation.stop()
    simulation.start()
    assert fly(simulation, 30) == first


# ---- a radio link


def test_a_delayed_command_takes_effect_after_its_latency(simulate):
    simulation = simulate(faults={"commands": {"latency": 0.2}}, cmd_vel_timeout=0.5)
    simulation.drone.commands.receive(FORWARD)
    commands = [command for _, command in fly(simulation, 20, lambda: simulation.drone.commands.now)]
    assert commands == [Twist()] * 4 + [FORWARD] * 10 + [Twist()] * 6


def test_a_lossy_link_loses_the_same_commands_in_every_flight(simulate):
    simulation = simulate(faults={"commands": WIFI})

    def flight():
        commands = []
        for step in range(60):
            simulation.drone.commands.receive(Twist(Vector3(0.01 * step)))
            commands += fly(simulation, 1, lambda: simulation.drone.commands.now)
        return commands

    first = flight()
    assert 15 < len({command for _, command in first}) < 50
    simulation.stop()
    simulation.start()
    assert flight() == first


def test_a_snapshot_restores_delayed_commands(simulate):
    simulation = simulate()
    simulation.drone.change_faults({"commands": {"latency": 0.3, "jitter": 0.3}})
    simulation.drone.commands.receive(FORWARD)
    snapshot = simulation.snapshot()
    first = fly(simulation, 20, lambda: simulation.drone.commands.now)
    simulation.drone.change_faults({"commands": {"latency": 0, "jitter": 0}})
    simulation.restore(snapshot)
    assert fly(simulation, 20, lambda: simulation.drone.commands.now) == first
    assert FORWARD in [command for _, command in first]


def test_delayed_images_arrive_late_and_report_their_age(simulate):
    simulation = simulate(faults={"images": {"latency": 0.1}})
    camera = simulation.drone.cameras["front"]
    camera.viewers.add(lambda: True)
    simulation.drone.commands.receive(FORWARD)
    taken, received = [], []
    look = camera.look
    camera.look = lambda: taken.append(look()) or taken[-1]
    for _ in range(12):
        simulation.step()
        received.append(camera.image)
        assert camera.image is None or camera.age == pytest.approx(0.1)
    assert received[:2] == [None, None]
    assert all(one is other for one, other in zip(received[2:], taken))
    simulation.drone.change_faults({"images": {"loss": 1}})
    simulation.drone.change_faults({"images": {"latency": 0}})
    fly(simulation, 3)
    assert camera.image is None


# ---- sensors


def test_silent_and_frozen_sensors_recover_with_the_readings_of_sound_ones(simulate):
    sound, failing = simulate(sensors=SENSORS), simulate(sensors=SENSORS)
    instruments = failing.drone.instruments

    def step():
        sound.step()
        failing.step()
        return {name: list(one.readings) for name, one in instruments.by_name.items()}

    last = step()
    failing.drone.change_faults({"sensors": {"imu": "silent", "range": "frozen"}})
    frozen_reading = instruments.by_name["imu"].read()
    for _ in range(5):
        now = step()
        assert now["imu"] == [] and instruments.by_name["imu"].read() == frozen_reading
        assert [one.value for one in now["range"]] == [last["range"][-1].value]
        assert [one.at for one in now["range"]] == [failing.steps * 10]
    failing.drone.change_faults({"sensors": {"imu": "ok", "range": "ok"}})
    step()
    for name, one in instruments.by_name.items():
        assert one.readings == sound.drone.instruments.by_name[name].readings != []


def test_cameras_can_be_frozen_or_silent(simulate):
    simulation = simulate(cameras={"front": {**SMALL["front"], "mount": None}})
    camera = simulation.drone.cameras["front"]
    camera.viewers.add(lambda: True)
    fly(simulation, 1)
    first = camera.image
    simulation.drone.change_faults({"sensors": {"front": "frozen"}})
    simulation.drone.pushes.add(Push((3, 0, 0), (0, 0, 0.1), 0.3))
    fly(simulation, 8)
    assert camera.image is first
    simulation.drone.change_faults({"sensors": {"front": "silent"}})
    fly(simulation, 1)
    assert camera.image is None
    assert not camera.look().any() and camera.look().shape == first.shape
    simulation.drone.change_faults({"sensors": {"front": "ok"}})
    fly(simulation, 1)
    assert (camera.image != first).any()


# ---- parameter, timeline and call


def test_faults_by_parameter_timeline_and_call_give_equal_flights(simulate, tmp_path):
    faults = {"propellers": [1.0, 0.95, 1.0, 1.0], "commands": {"latency": 0.1, "jitter": 0.05}}
    weather = {"wind": [1.0, 0.0, 0.0], "gusts": {"deviation": [1.0, 1.0, 1.0]}}
    file = tmp_path / "faults.yaml"
    file.write_text(f"- {{at: 0, faults: {faults}}}\n- {{at: 0, weather: {weather}}}\n")
    by_parameter, by_timeline, by_call = simulate(faults=faults, weather=weather), simulate(), simulate()
    timeline.read(str(file), by_timeline.parameters).apply(0, by_timeline.vehicles)
    by_call.drone.change_faults(faults)
    by_call.drone.context.change_weather(weather)
    flights = []
    for one in (by_parameter, by_timeline, by_call):
        one.drone.commands.receive(FORWARD)
        flights.append(fly(one, 40))
    assert flights[0] == flights[1] == flights[2]


def test_the_example_in_the_docs_is_valid(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "weather.md").read_text(encoding="utf-8")
    file = tmp_path / "storm.yaml"
    file.write_text(re.search(r"^```yaml\n(weather:.*?)^```", page, re.S | re.M)[1])
    loaded = parameters.load({"config": str(file)})
    assert loaded.weather.gusts.deviation == (3, 3, 1.5) and loaded.fleet[0].faults.sensors == {"front": "frozen"}


@pytest.mark.parametrize(
    "faults, message",
    [
        ({"propellers": [1, 1, 1]}, "faults/propellers = [1, 1, 1]: must be 4 numbers from 0 to 1"),
        ({"propellers": [1, 1, 1, 2]}, "faults/propellers/3 = 2: input should be less than or equal to 1"),
        ({"commands": {"latancy": 1}}, "faults/commands/latancy: unknown key; near names are latency"),
        ({"images": {"latency": 3}}, "faults/images/latency = 3: input should be less than or equal to 2"),
        ({"sensors": {"front": "mad"}}, "faults/sensors/front = 'mad': input should be 'ok', 'silent' or 'frozen'"),
        ({"sensors": {"frnt": "ok"}}, "faults/sensors/frnt: no such sensor or camera; near names are front"),
        (5, "faults = 5: must hold `key: value` lines with propellers, commands, images, sensors, seed"),
    ],
)
def test_invalid_faults_raise_the_same_error_by_parameter_and_timeline(simulate, tmp_path, faults, message):
    with pytest.raises(ParameterError) as refused:
        parameters.load({"faults": faults})
    assert f"parameter {message}" in str(refused.value)
    file = tmp_path / "faults.yaml"
    file.write_text(f"- {{at: 0, faults: {faults}}}\n")
    with pytest.raises(timeline.TimelineError) as refused:
        timeline.read(str(file), parameters.load())
    assert str(refused.value) == f"{file}: line 1: entry 1: {str(refused.value).partition('entry 1: ')[2]}"
    assert message in str(refused.value)


# ---- the radio link by itself


def test_message_ages_over_a_link_match_their_theoretical_distribution():
    """A message is sent every 0.1 s with a delay of 200 ± 100 ms, one in five is lost, polled every 0.05 s.

    A message that is not lost arrives after 0.15, 0.2, 0.25 or 0.3 s with equal probability. The next one overtakes it
    if it takes 0.25 s and the next 0.15 s, or 0.3 s and the next at most 0.2 s: factors 1, 1, 1 - 0.8/4, 1 - 0.8/2.
    """
    link = RadioLink(LinkParameters(**WIFI), (1,), 100)
    ages = collections.Counter()
    for step in range(40_000):
        if step % 2 == 0:
            link.send(step * 0.05, step)
        received = link.receive(step * 0.05)
        if received:
            ages[round(received[0], 3)] += 1
            assert step * 0.05 - received[1] * 0.05 == pytest.approx(received[0])
    shares = {age: count / 20_000 for age, count in ages.items()}
    assert shares == pytest.approx({0.15: 0.2, 0.2: 0.2, 0.25: 0.16, 0.3: 0.12}, abs=0.01)


def test_a_link_without_jitter_and_loss_loses_nothing():
    link = RadioLink(LinkParameters(latency=0.15, jitter=0, loss=0), (1,), 100)
    received = []
    for step in range(1000):
        link.send(step * 0.05, step)
        received.append(link.receive(step * 0.05))
    assert [one[1] for one in received[3:]] == list(range(997))
    assert received[:3] == [None] * 3


def test_messages_beyond_the_buffer_size_are_lost():
    link = RadioLink(LinkParameters(latency=2, jitter=0, loss=0), (1,), 5)
    for number in range(1000):
        link.send(0.0, number)
    assert len(link._under_way) == 5 and link.receive(2.0)[1] == 999
