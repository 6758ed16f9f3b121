"""Graph streams, and the topic that publishes the numbers of graphs and signals."""

import json
from types import SimpleNamespace

import pytest

from drone_sim.scripting.api.graphs import Graphs
from drone_sim.scripting.api.signals import Signals


def test_streams_keep_their_latest_value_and_are_restored_by_a_snapshot():
    graphs = Graphs()
    height = graphs.add(1, 7, "height")
    assert graphs.add(2, 7, "height") == height and graphs.add(3, 8, "height") == 3
    graphs.remove(8, 3)
    assert graphs.values() == {}
    graphs.set(7, height, 1.5)
    restore = graphs.save_state()
    graphs.reset(7)
    assert graphs.values() == {}
    graphs.remove(7, height)
    restore()
    assert graphs.values() == {"height": 1.5}
    graphs.reset(9)
    assert graphs.values() == {"height": 1.5}
    graphs.clear()
    assert graphs.values() == {}


def test_the_number_of_streams_is_limited_and_a_wrong_handle_is_refused():
    graphs = Graphs()
    with pytest.raises(ValueError, match=r"^the graph 7 has no stream with the handle 1$"):
        graphs.set(7, 1, 2.0)
    with pytest.raises(ValueError, match="at most 200 characters, not 201"):
        graphs.add(1, 7, "x" * 201)
    for number in range(1000):
        graphs.add(number, 7, str(number))
    with pytest.raises(ValueError, match=r"^at most 1000 streams of graphs"):
        graphs.add(1000, 7, "one more")


def test_signals_are_published_after_each_step_while_there_are_subscribers(monkeypatch):
    rospy = pytest.importorskip("rospy", reason="needs ROS")
    from drone_sim.ros.node.inspection import SignalTopic

    published, connections = [], [0]

    class Publisher:
        def __init__(self, *_, **__):
            pass

        def get_num_connections(self):
            return connections[0]

        def publish(self, text):
            published.append(json.loads(text))

    monkeypatch.setattr(rospy, "Publisher", Publisher)
    context = SimpleNamespace(signals=Signals(), graphs=Graphs())
    simulation = SimpleNamespace(context=context, time=0.05)
    topic = SignalTopic(simulation)
    context.signals.set(float, "gain", 2.5)
    topic.update()
    assert published == []
    connections[0] = 1
    topic.update()
    topic.update()
    assert published == [{"time": 0.05, "signals": {"gain": 2.5}}]
    context.signals.set(int, "count", 3)
    context.signals.set(float, "odd", float("inf"))
    context.graphs.set(7, context.graphs.add(1, 7, "height"), 0.8)
    simulation.time = 0.1
    topic.update()
    assert published[-1] == {"time": 0.1, "signals": {"count": 3, "gain": 2.5, "height": 0.8}}
    context.signals.clear()
    context.graphs.clear()
    for simulation.time in (0.15, 0.2, 0.25):
        topic.update()
    assert published[2:] == [{"time": 0.15, "signals": {}}], "the empty state is published only once"
