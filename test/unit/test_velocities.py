"""Velocities and times that scripts read, as V-REP measures them."""

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
    return [sample for sample in told if sample["phase"] == "sensing"][index]


def test_time_advances_after_the_sensing_phase(told):
    assert [sample["phase"] for sample in told[:4]] == ["actuation", "sensing"] * 2
    assert [sample["time"] for sample in told] == pytest.approx([STEP * (index // 2) for index in range(12)])
    assert [sample["pass"] for sample in told] == [index // 2 for index in range(12)]


def test_fall_has_the_mean_and_the_final_velocity_of_the_step(told):
    for index in range(6):
        # Semi-implicit Euler: each of the 10 sub-steps of 5 ms moves with its final velocity.
        mean = -GRAVITY * (STEP * index + 0.0275)
        assert sensed(told, index)["measured"][BASE][0] == pytest.approx([0, 0, mean], abs=1e-9)
        assert sensed(told, index)["reached"][BASE][0] == pytest.approx([0, 0, -GRAVITY * STEP * (index + 1)], abs=1e-9)


@pytest.mark.parametrize("which", [ROD, TIP])
def test_angular_velocity_is_given_as_euler_angles_or_rotation_vector(told, which):
    before, now = (sensed(told, index) for index in (0, 1))
    turns = [np.reshape(sample["matrices"][which], (3, 4))[:, :3] for sample in (before, now)]
    positions = [np.reshape(sample["matrices"][which], (3, 4))[:, 3] for sample in (before, now)]
    turn = frames.relative_turn(before["matrices"][which], now["matrices"][which])
    linear, angular = now["measured"][which]
    assert linear == pytest.approx((positions[1] - positions[0]) / STEP, abs=1e-9)
    assert angular == pytest.approx(np.array(frames.to_euler(turn)) / STEP, abs=1e-9)
    assert now["axis"][which] == pytest.approx(Rotation.from_matrix(turns[1] @ turns[0].T).as_rotvec() / STEP, abs=1e-9)
    assert now["axis"][which] == pytest.approx([4, 7, 4], abs=1e-6)
    assert np.linalg.norm(np.subtract(angular, now["axis"][which])) > 0.5


def test_object_moved_by_a_script_has_the_velocity_of_that_motion(told):
    assert sensed(told, 2)["measured"][PAD][0] == pytest.approx([0.1 / STEP, 0, 0])
    assert sensed(told, 2)["reached"][PAD][0] == [0, 0, 0]


def test_placing_a_dynamic_object_by_script_does_not_count_as_motion(told):
    for index in (2, 3, 4):
        assert abs(sensed(told, index)["measured"][ROD][0][0]) < 1e-9
    assert sensed(told, 3)["matrices"][ROD][3] == pytest.approx(-5)
