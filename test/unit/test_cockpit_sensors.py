"""The chart of one sensor in the cockpit's panel."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from sensor_msgs.msg import Imu, Range

from drone_sim.ros.cockpit.panel.plots import EVERY, SensorPlot
from drone_sim.ros.cockpit.topics import PLOTTED

RANGE, IMU = "/drone/range", "/drone/imu/data"
KINDS = {RANGE: "sensor_msgs/Range", IMU: "sensor_msgs/Imu"}


class Gui:
    """What has been drawn."""

    def __init__(self):
        self.charts = []

    def add_folder(self, _name):
        return self

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def add_dropdown(self, _name, options):
        self.choice = SimpleNamespace(options=options, value=options[0])
        return self.choice

    def add_uplot(self, data, series, **_):
        chart = SimpleNamespace(data=data, series=series)
        chart.remove = lambda: self.charts.remove(chart)
        self.charts.append(chart)
        return chart


@pytest.fixture(name="heard")
def _heard(monkeypatch):
    """Who listens: callbacks by topic."""
    heard = {}

    class Subscriber:
        def __init__(self, topic, _kind, callback, reading):
            self.topic = topic
            heard[topic] = lambda message: callback(message, reading)

        def unregister(self):
            del heard[self.topic]

    monkeypatch.setattr(rospy, "Subscriber", Subscriber)
    return heard


@pytest.fixture(name="plot")
def _plot(heard):
    gui = Gui()
    plot = SensorPlot(gui)
    plot.offer(KINDS)
    return plot, gui


def stamped(message, time):
    message.header.stamp = rospy.Time.from_sec(time)
    return message


def drawn(plot, gui):
    for _ in range(EVERY):
        plot.show()
    return gui.charts[0].data


def test_only_the_sensor_that_is_chosen_is_listened_to(plot, heard):
    plot, gui = plot
    plot.show()
    assert tuple(gui.choice.options) == ("none", RANGE, IMU) and heard == {} and gui.charts == []
    for topic in (RANGE, IMU):
        gui.choice.value = topic
        plot.show()
        assert list(heard) == [topic] and len(gui.charts) == 1
    assert [line["label"] for line in gui.charts[0].series][1:4] == [f"acceleration {one}, m/s²" for one in "xyz"]
    plot.show(listening=False)
    assert heard == {} and gui.charts == []


def test_the_last_half_minute_is_drawn_and_what_is_out_of_range_is_a_gap(plot, heard):
    plot, gui = plot
    gui.choice.value = RANGE
    plot.show()
    for time in np.arange(0, 40, 0.5):
        heard[RANGE](stamped(Range(range=math.inf if time == 30 else time), time))
    times, values = drawn(plot, gui)
    assert (times[0], times[-1]) == (-30.0, 0.0) and values[-1] == 39.5
    assert np.isnan(values[list(times + 39.5).index(30)]) and np.isnan(values).sum() == 1


def test_another_run_begins_anew_and_many_points_are_thinned(plot, heard):
    plot, gui = plot
    gui.choice.value = IMU
    plot.show()
    heard[IMU](stamped(Imu(), 100.0))
    for step in range(4000):
        heard[IMU](stamped(Imu(), step * 0.005))
    columns = drawn(plot, gui)
    assert len(columns) == 7 and 300 < len(columns[0]) <= 600 and columns[0][0] > -20.1


def test_a_sensor_that_goes_is_chosen_no_more(plot, heard):
    plot, gui = plot
    gui.choice.value = RANGE
    plot.show()
    plot.offer({IMU: KINDS[IMU]})
    plot.show()
    assert gui.choice.value == "none" and heard == {}


def test_every_reading_has_a_name_for_each_number():
    for reading in PLOTTED.values():
        assert len(reading.numbers(reading.message())) == len(reading.names)
