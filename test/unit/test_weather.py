"""Wind and gusts: Dryden's statistics, one air for all vehicles, and repeatable effects on a flight."""

import hashlib
import itertools
import math
import struct
from types import SimpleNamespace

import numpy as np
import pytest

from drone_sim.forces.drag import Drag, DragParameters
from drone_sim.forces.dryden import MOST, Gusts, GustSeries
from drone_sim.forces.weather import Weather, WeatherParameters
from drone_sim.mechanics.frames import from_rpy, to_euler
from drone_sim.mechanics.wrench import Wrench
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError

CALM = {"deviation": (0, 0, 0), "length": (20, 20, 5), "speed": 2, "seed": 1}
GUSTS = {**CALM, "deviation": (3, 2, 1)}


def weather(wind=(0, 0, 0), gusts=CALM, now=0.0):
    clock = SimpleNamespace(time=now)
    return Weather(WeatherParameters(wind=wind, gusts=gusts), clock), clock


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    return lambda **overrides: new_simulation(overrides)


def fly(simulation, steps):
    path = []
    for _ in range(steps):
        simulation.step()
        path.append([vehicle.body.state for vehicle in simulation.vehicles.values()])
    return path


# ---- Dryden


@pytest.mark.parametrize("is_along", [True, False])
def test_gusts_have_drydens_variance_and_correlation(is_along):
    """With 4000 length scales in total, the error of the estimated variance is about 3 %."""
    spacing, ways = 0.25, np.arange(0, 1000, 0.25)
    series = np.array([list(map(GustSeries((seed,), is_along).at, ways)) for seed in range(4)])
    assert series.var() == pytest.approx(1.0, abs=0.08)
    assert abs(series.mean()) < 0.05
    for distance in (0.5, 1.0, 2.0, 3.0):
        lag = round(distance / spacing)
        expected = math.exp(-distance) * (1 if is_along else 1 - distance / 2)
        assert np.mean(series[:, :-lag] * series[:, lag:]) == pytest.approx(expected, abs=0.08)


def test_gusts_have_drydens_spectrum():
    ways = np.arange(0, 1024, 1 / 16)
    frequencies = np.fft.rfftfreq(len(ways), 1 / 16) * 2 * math.pi  # rad per length
    bands = np.geomspace(0.05, 12, 8)
    for is_along in (True, False):
        gusts = np.array(list(map(GustSeries((7,), is_along).at, ways)))
        power = np.abs(np.fft.rfft(gusts)) ** 2 / len(ways) / 16 / math.pi  # one-sided, per rad
        square = 1 + frequencies**2
        theory = 2 / math.pi / square if is_along else (1 + 3 * frequencies**2) / math.pi / square**2
        for low, high in itertools.pairwise(bands):
            band = (low <= frequencies) & (frequencies < high)
            assert power[band].mean() == pytest.approx(theory[band].mean(), rel=0.3), (is_along, low)


def test_gusts_depend_only_on_seed_and_distance():
    one, other, another = Gusts(5), Gusts(5), Gusts(6)
    ways = [float(way) for way in range(0, 500, 7)]
    forward = [one.at(way, (1, 1, 1), (20, 20, 5)) for way in ways]
    backward = [other.at(way, (1, 1, 1), (20, 20, 5)) for way in reversed(ways)]
    assert forward == backward[::-1]
    assert forward != [another.at(way, (1, 1, 1), (20, 20, 5)) for way in ways]
    assert len({round(value, 9) for gust in forward for value in gust}) == 3 * len(ways)  # all components differ


def test_gusts_are_bit_identical_on_every_platform():
    """All bits are the same with Python 3.10 to 3.13 and numpy 1.24 to 2.5."""
    gusts = Gusts(1)
    digest = hashlib.sha256()
    for way in range(0, 1000, 3):
        digest.update(struct.pack("3d", *gusts.at(way / 7, (3.0, 2.0, 1.0), (23.0, 23.0, 3.0))))
    assert digest.hexdigest() == "1f68caa73bdb785f868425473634a7aba8b7f557e91655bcd6887ecba4c98baa"


def test_gusts_at_any_distance_are_finite_with_bounded_memory(monkeypatch):
    monkeypatch.setattr("drone_sim.forces.dryden.MOST", 1000)
    series = GustSeries((3,), True)
    assert MOST > 1000 >= len(series._knots)
    ends = [series.at(place / 128) for place in (990, 1010)]  # it reverses there, without a jump
    assert ends[0] == ends[1]
    assert abs(series.at(1e6)) < 6
    assert [series.at(way) for way in (1e300, math.inf, math.nan)] == [0, 0, 0]
    assert len(series._knots) < 1500


