"""Range, magnetic field, pressure, fix, contacts and battery, compared with closed-form solutions."""

import math

import numpy as np
import pytest
from carried import BODY, FIELD, GRAVITY, SUB_STEP, ZURICH, Carried, Flown

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, State
from drone_sim.sensors.battery import BatteryParameters
from drone_sim.sensors.contacts import ContactsParameters
from drone_sim.sensors.fix import FLATTENING, SEMI_MAJOR, FixParameters, from_earth, to_earth
from drone_sim.sensors.magnetic_field import MagneticFieldParameters
from drone_sim.sensors.pressure import PressureParameters, height_of, pressure_at
from drone_sim.sensors.range import RangeParameters
from drone_sim.shapes.box import Box

STILL = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def message(sensor, output=0):
    return sensor.outputs[output].fields(sensor.latest.value, sensor.header(sensor.latest))


def body_at_rest(position=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)):
    return Carried(State(position, frames.to_quaternion(frames.from_rpy((0, 0, 0), rpy)), *STILL))


# ---- range

RANGE = RangeParameters(kind="range", rate=200, min_range=0.05, max_range=4.0)


def look_down(height, tilt=0.0, parameters=RANGE):
    drone = Flown(Pose((0, 0, height), frames.to_quaternion(frames.from_rpy((0, 0, 0), (0, tilt, 0)))), gravity=0.0)
    sensor = drone.fit(parameters, parameters.placed({})[1])
    drone.step()
    return sensor


@pytest.mark.parametrize("height", [0.3, 1.0, 3.9])
@pytest.mark.parametrize("tilt", [0.0, 0.2])
def test_range_is_the_height_over_the_cosine_of_the_tilt(height, tilt):
    assert look_down(height, tilt).latest.value.distance == pytest.approx(height / math.cos(tilt), abs=1e-3)


def test_distances_outside_the_range_are_infinite():
    assert message(look_down(4.1))["range"] == math.inf
    assert message(look_down(0.04))["range"] == -math.inf
    assert look_down(4.1).detected() is None


def test_range_sensor_detects_and_names_the_object_below():
    drone = Flown(gravity=0.0)
    drone.add("Box", Box((1.0, 1.0, 0.4)), (0, 0, 0.2))
    sensor = drone.fit(RANGE, RANGE.placed({})[1])
    assert sensor.detected() is None
    drone.step()
    distance, what, normal = sensor.detected()
    assert (distance, what) == (pytest.approx(0.6, abs=1e-3), "Box")
    assert normal == pytest.approx((0, 0, -1), abs=1e-9)  # in V-REP's sensor frame, which looks along z
    data = message(sensor)
    assert {key: data[key] for key in ("radiation_type", "min_range", "max_range", "field_of_view")} == {
        "radiation_type": 1,
        "min_range": 0.05,
        "max_range": 4.0,
        "field_of_view": 0.0,
    }


def test_range_noise_does_not_exceed_the_maximum_range():
    noise = {"deviation": 0.5, "quantisation": 0.001}
    drone = Flown(Pose((0, 0, 3.9)), gravity=0.0)
    sensor = drone.fit(RangeParameters(**{**RANGE.model_dump(), "noise": noise}), RANGE.placed({})[1])
    drone.step(200)
    distances = [value.distance for value in drone.values(sensor)]
    assert math.inf in distances
    assert all(distance <= 4.0 for distance in distances if distance != math.inf)


# ---- magnetic field


@pytest.mark.parametrize("rpy", [(0, 0, 0), (0, 0, math.pi / 2), (0.3, -0.5, 2.0)])
def test_magnetic_field_is_measured_in_the_sensors_axes(rpy):
    body = body_at_rest(rpy=rpy)
    sensor = body.fit(MagneticFieldParameters(kind="magnetic_field", rate=200))
    body.look()
    turn = np.reshape(frames.from_rpy((0, 0, 0), rpy), (3, 4))[:, :3]
    assert sensor.latest.value == pytest.approx(turn.T @ FIELD, abs=1e-18)
    assert tuple(message(sensor)["magnetic_field"].values()) == pytest.approx(turn.T @ FIELD)


def test_compass_pointing_north_measures_the_declination():
    body = body_at_rest(rpy=(0, 0, math.pi / 2))
    sensor = body.fit(MagneticFieldParameters(kind="magnetic_field", rate=200))
    body.look()
    ahead, left, _ = sensor.latest.value
    assert math.degrees(math.atan2(-left, ahead)) == pytest.approx(3.55, abs=0.01)  # east of north: WMM2025


# ---- pressure


