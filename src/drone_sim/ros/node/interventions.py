"""~interventions: changes of the world from outside that are more than flying.

One line each, at the first time in a flight: `push drone at 3.20 s (/drone/push, by /flyer)`.
"""

from __future__ import annotations

import functools
from collections import Counter
from typing import Any

import rospy
from std_msgs.msg import String

from drone_sim.grading.permissions import CHANGE, MAX_TRIED, Actions, free_functions
from drone_sim.message_text import MAX_NAME, printable
from drone_sim.ros.core.inbox import Intervention
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.calls import Function

_CLIENT = "a client of the remote API"
_WAITING = 100  # messages


class Interventions:
    """Publishes the interventions. Only the simulation's thread calls its methods."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._topic = rospy.Publisher("~interventions", String, queue_size=_WAITING)
        self._run = self._topology_version = -1

    def update(self) -> None:
        """At the start of a run, publish the tuned values that are still in force."""
        simulation = self._simulation
        if self._run == simulation.run:
            return
        self._run = simulation.run
        self._published: set[Intervention] = set()
        self._count: Counter[tuple[str, str]] = Counter()  # interventions by action and sender
        for name, script in simulation.child_scripts.items() if simulation.running else ():
            if script.tuning.chosen:
                self._publish(CHANGE, name, f"{', '.join(script.tuning.chosen)}, tuned before")

    def publish(self, intervention: Intervention) -> None:
        """Publish an intervention that happens now."""
        self.update()
        kind = intervention.action, intervention.by
        if intervention not in self._published and self._count[kind] < MAX_TRIED:
            self._published.add(intervention)
            self._count[kind] += 1
            self._publish(intervention.action, intervention.what, f"{intervention.way}, by {intervention.by}")

    def _publish(self, action: str, what: str, how: str) -> None:
        self._topic.publish(printable(f"{action} {what:.{MAX_NAME}} at {self._simulation.time:.2f} s ({how})"))

    # ---- clients of the remote APIs

    def watched(self, name: str, function: Function) -> Function:
        """Return an API function for clients that also publishes its intervention; unchanged if it never intervenes."""
        if name in free_functions():
            return function

        @functools.wraps(function)
        def published(*arguments: Any) -> Any:
            actions, given = self._clients(), [*arguments]
            action = actions.action_of(name, given)
            if action is not None:
                self.publish(Intervention(action, actions.subject_of(name, given), name, _CLIENT))
            return function(*arguments)

        return published

    def _clients(self) -> Actions:
        """Return the rules for clients: they may fly all vehicles, also by the green spheres, and are not scripts."""
        if self._topology_version != self._simulation.topology_version:
            self._topology_version = self._simulation.topology_version
            flown = self._simulation.vehicles.values()
            self._actions = Actions(self._simulation, flown, frozenset(), [vehicle.target for vehicle in flown])
        return self._actions
