"""The charts of the cockpit's page: vehicle state, sensors (subscribed on request) and signals."""

import json
import math

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, Range
from std_msgs.msg import String

from drone_sim.ros.cockpit.panel.board import Board
from drone_sim.ros.cockpit.panel.plots import Plots
from drone_sim.ros.cockpit.topics import PLOTTED

RANGE, IMU = "/drone/range", "/drone/imu/data"
KINDS = {RANGE: "sensor_msgs/Range", IMU: "sensor_msgs/Imu"}


@pytest.fixture(name="heard")
def _heard(monkeypatch):
    """The callbacks of all subscribers, by topic."""
    heard = {}

    class Subscriber:
        def __init__(self, topic, _kind, callback, *arguments, **_options):
            self.topic = topic
            heard[topic] = lambda message: callback(message, *arguments)

        def unregister(self):
            del heard[self.topic]

    monkeypatch.setattr(rospy, "Subscriber", Subscriber)
    return heard


@pytest.fixture(name="board")
def _board():
    return Board(lambda _: None)


@pytest.fixture(name="plots")
def _plots(heard, board, clock):
    plots = Plots(board, clock)
    plots.offer(KINDS)
    return plots


def stamped(message, time):
    message.header.stamp = rospy.Time.from_sec(time)
    return message


def rows_of(plots, chart, run=0, at=-1):
    chart_data = plots.answer({"charts": {chart: [run, at]}})["charts"][chart]
    return chart_data["run"], chart_data["rows"]


def test_a_sensor_is_subscribed_only_while_its_chart_is_requested(plots, heard, board, clock):
    charts = [entry["chart"] for entry in board.get("charts")]
    imu = [f"{IMU} drone/imu/data: {quantity}" for quantity in ("acceleration", "rate")]
    assert charts == [f"{RANGE} drone/range", *imu]
    assert heard == {}
    rows_of(plots, charts[0])
    clock.now = 4.0
    rows_of(plots, charts[1])
    assert set(heard) == {RANGE, IMU}
    clock.now = 6.0
    plots.rest()
    assert set(heard) == {IMU}
    plots.offer({})
    assert rows_of(plots, charts[1]) == (0, [])


def test_the_last_half_minute_is_sent_once_with_gaps_for_infinite_ranges(plots, heard):
    chart = f"{RANGE} drone/range"
    rows_of(plots, chart)
    for time in np.arange(0, 40, 0.5):
        heard[RANGE](stamped(Range(range=math.inf if time == 30 else time), time))
    run, rows = rows_of(plots, chart)
    assert (rows[0], rows[-1]) == ([9.5, 9.5], [39.5, 39.5])
    assert [time for time, value in rows if value is None] == [30.0]
    assert rows_of(plots, chart, run, 39.0)[1] == [[39.5, 39.5]]
    assert rows_of(plots, chart, run + 1, 39.0)[1] == rows, "a client that knows another run gets all rows of this run"


def test_a_new_run_clears_the_chart_and_a_fast_sensor_is_thinned_out(plots, heard):
    chart = f"{IMU} drone/imu/data: rate"
    rows_of(plots, chart)
    heard[IMU](stamped(Imu(), 100.0))
    message = Imu()
    message.angular_velocity.z = 3.0
    for step in range(4000):
        heard[IMU](stamped(message, step * 0.005))
    run, rows = rows_of(plots, chart)
    assert run == 1 and 500 < len(rows) <= 1000 and rows[-1][1:] == [0.0, 0.0, 3.0]


def test_the_charts_of_the_followed_vehicle_are_always_recorded(plots, heard, board):
    plots.follow("drone")
    assert [entry["chart"] for entry in board.get("charts")][:4] == ["velocity", "height", "attitude", "propellers"]
    message = stamped(Odometry(), 2.0)
    message.pose.pose.position.z, message.pose.pose.orientation.w, message.twist.twist.linear.x = 0.8, 1.0, 0.5
    heard["/drone/odom"](message)
    assert rows_of(plots, "height")[1] == [[2.0, 0.8]]
    assert rows_of(plots, "velocity")[1] == [[2.0, 0.0, 0.5, 0.0, 0.0]]
    assert rows_of(plots, "propellers")[1] == [[2.0, None, None, None, None, None]], "no propeller speeds were received"
    plots.follow("")
    assert rows_of(plots, "height")[1] == [] and not heard


def test_every_signal_gets_a_chart(plots, board):
    for time in (1.0, 2.0):
        plots.on_signals(String(json.dumps({"time": time, "signals": {"gain": time / 2}})))
    assert [entry["title"] for entry in board.get("charts")][-1] == "gain"
    assert rows_of(plots, "signal gain")[1] == [[1.0, 0.5], [2.0, 1.0]]
    for wrong in ("nonsense", "[" * 100_000, "3", '{"time": 1}', '{"time": 1, "signals": {"a": "b"}}'):
        plots.on_signals(String(wrong))
    assert rows_of(plots, "signal gain", 0, 1.0)[1] == [[2.0, 1.0]]


@pytest.mark.parametrize("wrong", [None, [], {"height": 3}, {"height": [1]}, {"height": [True, "x"]}])
def test_an_invalid_request_for_charts_gets_one_line(plots, wrong):
    with pytest.raises(ValueError, match=r"^charts = [^\n]*: must be a mapping"):
        plots.answer({"charts": wrong})
    assert plots.answer({"charts": {"no such chart": [0, 0.0]}})["charts"]["no such chart"]["rows"] == []


def test_every_reading_has_a_name_for_each_number():
    for reading in PLOTTED.values():
        assert len(reading.numbers(reading.message())) == len(reading.names)
