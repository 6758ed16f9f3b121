"""The machine's clock is set while the simulation runs in real time: what a step's messages are stamped with."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.ros.core.publishing import StepTime

STEP = 0.05  # s
NOW = 1.7e9  # s


@pytest.mark.parametrize(
    ("moved", "apart"),
    [
        (STEP, 0.01),  # not at all: 0.01 s ago is 0.01 s ago
        (STEP / 2, 0.005),  # a step that came faster, after a late one
        (3600.0, 0.01),
        (-0.5, 0.01),
        (-3600.0, 0.01),
        (-NOW + 1, 0.01),  # 1970
    ],
)
def test_what_was_measured_within_a_step_is_stamped_shortly_before_it(monkeypatch, moved, apart):
    clock = [NOW]
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time.from_sec(clock[0]))
    parameters = SimpleNamespace(time_step=STEP, real_time_factor=1.0)
    time = StepTime(SimpleNamespace(parameters=parameters), simulated=False)
    time.begin()
    clock[0] += moved
    time.begin()
    assert time.stamp() == rospy.Time.from_sec(clock[0])
    assert (time.stamp() - time.stamp(ago=0.01)).to_sec() == pytest.approx(apart, abs=1e-6)
