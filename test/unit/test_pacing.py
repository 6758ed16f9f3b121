"""Pacing against a clock that the test advances."""

import pytest

from drone_sim.config.types import ParameterError
from drone_sim.run.diagnosis.finding import between, count
from drone_sim.run.pacing import Beat, Pace, Pacer, Throttle, period
from drone_sim.run.player import Player


class Clock:
    """A clock that advances only by sleeping and by `work`."""

    def __init__(self):
        self.now = 100.0
        self.late_by = 0.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds + self.late_by

    def work(self, seconds):
        self.now += seconds


def passes(pacer, clock, works):
    times = []
    for seconds in works:
        pacer.wait()
        times.append(round(clock.now - 100.0, 9))
        clock.work(seconds)
    return times


def make_pacer(period=0.05):
    clock = Clock()
    return Pacer(period, clock, clock.sleep), clock


@pytest.mark.parametrize(
    "period, works, times, overruns",
    [
        (0.05, [0.01] * 4, [0.05, 0.1, 0.15, 0.2], 0),
        (0.0, [0.01] * 4, [0.0, 0.01, 0.02, 0.03], 0),  # as fast as possible
        (0.05, [0.01, 0.06, 0.045, 0.01, 0.01], [0.05, 0.1, 0.16, 0.205, 0.25], 2),  # 10 and 5 ms late
        (0.05, [0.01, 0.4, *[0.01] * 5], [0.05, 0.1, 0.5, 0.51, 0.52, 0.53, 0.54], 5),  # 0.2 of 0.35 s are caught up
        (0.05, [0.07] * 4, [0.05, 0.12, 0.19, 0.26], 3),  # always too slow
    ],
)
def test_one_pass_per_period_and_a_short_delay_is_caught_up(period, works, times, overruns):
    pacer, clock = make_pacer(period)
    assert passes(pacer, clock, works) == times
    assert pacer.overruns == overruns


def test_a_period_is_late_if_it_began_late_and_is_not_excused():
    pacer, clock = make_pacer()
    late = []
    for work in (0.01, 0.07, 0.01, 0.07, 0.01):
        late.append(round(pacer.wait(), 9))
        assert pacer.is_late == (late[-1] > 0)
        clock.work(work)
    assert late == [0, 0, 0.02, 0, 0.02] and round(pacer.worst, 9) == 0.02
    pacer.wait()
    clock.work(0.07)
    pacer.wait()
    assert pacer.is_late
    pacer.excuse()
    assert not pacer.is_late, "as after a pause"


def test_late_wake_ups_do_not_accumulate():
    pacer, clock = make_pacer()
    clock.late_by = 0.003
    assert passes(pacer, clock, [0.01] * 100)[-1] == round(100 * 0.05 + 0.003, 9)
    assert pacer.overruns == 0


def test_an_excused_step_is_not_late():
    pacer, clock = make_pacer()
    passes(pacer, clock, [0.12])
    pacer.excuse()
    assert pacer.wait() == 0.0 and pacer.overruns == 0
    assert passes(pacer, clock, [0.0, 0.12, 0.0]) == [0.22, 0.27, 0.39]
    assert pacer.overruns == 1


def test_a_long_sleep_ends_when_interrupted():
    pacer, clock = make_pacer(period=60.0)
    pacer.wait(lambda: clock.now > 101.0)
    assert 101.0 < clock.now < 101.2


def test_a_throttle_passes_once_a_period():
    clock = Clock()
    throttle = Throttle(0.25, clock)
    results = []
    for _ in range(9):
        results.append(throttle.passes())
        clock.work(0.125)
    assert results == [True, False] * 4 + [True]


def test_a_beat_comes_sooner_after_a_change():
    clock = Clock()
    beat = Beat(0.25, 1.0, clock)
    assert (beat.left(changed=True), beat.left(changed=False)) == (0.25, 1.0)
    clock.work(0.5)
    assert (beat.left(changed=True), beat.left(changed=False)) == (0.0, 0.5)
    beat.restart()
    assert (beat.left(changed=True), beat.left(changed=False)) == (0.25, 1.0)


def test_a_changed_period_applies_to_the_current_wait():
    pacer, clock = make_pacer(50.0)
    assert pacer.is_far
    clock.work(1.0)
    pacer.change(0.05)
    assert not pacer.is_far and passes(pacer, clock, [0.01] * 3) == [1.0, 1.05, 1.1]
    assert pacer.overruns == 0, "no step was late"
    pacer.change(0.2)
    assert passes(pacer, clock, [0.01] * 2) == [1.3, 1.5]


def test_changing_to_an_unlimited_pace_and_back():
    pacer, clock = make_pacer()
    pacer.change(0.0)
    assert passes(pacer, clock, [0.01] * 3) == [0.0, 0.01, 0.02]
    pacer.change(0.05)
    assert passes(pacer, clock, [0.01] * 2) == [0.08, 0.13]
    assert pacer.overruns == 0


# ---- changes of the real-time factor while running


@pytest.fixture(name="simulation", scope="module")
def _simulation(new_shared_simulation):
    return new_shared_simulation()


@pytest.fixture(name="pacer")
def _pacer():
    return Pacer(0.05, clock=lambda: 0.0)


@pytest.fixture(name="pace")
def _pace(simulation, pacer):
    return Pace(simulation, pacer)


def test_a_changed_real_time_factor_survives_every_start(pace, simulation):
    for factor in (4.0, 0.0, 0.5):
        pace.change({"real_time_factor": factor})
        simulation.start()
        assert pace.values() == {"real_time_factor": factor}
    assert period(simulation.parameters) == 0.1
    assert simulation.parameters.with_vehicles({"one": {}}).real_time_factor == 0.5


def test_a_changed_real_time_factor_applies_to_the_next_steps(pace, pacer):
    pace.change({"real_time_factor": 0.01})
    assert pacer.is_far
    pace.change({"real_time_factor": 0})
    assert not pacer.is_far


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"real_time_factor": -1.0}, "real_time_factor = -1.0: input should be greater than or equal to 0"),
        ({"real_time_factor": 1e-4}, "real_time_factor = 0.0001: must be 0, or from 0.001 to 1000"),
        ({"real_time_factor": float("nan")}, "real_time_factor = nan: input should be a finite number"),
        ({"real_time_factor": "fast"}, "real_time_factor = 'fast': input should be a valid number"),
        ({"real_time_factr": 2.0}, "'real_time_factr': cannot be changed .*; .*real_time_factor"),
    ],
)
def test_a_wrong_factor_changes_nothing(pace, changes, said):
    pace.change({"real_time_factor": 3.0})
    with pytest.raises(ParameterError, match=said):
        pace.change(changes)
    assert pace.values() == {"real_time_factor": 3.0}


def test_a_finding_does_not_span_a_change_of_pace(pace, pacer, simulation):
    player = Player(simulation, lambda _state: None, simulated_time=False)
    pace.change({"real_time_factor": 1.0})
    before = count(player, pacer, 0.0)
    assert between(before, count(player, pacer, 1.0)) is not None
    pace.change({"real_time_factor": 10.0})
    assert between(before, count(player, pacer, 1.0)) is None