# ---- one air


def test_gusts_travel_downwind():
    air, clock = weather((3.0, 4.0, 0.0), GUSTS)
    clock.time = 10.0
    upwind = air.at((1.0, 2.0, 0.5))
    clock.time = 12.0
    assert air.at((1.0 + 6.0, 2.0 + 8.0, 3.0)) == pytest.approx(upwind, abs=1e-12)
    assert air.at((1.0, 2.0, 0.5)) != pytest.approx(upwind, abs=0.1)


def test_gust_components_are_along_the_wind_across_it_and_up():
    series = {}
    for axis in range(3):
        deviation = [0, 0, 0]
        deviation[axis] = 1
        air, _ = weather((0.0, 5.0, 0.0), {**CALM, "deviation": deviation})
        series[axis] = np.array(air.at((0.3, 0.4, 0.5))) - (0, 5, 0)
    along, across, up = (series[axis] for axis in range(3))
    assert along[0] == along[2] == 0 != along[1]
    assert across[1] == pytest.approx(0, abs=1e-15) and across[2] == 0 != across[0]
    assert up[0] == up[1] == 0 != up[2]


def test_gusts_continue_when_the_wind_changes():
    air, clock = weather((5.0, 0.0, 0.0), GUSTS)
    clock.time = 8.0
    before = air.at((0, 0, 0))
    air.change({"wind": [2.5, 0, 0]})
    after = air.at((0, 0, 0))
    assert after[0] - before[0] == pytest.approx(-2.5)
    assert after[1:] == before[1:]
    clock.time = 10.0  # the gusts now pass at half the speed
    slow = air.at((0, 0, 0))[1:]
    other, clock = weather((5.0, 0.0, 0.0), GUSTS)
    clock.time = 9.0
    assert other.at((0, 0, 0))[1:] == pytest.approx(slow)


def test_invalid_change_of_the_weather_changes_nothing():
    air, _ = weather((1.0, 0.0, 0.0))
    with pytest.raises(ParameterError, match=r"^parameter gusts/lenght: unknown key; near names are length"):
        air.change({"gusts": {"lenght": [1, 1, 1]}})
    with pytest.raises(ParameterError, match=r"wind = \[1, 2\]: must be 3 numbers, \[x, y, z\] in m/s"):
        air.change({"wind": [1, 2]})
    assert air.at((0, 0, 0)) == (1.0, 0.0, 0.0)


# ---- in flight


@pytest.mark.parametrize("wind, drag", [(3.0, None), (-6.0, 0.3)])
def test_lean_in_a_steady_wind_balances_drag_and_weight(simulate, wind, drag):
    """tan θ = c (w - v) / (m g), where v is the drift speed that the tutorial's controller allows."""
    forces = {"air": {"kind": "drag", "coefficients": [drag] * 3}} if drag else {}
    simulation = simulate(weather={"wind": [0, wind, 0]}, forces=forces)
    states = [state for (state,) in fly(simulation, 400)[300:]]
    lean = np.mean([to_euler(state.matrix)[0] for state in states])
    drift = np.mean([state.linear_velocity[1] for state in states])
    mass = simulation.drone.body.mass
    assert math.tan(lean) == pytest.approx((drag or 0.1) * (wind - drift) / (mass * 9.81), rel=1e-3)
    # The control law: the drone leans by Kvcorr v against a speed v that was not commanded.
    assert lean == pytest.approx(0.5 * drift, rel=1e-2)


def test_drag_uses_the_velocity_relative_to_the_air():
    turned = from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2))  # body x is world y
    state = SimpleNamespace(linear_velocity=(1.0, 2.0, 3.0))
    body, wrench = SimpleNamespace(state=state, matrix=turned, wind=(0.1, 0.2, 0.3)), Wrench()
    Drag(DragParameters(kind="drag", coefficients=(10.0, 20.0, 40.0), wind=(0.0, 0.5, 0.7))).add_to(wrench, body)
    assert wrench.force == pytest.approx((-20 * 0.9, -10 * 1.3, -40 * 2.0))


def test_configured_drag_replaces_the_default_drag(simulate):
    own = {"air": {"kind": "drag", "coefficients": [0, 0, 0]}}
    assert fly(simulate(weather={"wind": [9, 0, 0]}, forces=own), 50)[-1][0].linear_velocity[0] == 0


