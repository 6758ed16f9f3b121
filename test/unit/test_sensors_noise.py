"""Sensor noise: Allan deviations and variances compared with closed forms; seeds, latency, snapshots."""

import math

import numpy as np
import pytest
from carried import Carried

from drone_sim.sensors.magnetic_field import MagneticFieldParameters
from drone_sim.sensors.noise import Noise, NoiseParameters

pytestmark = pytest.mark.long

HOUR = 72_000  # samples
INTERVAL = 0.05  # s; HOUR samples take one hour
AXES = 16  # simulated together, to average over them


def record(samples=HOUR, axes=AXES, truth=0.0, **parameters):
    noise = Noise(NoiseParameters(**parameters), axes, INTERVAL)
    noise.restart(np.random.default_rng(7))
    exact = [truth] * axes
    return np.array([noise.add(exact) for _ in range(samples)])


def allan_deviation(samples, tau):
    """Return the overlapping Allan deviation over tau (s), averaged over the axes (IEEE Std 952-1997, annex C)."""
    size = round(tau / INTERVAL)
    sums = np.cumsum(np.insert(samples, 0, 0.0, axis=0), axis=0)
    means = (sums[size:] - sums[:-size]) / size
    return math.sqrt(np.mean((means[size:] - means[:-size]) ** 2) / 2)


@pytest.fixture(name="white", scope="module")
def _white():
    return record(density=0.02)


@pytest.mark.parametrize("tau", [0.1, 1.0, 10.0, 100.0])
def test_white_noise_has_the_allan_deviation_of_its_density(white, tau):
    assert allan_deviation(white, tau) == pytest.approx(0.02 / math.sqrt(tau), rel=0.1)


def test_standard_deviation_is_the_density_times_the_root_of_the_rate(white):
    assert white.std() == pytest.approx(0.02 / math.sqrt(INTERVAL), rel=0.01)


@pytest.mark.parametrize("tau", [1.0, 10.0, 100.0])
def test_bias_walk_has_the_allan_deviation_of_a_random_walk(tau):
    walk = record(HOUR // 2, 48, bias_walk=0.003)
    assert allan_deviation(walk, tau) == pytest.approx(0.003 * math.sqrt(tau / 3), rel=0.1)


def test_allan_variances_of_white_noise_and_bias_walk_add_up():
    both = record(density=0.02, bias_walk=0.003)
    for tau in (1.0, 11.5, 100.0):
        expected = math.hypot(0.02 / math.sqrt(tau), 0.003 * math.sqrt(tau / 3))
        assert allan_deviation(both, tau) == pytest.approx(expected, rel=0.1)


def test_bias_with_a_time_constant_is_a_gauss_markov_process():
    bias = record(bias_walk=0.1, bias_time=2.0)
    assert bias.var() == pytest.approx(0.1**2 * 2.0 / 2, rel=0.05)
    lag = round(2.0 / INTERVAL)
    assert np.mean(bias[lag:] * bias[:-lag]) / bias.var() == pytest.approx(math.exp(-1), abs=0.03)


def test_gauss_markov_bias_starts_with_its_stationary_variance():
    first = record(1, 5000, bias_walk=0.1, bias_time=2.0)
    assert first.var() == pytest.approx(0.1**2 * 2.0 / 2, rel=0.05)


def test_constant_bias_stays_the_same():
    samples = record(10, 2000, bias=0.5)
    assert samples[0].std() == pytest.approx(0.5, rel=0.05)
    assert (samples == samples[0]).all()


def test_quantisation_rounds_to_whole_steps():
    samples = record(1000, 1, truth=0.3, deviation=1.0, quantisation=0.25)
    assert (samples / 0.25 == np.round(samples / 0.25)).all()
    assert record(1, 3, truth=0.3, quantisation=0.25).tolist() == [[0.25] * 3]


def test_quantisation_step_too_small_to_divide_by_is_refused():
    with pytest.raises(ValueError, match="quantisation"):
        NoiseParameters(quantisation=5e-324)
    assert record(1, 1, truth=1e9, quantisation=1e-15) == pytest.approx(1e9)


def test_no_noise_without_noise_parameters():
    assert record(3, 2, truth=0.1).tolist() == [[0.1, 0.1]] * 3


@pytest.mark.parametrize(
    "parameters",
    [
        {"deviation": 0.3},
        {"density": 0.2, "deviation": 0.1},
        {"bias": 0.7, "deviation": 0.1},
        {"bias_walk": 0.4, "bias_time": 0.5},
        {"quantisation": 1.0, "deviation": 2.0},
    ],
)
def test_reported_variance_is_the_variance_of_the_samples(parameters):
    samples = record(200, 2000, truth=0.37, **parameters)
    reported = Noise(NoiseParameters(**parameters), 1, INTERVAL).variance
    assert np.mean((samples - 0.37) ** 2) == pytest.approx(reported, rel=0.06)


def test_configured_variance_is_reported():
    assert Noise(NoiseParameters(deviation=1.0, variance=4.0), 1, INTERVAL).variance == 4.0
    assert Noise(NoiseParameters(), 1, INTERVAL).variance == 0.0


# ---- noise of a sensor

COMPASS = {"kind": "magnetic_field", "rate": 100, "noise": {"deviation": 1.0, "bias": 1.0, "bias_walk": 1.0}}


def readings(steps=20, name="drone/compass", **parameters):
    body = Carried()
    sensor = body.fit(MagneticFieldParameters(**{**COMPASS, **parameters}), name=name)
    for _ in range(steps):
        body.look()
    return [reading.value for reading in sensor.readings]


def test_noise_depends_on_seed_vehicle_and_sensor():
    first = readings()
    assert len(first) == 10
    assert readings() == first
    others = [readings(seed=1), readings(name="drone2/compass"), readings(name="drone/other")]
    everything = [first, *others]
    assert len({str(series) for series in everything}) == 4
    steps = [np.subtract(series, first).std() for series in others]
    assert min(steps) > 0.5


def test_reset_restarts_the_same_noise():
    body = Carried()
    sensor = body.fit(MagneticFieldParameters(**COMPASS))
    body.look()
    body.look()
    first = body.values(sensor)
    body.look()
    sensor.reset()
    body.count = 0
    body.look()
    assert sensor.readings == [] and sensor.latest is None
    body.look()
    assert body.values(sensor) == first


def test_latency_delays_a_reading_and_not_its_stamp():
    body = Carried()
    sensor = body.fit(MagneticFieldParameters(kind="magnetic_field", rate=100, latency=0.035))
    arrivals = []
    for _ in range(20):
        body.look()
        arrivals += [(body.count, reading.at) for reading in sensor.readings]
        sensor.readings.clear()
    assert arrivals == [(at + 7, at) for at in (2, 4, 6, 8, 10, 12)]
    assert sensor.header(sensor.latest)["stamp"] == pytest.approx(12 * 0.005)


def test_restore_brings_back_noise_and_delayed_readings():
    body = Carried()
    sensor = body.fit(MagneticFieldParameters(**COMPASS, latency=0.05))

    def fly():
        for _ in range(40):
            body.look()
        return list(sensor.readings), sensor.latest

    fly()
    restore, count = sensor.save_state(), body.count
    first = fly()
    for _ in range(2):
        restore()
        body.count = count
        assert fly() == first