@pytest.mark.parametrize(
    "height, pressure",  # ISO 2533:1975
    [(-1000, 113929), (0, 101325), (500, 95460.8), (1000, 89874.6), (5000, 54019.9), (11000, 22632), (15000, 12044.6)],
)
def test_pressure_follows_the_standard_atmosphere(height, pressure):
    assert pressure_at(height) == pytest.approx(pressure, rel=2e-5)
    assert height_of(pressure_at(height)) == pytest.approx(height, abs=1e-6)


def test_barometer_measures_pressure_and_height():
    body = body_at_rest((3.0, 4.0, 12.0))
    sensor = body.fit(PressureParameters(kind="pressure", rate=50, noise={"deviation": 1.2}))
    for _ in range(4000):
        body.look()
    values = body.values(sensor)
    assert len(values) == 1000
    assert np.mean([value.pressure for value in values]) == pytest.approx(pressure_at(488.0 + 12.0), abs=0.2)
    heights = [value.height for value in values]
    assert np.mean(heights) == pytest.approx(12.0, abs=0.02)
    assert np.std(heights) == pytest.approx(1.2 / 11.5, rel=0.1)  # 11.5 Pa/m there
    assert message(sensor)["variance"] == pytest.approx(1.44)
    above = message(sensor, 1)
    assert above["header"]["frame_id"] == "world" and above["point"]["z"] == heights[-1]


# ---- fix


def test_geodetic_coordinates_survive_the_round_trip():
    for latitude, longitude, height in [(0, 0, 0), (47.4, 8.5, 488), (-89.9, 120, 9000), (90, 0, 100), (45, -179.9, 0)]:
        back = from_earth(to_earth(latitude, longitude, height))
        assert back[0] == pytest.approx(latitude, abs=1e-12)
        assert back[2] == pytest.approx(height, abs=1e-8)
        if latitude != 90:
            assert back[1] == pytest.approx(longitude, abs=1e-12)
    assert to_earth(0, 90, 0) == pytest.approx((0, 6378137.0, 0), abs=1e-6)
    assert to_earth(90, 0, 0) == pytest.approx((0, 0, 6356752.3142), abs=1e-4)  # the semi-minor axis


def fit_fix_sensor(position, **noise):
    body = body_at_rest(position)
    sensor = body.fit(FixParameters(kind="fix", rate=10, noise=noise))
    for _ in range(20):
        body.look()
    return sensor


def test_100_m_north_and_east_match_the_radii_of_curvature():
    """M and N of the ellipsoid: M = a (1 - e²) / (1 - e² sin² φ)^1.5, N = a / (1 - e² sin² φ)^0.5."""
    sin2, e2 = math.sin(math.radians(ZURICH.latitude)) ** 2, FLATTENING * (2 - FLATTENING)
    meridian = SEMI_MAJOR * (1 - e2) / (1 - e2 * sin2) ** 1.5 + ZURICH.altitude
    prime_vertical = SEMI_MAJOR / (1 - e2 * sin2) ** 0.5 + ZURICH.altitude
    data = message(fit_fix_sensor((0.0, 100.0, 0.0)))
    assert data["latitude"] - ZURICH.latitude == pytest.approx(math.degrees(100 / meridian), rel=1e-4)
    assert data["longitude"] == pytest.approx(ZURICH.longitude, abs=1e-12)
    data = message(fit_fix_sensor((100.0, 0.0, 7.5)))
    east = 100 / (prime_vertical * math.cos(math.radians(ZURICH.latitude)))
    assert data["longitude"] - ZURICH.longitude == pytest.approx(math.degrees(east), rel=1e-4)
    assert data["altitude"] == pytest.approx(488 + 7.5, abs=1e-3)
    assert data["status"] == {"status": 0, "service": 1}
    assert (data["position_covariance"], data["position_covariance_type"]) == ([0.0] * 9, 0)


def test_fix_message_has_the_configured_covariance():
    data = message(fit_fix_sensor((0.0, 0.0, 0.0), horizontal={"deviation": 2.0}, vertical={"variance": 9.0}))
    assert data["position_covariance"] == [4.0, 0, 0, 0, 4.0, 0, 0, 0, 9.0]
    assert data["position_covariance_type"] == 2


# ---- contacts


def test_contacts_report_the_supporting_object_and_force():
    drone = Flown(Pose((0, 0, 0.41)))
    drone.add("Table", Box((2.0, 2.0, 0.4)), (0, 0, 0.2))
    sensor = drone.fit(ContactsParameters(kind="contacts", rate=20))
    drone.step(500)
    sample = drone.values(sensor)[-1]
    assert {contact.what for contact in sample.contacts} == {"Table"}
    assert sample.force == pytest.approx((0, 0, -BODY.mass * GRAVITY), rel=1e-3, abs=1e-3)
    assert sample.torque == pytest.approx((0, 0, 0), abs=1e-3)
    markers = message(sensor)["markers"]
    assert len(markers) == len(sample.contacts)
    first = markers[0]
    start, end = first["points"]
    assert (first["ns"], first["header"]["frame_id"]) == ("Table", "world")
    assert start["z"] == pytest.approx(0.4, abs=1e-3)
    assert 10 * (end["z"] - start["z"]) == pytest.approx(sample.contacts[0].force[2])
    wrench = message(sensor, 1)
    assert wrench["header"]["frame_id"] == "base_link"
    assert wrench["wrench"]["force"]["z"] == pytest.approx(-BODY.mass * GRAVITY, rel=1e-3)
    assert sensor.read()["contacts"][0]["what"] == "Table"


