"""~signals: numeric signals of scripts and values of graphs, for plots."""

from __future__ import annotations

import itertools
import json
import math

import rospy
from std_msgs.msg import String

from drone_sim.run.simulation import Simulation

_MAX_NUMBERS = 200  # in a message; the first ones are published


class SignalTopic:
    """Publishes the numbers as JSON, with the simulated time (s), after every step; latched, only for subscribers."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._topic = rospy.Publisher("~signals", String, queue_size=5, latch=True)
        self._published: tuple[float, dict[str, float]] = (-1.0, {})

    def update(self) -> None:
        """Publish the numbers if time has advanced and there are, or were, any."""
        if not self._topic.get_num_connections():
            return
        context, time = self._simulation.context, self._simulation.time
        found = {**context.signals.numbers(), **context.graphs.values()}
        first = itertools.islice(found.items(), _MAX_NUMBERS)
        numbers = {name: value for name, value in first if math.isfinite(value)}
        before, self._published = self._published, (time, numbers)
        if self._published != before and (numbers or before[1]):
            self._topic.publish(json.dumps({"time": round(time, 6), "signals": numbers}))
