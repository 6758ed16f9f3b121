"""Topics for authors of scripts, as JSON, made only for subscribers. None of them changes the flight.

~variables: the scripts' variables; ~breakpoints: lines at which the flight pauses; ~names: names for completion;
~signals: numeric signals of scripts and values of graphs, for plots.
"""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import rospy
from std_msgs.msg import String

from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.publishing import NewSubscribers
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.breakpoints import read_breakpoints

_PERIOD = 0.2  # s of real time, between two messages of variables
_NAMES_PERIOD = 1.0  # s of real time, between two messages of names
_MAX_LENGTH = 100_000  # characters of the breakpoints
_MAX_SCRIPTS = 16
_MAX_NAMES = 2000
_MAX_NUMBERS = 200  # in a message of signals; the first ones are published


class LatchedText:
    """A latched topic of text, which its owner updates only for subscribers, and for each new one."""

    def __init__(self, topic: str, queue_size: int = 1):
        """Advertise it; `queue_size` messages wait for a subscriber, before the oldest is lost."""
        self._new_subscribers = NewSubscribers()
        self._publisher = rospy.Publisher(topic, String, self._new_subscribers, queue_size=queue_size, latch=True)
        self._published = ""

    @property
    def has_subscribers(self) -> bool:
        return self._publisher.get_num_connections() > 0

    def has_new_subscribers(self) -> bool:
        """Return whether there are subscribers since the last call; one that subscribes again counts, too."""
        return bool(self._new_subscribers.take())

    def publish(self, value: Any) -> None:
        """Publish a value as JSON if it has changed."""
        text = json.dumps(value)
        if text != self._published:
            self._published = text
            self._publisher.publish(text)


class InspectionTopics:
    """Topics for authors of scripts: variables, breakpoints and names."""

    def __init__(self, player: Player, inbox: Inbox):
        """Advertise and subscribe for the simulation of `player`, whose thread runs the jobs in `inbox`."""
        self._player, self._simulation, self._inbox = player, player.simulation, inbox
        self._variables, self._names = LatchedText("~variables"), LatchedText("~names")
        self._throttle, self._names_throttle = Throttle(_PERIOD), Throttle(_NAMES_PERIOD)
        self._shown: Any = None  # run, step and state when variables were last published
        self._breakpoints = rospy.Subscriber("~breakpoints", String, self._on_breakpoints, queue_size=10)

    def update(self) -> None:
        if self._simulation.breakpoints and not self._breakpoints.get_num_connections():
            self._simulation.set_breakpoints({})  # their author has disconnected
        if self._variables.has_subscribers:
            self._show_variables()
        if self._names.has_subscribers and (self._names.has_new_subscribers() or self._names_throttle.passes()):
            self._names.publish(self._known_names())

    def _show_variables(self) -> None:
        if self._simulation.breakpoints.reached is not None and self._player.playing:
            return  # it is about to be paused
        now = self._simulation.run, self._simulation.steps, self._player.state
        is_due = self._variables.has_new_subscribers() or now != self._shown
        if is_due and (self._player.paused or self._throttle.passes()):
            self._shown = now
            self._variables.publish(self._inspected())

    def _inspected(self) -> dict[str, Any]:
        reached = self._simulation.breakpoints.reached
        scripts = [
            {"name": name, "file": file, "scopes": [scope.as_json() for scope in scopes]}
            for name, file, scopes in [*self._simulation.variables()][:_MAX_SCRIPTS]
        ]
        at: dict[str, Any] = {}
        if reached is not None:
            at = {"file": reached.file, "line": reached.line, "time": reached.time}
            at["scopes"] = [scope.as_json() for scope in reached.scopes]
        return {"time": self._simulation.time, "state": self._player.state, "reached": at, "scripts": scripts}

    def _known_names(self) -> dict[str, list[str]]:
        """Return the names of the scene's objects, and of the parameters of scripts."""
        context = self._simulation.context
        objects = sorted(context.objects.names)[:_MAX_NAMES]
        scripts = self._simulation.child_scripts.values()
        groups = [group for script in scripts for group in script.script_parameters().values()]
        parameters = sorted({name for group in groups for name in group})[:_MAX_NAMES]
        return {"objects": objects, "parameters": parameters}

    def _on_breakpoints(self, message: String) -> None:
        """Set the breakpoints from the next step on."""
        try:
            if len(message.data) > _MAX_LENGTH:
                raise ValueError(f"has more than {_MAX_LENGTH} characters")
            lines = read_breakpoints(json.loads(message.data))
        except (ValueError, RecursionError) as error:
            rospy.logwarn_throttle(1, f"breakpoints: refused: {error}")
            return
        self._inbox.put(lambda: self._simulation.set_breakpoints(lines))


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
