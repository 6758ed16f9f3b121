"""Steps that are ordered one by one while the simulation is paused."""

import pytest

from drone_sim.run import player as player_module
from drone_sim.run.player import Player
from drone_sim.run.stepping import Diverged
from drone_sim.scripting.errors import ScriptError

SCRIPT = """
def sysCall_sensing():
    n = sim.getSimulationTime()
    self.sum = 1
"""


@pytest.fixture(name="begin")
def _begin(tmp_path, new_simulation):
    """Return a function that creates a paused player and returns it with the path of its script."""

    def begin(text="", step=None):
        path = tmp_path / "script.py"
        path.write_text(text or SCRIPT, encoding="utf-8")
        simulation = new_simulation(script=str(path), started=False)
        simulation.step = step or simulation.step
        player = Player(simulation, lambda _state: None, simulated_time=False)
        player.start()
        player.pause(True)
        return player, str(path)

    return begin


def test_orders_are_executed_one_after_the_other(begin):
    player, _ = begin()
    first, second = player.order_steps(2), player.order_steps(1)
    assert player.is_step_due
    assert player.step() and not first.done()
    assert player.step() and first.result(0) == "t = 0.10 s" and not second.done()
    assert player.step() and second.result(0) == "t = 0.15 s"
    assert not player.is_step_due and player.paused


def test_steps_cannot_be_ordered_while_running_or_stopped(begin):
    player, _ = begin()
    player.pause(False)
    with pytest.raises(ValueError, match="not paused"):
        player.order_steps(1)
    player.pause(True)
    player.stop()
    with pytest.raises(ValueError, match="not paused"):
        player.order_steps(1)


@pytest.mark.parametrize("interrupt", [Player.stop, Player.start, Player.restart, lambda player: player.pause(False)])
def test_ending_the_pause_interrupts_all_orders(begin, interrupt):
    player, _ = begin()
    orders = [player.order_steps(3), player.order_steps(4)]
    player.step()
    interrupt(player)
    for order, left in zip(orders, ("2 of 3", "4 of 4")):
        assert str(order.exception(0)) == f"interrupted: {left} steps have not been run"


def test_a_breakpoint_ends_all_orders(begin):
    player, path = begin()
    player.simulation.set_breakpoints({path: frozenset((4,))})
    orders = [player.order_steps(count) for count in (1, 20, 1)]
    player.step()
    assert orders[0].result(0) == "t = 0.05 s", "all of its steps have been run"
    for order, left in zip(orders[1:], ("20 of 20", "1 of 1")):
        assert str(order.exception(0)) == f"breakpoint at {path}:4, t = 0.05 s: {left} steps have not been run"
    assert not player.is_step_due


def test_a_failing_script_fails_all_orders(begin):
    player, _ = begin("def sysCall_sensing():\n    1 / 0\n")
    orders = [player.order_steps(3), player.order_steps(1)]
    assert not player.step()
    assert all(isinstance(order.exception(0), ScriptError) for order in orders)


def test_divergence_fails_an_order(begin):
    def diverge():
        raise Diverged("the simulation has diverged")

    player, _ = begin(step=diverge)
    order = player.order_steps(3)
    assert not player.step()
    assert isinstance(order.exception(0), Diverged)


def test_the_number_of_waiting_orders_is_limited(begin, monkeypatch):
    monkeypatch.setattr(player_module, "_MAX_ORDERS", 2)
    player, _ = begin()
    for _ in range(2):
        player.order_steps(1)
    with pytest.raises(ValueError, match="2 calls of `step` are waiting already"):
        player.order_steps(1)
    player.step()
    assert player.order_steps(1)
