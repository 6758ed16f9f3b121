"""The real-time factor, changed while the simulation runs."""

import pytest

from drone_sim.config.types import ParameterError
from drone_sim.run import parameters
from drone_sim.run.diagnosis.finding import between, count
from drone_sim.run.pacing import Pace, Pacer, period
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation


@pytest.fixture(name="simulation", scope="module")
def _simulation():
    simulation = Simulation(parameters.load())
    yield simulation
    simulation.close()


@pytest.fixture(name="pacer")
def _pacer():
    return Pacer(0.05, clock=lambda: 0.0)


@pytest.fixture(name="pace")
def _pace(simulation, pacer):
    return Pace(simulation, pacer)


def test_a_factor_holds_through_every_start(pace, simulation):
    for factor in (4.0, 0.0, 0.5):
        pace.change({"real_time_factor": factor})
        simulation.start()
        assert pace.values() == {"real_time_factor": factor}
    assert period(simulation.parameters) == 0.1
    assert simulation.parameters.with_vehicles({"one": {}}).real_time_factor == 0.5


def test_the_next_steps_come_as_it_says(pace, pacer):
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


def test_a_pace_is_not_blamed_for_the_one_before(pace, pacer, simulation):
    player = Player(simulation, simulation.step, lambda _state: None, simulated_time=False)
    pace.change({"real_time_factor": 1.0})
    before = count(player, pacer, 0.0)
    assert between(before, count(player, pacer, 1.0)) is not None
    pace.change({"real_time_factor": 10.0})
    assert between(before, count(player, pacer, 1.0)) is None
