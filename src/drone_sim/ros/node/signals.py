"""~signals: the numbers that scripts signal, and those of graphs, for who plots them."""

from __future__ import annotations

import itertools
import json
import math

import rospy
from std_msgs.msg import String

from drone_sim.run.simulation import Simulation

_MOST = 200  # numbers; the first of them are told


class SignalTopic:
    """Publishes them as JSON, with the simulated time (s), after every step while somebody listens; latched."""

    def __init__(self, simulation: Simulation):
        """Advertise for `simulation`."""
        self._simulation = simulation
        self._topic = rospy.Publisher("~signals", String, queue_size=5, latch=True)
        self._told: tuple[float, dict[str, float]] = (-1.0, {})

    def update(self) -> None:
        """Publish the numbers if time has gone on, and there are any, or were any before."""
        if not self._topic.get_num_connections():
            return
        context, time = self._simulation.context, self._simulation.time
        found = {**context.signals.numbers(), **context.graphs.values()}
        numbers = {name: one for name, one in itertools.islice(found.items(), _MOST) if math.isfinite(one)}
        told, self._told = self._told, (time, numbers)
        if self._told != told and (numbers or told[1]):
            self._topic.publish(json.dumps({"time": round(time, 6), "signals": numbers}))
