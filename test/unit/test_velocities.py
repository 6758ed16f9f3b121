"""What scripts are told of velocities and time, as V-REP measures them."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drone_sim.mechanics import frames

STEP, GRAVITY = 0.05, 9.81  # s, m/s²
SCENE = {
    "objects": [
        {"name": "Pad", "shape": "box", "size": [1, 1, 0.1], "position": [3, 0, 0.5]},
        {"name": "Rod", "shape": "box", "size": [0.1, 0.3, 0.5], "mass": 1.0, "position": [-3, 0, 5]},
        {"name": "Tip", "kind": "dummy", "parent": "Rod", "position": [0, 0, 0.25]},
    ]
}
PYTHON = """
import json

def sysCall_init():
    self.told = []

def look(phase):
    names = "/Quadcopter/base", "/Pad", "/Rod", "/Rod/Tip"
    handles = [sim.getObject(name) for name in names]
    self.told.append({
        "phase": phase,
        "time": sim.getSimulationTime(),
        "pass": sim.getScriptExecutionCount(),
        "matrices": [sim.getObjectMatrix(one, -1) for one in handles],
        "measured": [sim.getObjectVelocity(one) for one in handles],
        "axis": [sim.getObjectVelocity(one + sim.handleflag_axis)[1] for one in handles],
        "reached": [sim.getVelocity(one) for one in handles],
    })
    sim.setStringSignal("told", json.dumps(self.told))

def sysCall_actuation():
    pad, rod, pass_ = sim.getObject("/Pad"), sim.getObject("/Rod"), len(self.told) // 2
    sim.setObjectPosition(pad, -1, [3 + 0.1 * pass_, 0, 0.5])
    if pass_ == 3:
        sim.setObjectPosition(rod, -1, [-5, 0, 5])
    look("actuation")

def sysCall_sensing():
    look("sensing")
"""
BASE, PAD, ROD, TIP = range(4)


@pytest.fixture(name="told", scope="module")
def _told(new_shared_simulation):
    simulation = new_shared_simulation({"scene": SCENE}, python=PYTHON)
    rod = simulation.context.objects[simulation.context.objects.handle("Rod")]
    simulation.world.set_velocity(rod.number, (0.0, 0.0, 0.0), (4.0, 7.0, 4.0))
    for _ in range(6):
        simulation.step()
    return json.loads(simulation.context.signals.get(str, "told"))


def sensed(told, index):
    return [one for one in told if one["phase"] == "sensing"][index]


def test_time_goes_on_after_the_sensing_phase(told):
    assert [one["phase"] for one in told[:4]] == ["actuation", "sensing"] * 2
    assert [one["time"] for one in told] == pytest.approx([STEP * (index // 2) for index in range(12)])
    assert [one["pass"] for one in told] == [index // 2 for index in range(12)]


def test_a_fall_is_measured_as_the_mean_of_the_step_and_reached_at_its_end(told):
    for index in range(6):
        # Semi-implicit Euler: of 10 sub-steps of 5 ms each goes at the velocity that it ends with.
        mean = -GRAVITY * (STEP * index + 0.0275)
        assert sensed(told, index)["measured"][BASE][0] == pytest.approx([0, 0, mean], abs=1e-9)
        assert sensed(told, index)["reached"][BASE][0] == pytest.approx([0, 0, -GRAVITY * STEP * (index + 1)], abs=1e-9)


@pytest.mark.parametrize("which", [ROD, TIP])
def test_a_turn_is_measured_in_euler_angles_of_its_own_frame_or_as_a_rotation_vector(told, which):
    before, now = (sensed(told, index) for index in (0, 1))
    turns = [np.reshape(one["matrices"][which], (3, 4))[:, :3] for one in (before, now)]
    places = [np.reshape(one["matrices"][which], (3, 4))[:, 3] for one in (before, now)]
    turn = frames.relative_turn(before["matrices"][which], now["matrices"][which])
    linear, angular = now["measured"][which]
    assert linear == pytest.approx((places[1] - places[0]) / STEP, abs=1e-9)
    assert angular == pytest.approx(np.array(frames.to_euler(turn)) / STEP, abs=1e-9)
    assert now["axis"][which] == pytest.approx(Rotation.from_matrix(turns[1] @ turns[0].T).as_rotvec() / STEP, abs=1e-9)
    assert now["axis"][which] == pytest.approx([4, 7, 4], abs=1e-6)
    assert np.linalg.norm(np.subtract(angular, now["axis"][which])) > 0.5


def test_what_a_script_moves_is_as_fast_as_that(told):
    assert sensed(told, 2)["measured"][PAD][0] == pytest.approx([0.1 / STEP, 0, 0])
    assert sensed(told, 2)["reached"][PAD][0] == [0, 0, 0]


def test_what_the_dynamics_moves_has_not_moved_where_a_script_puts_it(told):
    for index in (2, 3, 4):
        assert abs(sensed(told, index)["measured"][ROD][0][0]) < 1e-9
    assert sensed(told, 3)["matrices"][ROD][3] == pytest.approx(-5)