def test_no_sub_step_forces_without_weather(simulate):
    simulation = simulate()
    assert simulation.drone.sub_step_forces == []
    simulation.drone.context.change_weather({"wind": [3, 0, 0]})
    states = fly(simulation, 20)
    assert len(simulation.drone.sub_step_forces) == 1
    assert states[-1][0].linear_velocity[0] > 0.05
    simulation.start()  # resets the weather to that of the parameters
    assert simulation.drone.sub_step_forces == []


def test_flight_in_gusts_is_repeatable_to_the_bit(simulate):
    windy = {"wind": [2, 1, 0], "gusts": GUSTS}
    first = fly(simulate(weather=windy), 100)
    simulation = simulate(weather=windy)
    assert fly(simulation, 100) == first
    simulation.start()
    assert fly(simulation, 100) == first
    assert fly(simulate(weather={**windy, "gusts": {**GUSTS, "seed": 2}}), 10) != first[:10]


def test_restore_brings_the_weather_back(simulate):
    simulation = simulate()
    fly(simulation, 10)
    calm = simulation.snapshot()
    simulation.drone.context.change_weather({"wind": [2, 0, 0], "gusts": GUSTS})
    fly(simulation, 30)
    windy = simulation.snapshot()
    flight = fly(simulation, 50)
    simulation.drone.context.change_weather({"wind": [0, 0, 0], "gusts": {"seed": 9}})
    fly(simulation, 20)
    simulation.restore(windy)
    assert fly(simulation, 50) == flight
    simulation.restore(calm)
    assert simulation.drone.sub_step_forces == []
    assert fly(simulation, 20)[-1][0].linear_velocity[0] == 0


def test_anemometer_measures_the_wind_at_each_vehicle(simulate):
    sensors = {"wind": {"kind": "wind", "rate": 20}}
    vehicles = {"front": {"position": [0, 0, 1]}, "behind": {"position": [4, 0, 1]}}
    simulation = simulate(weather={"wind": [4, 0, 0], "gusts": GUSTS}, sensors=sensors, vehicles=vehicles)
    wind_speeds = {name: [] for name in vehicles}
    for _ in range(60):
        simulation.step()
        for name, vehicle in simulation.vehicles.items():
            fields = vehicle.instruments.by_name["wind"].read()
            wind_speeds[name].append(fields["vector"]["x"])
    first, later = (np.array(wind_speeds[name]) for name in vehicles)
    assert first.std() > 0.3
    # 4 m at 4 m/s take 20 steps; both vehicles drift a little.
    assert np.corrcoef(first[:-20], later[20:])[0, 1] > 0.95 > np.corrcoef(first, later)[0, 1]


# ---- in a scene file


def test_scene_file_may_contain_weather_which_ends_with_the_scene(simulate, tmp_path):
    windy, calm = tmp_path / "windy.yaml", tmp_path / "calm.yaml"
    windy.write_text("weather: {wind: [3, 0, 0], gusts: {deviation: [1, 1, 0.5]}}\n", encoding="utf-8")
    calm.write_text("objects: []\n", encoding="utf-8")
    hall = simulate(scene_file=str(windy), weather={"gusts": {"seed": 3}})
    equal_weather = {"wind": [3, 0, 0], "gusts": {"deviation": [1, 1, 0.5], "seed": 3}}
    assert fly(hall, 20) == fly(simulate(weather=equal_weather), 20)
    hall.start(str(calm))
    assert fly(hall, 20) == fly(simulate(weather={"gusts": {"seed": 3}}), 20)
    windy.write_text("objects: []\nweather: {wind: [300, 0, 0]}\n", encoding="utf-8")
    with pytest.raises(ParameterError, match=r"windy\.yaml: line 2: parameter weather/wind/0 = 300: "):
        hall.start(str(windy))


def test_saved_scene_contains_the_weather_of_the_scene_or_of_a_change(simulate, tmp_path):
    windy, saved = tmp_path / "windy.yaml", tmp_path / "saved.yaml"
    windy.write_text("weather: {wind: [3, 0, 0]}\n", encoding="utf-8")
    hall, field = simulate(scene_file=str(windy)), simulate(weather={"wind": [1, 0, 0]})
    for simulation, change, wind in (
        (hall, {}, (3, 0, 0)),
        (hall, {"wind": [0, 2, 0]}, (0, 2, 0)),
        (field, {}, (0, 0, 0)),  # weather of the parameters is not saved
        (field, {"wind": [0, 1, 0]}, (0, 1, 0)),
    ):
        simulation.drone.context.change_weather(change)
        simulation.save_scene(saved)
        assert parameters.load({"scene_file": str(saved)}).weather.wind == wind