def test_impact_between_two_samples_is_measured():
    """The contact force, summed over the sub-steps, equals the change of the momentum."""
    drone = Flown(Pose((0, 0, 0.3)))
    fast = drone.fit(ContactsParameters(kind="contacts", rate=200))
    slow = drone.fit(ContactsParameters(kind="contacts", rate=2), name="drone/slow")
    impulse, before = 0.0, drone.state.linear_velocity[2]
    for _ in range(100):
        drone.step()
        impulse += fast.latest.value.force[2] * SUB_STEP
    momentum_change = BODY.mass * (drone.state.linear_velocity[2] - before - GRAVITY * 100 * SUB_STEP)
    assert impulse == pytest.approx(momentum_change, rel=0.01)
    (worst,) = drone.values(slow)
    assert worst.force[2] > 20 * BODY.mass * -GRAVITY
    drone.step(100)
    assert drone.values(slow)[0].force[2] < 2 * BODY.mass * -GRAVITY


def test_no_contacts_in_the_air():
    drone = Flown(Pose((0, 0, 3)))
    sensor = drone.fit(ContactsParameters(kind="contacts", rate=20))
    drone.step(20)
    assert [value.contacts for value in drone.values(sensor)] == [(), ()]
    assert message(sensor) == {"markers": []}


# ---- battery

BATTERY = {
    **{"kind": "battery", "rate": 10, "cells": 3, "capacity": 1.0, "full": 4.2, "empty": 3.3, "resistance": 0.0},
    **{"hover_power": 60.0, "idle_power": 6.0},
}


def run_battery(thrusts, minutes, **parameters):
    body = Carried()
    body.thrusts = thrusts
    sensor = body.fit(BatteryParameters(**{**BATTERY, **parameters}))
    for _ in range(round(minutes * 60 / SUB_STEP)):
        body.look()
        sensor.readings.clear()
    return sensor


HOVER = [BODY.mass * -GRAVITY / 4] * 4


def test_power_depends_on_the_thrust_and_equals_hover_power_in_hover():
    assert run_battery(HOVER, 0.01).power() == pytest.approx(60.0)
    assert run_battery([0.0] * 4, 0.01).power() == pytest.approx(6.0)
    assert run_battery([2 * thrust for thrust in HOVER], 0.01).power() == pytest.approx(6 + 54 * 2**1.5)
    assert run_battery([0.0, 0.0, 2 * HOVER[0], 2 * HOVER[0]], 0.01).power() == pytest.approx(6 + 54 * 2**1.5 / 2)


def test_charge_used_at_constant_voltage_is_power_times_time():
    data = message(run_battery(HOVER, 1, full=3.7, empty=3.7))
    assert data["current"] == pytest.approx(-60 / 11.1)
    assert data["charge"] == pytest.approx(1.0 - 60 / 11.1 / 60, rel=1e-6)
    assert data["percentage"] == pytest.approx(data["charge"])
    assert data["voltage"] == pytest.approx(11.1) == sum(data["cell_voltage"])
    assert (data["power_supply_status"], data["power_supply_health"], data["present"]) == (2, 1, True)


def test_voltage_drops_by_the_internal_resistance():
    data = message(run_battery(HOVER, 0.01, resistance=0.1, full=4.0, empty=4.0))
    voltage, current = data["voltage"], -data["current"]
    assert voltage * current == pytest.approx(60.0)
    assert voltage == pytest.approx(12.0 - 0.1 * current)


def test_empty_battery_has_zero_charge_and_current():
    data = message(run_battery(HOVER, 1, charge=0.05))
    assert (data["charge"], data["current"], data["power_supply_health"]) == (0.0, 0.0, 3)
    assert data["voltage"] == pytest.approx(9.9)


def test_snapshot_and_reset_restore_the_charge():
    body = Carried()
    body.thrusts = HOVER
    sensor = body.fit(BatteryParameters(**BATTERY))
    body.look()
    restore = sensor.save_state()
    for _ in range(40):
        body.look()
    last = sensor.latest
    restore()
    body.count = 1
    for _ in range(40):
        body.look()
    assert sensor.latest == last
    sensor.reset()
    body.count = 0
    for _ in range(20):
        body.look()
    assert sensor.latest.value.charge == pytest.approx(1.0, abs=1e-3)
