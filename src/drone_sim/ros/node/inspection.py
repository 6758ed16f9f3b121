"""~variables: what scripts hold; ~breakpoints: the lines at which the flight pauses; ~names: what scripts may name.

All three are JSON, made while somebody listens. Nothing of it changes the flight.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import rospy
from std_msgs.msg import String

from drone_sim.ros.core.inbox import Inbox
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.scripting.breakpoints import read_breakpoints

_PERIOD = 0.2  # s of real time, between two messages of variables
_NAMES_PERIOD = 1.0  # s of real time, between two looks at the names
_LONGEST = 100_000  # characters of the breakpoints
_MOST_SCRIPTS = 16
_MOST_NAMES = 2000


class _Newcomers(rospy.SubscribeListener):
    """Whether a new subscriber has come; one that unsubscribes and subscribes again counts, too."""

    def __init__(self) -> None:
        super().__init__()
        self._any = False

    def peer_subscribe(self, *_: Any) -> None:
        """Note a new subscriber; a thread of rospy's calls this."""
        self._any = True

    def take(self) -> bool:
        """Return whether one has come, and forget it."""
        was, self._any = self._any, False
        return was


class LatchedText:
    """A latched topic of text, made anew only while somebody listens, and for everybody who begins to."""

    def __init__(self, topic: str, queue_size: int = 1):
        """Advertise it; `queue_size` messages wait for a subscriber, before the oldest is lost."""
        self._came = _Newcomers()
        self._publisher = rospy.Publisher(topic, String, self._came, queue_size=queue_size, latch=True)
        self._said = ""

    @property
    def is_heard(self) -> bool:
        """Whether anybody listens."""
        return self._publisher.get_num_connections() > 0

    @property
    def has_new_listeners(self) -> bool:
        """Whether somebody has begun to listen since this was last asked."""
        return self._came.take()

    def say(self, value: Any) -> None:
        """Publish a value as JSON, unless that is what was said last."""
        text = json.dumps(value)
        if text != self._said:
            self._said = text
            self._publisher.publish(text)


class InspectionTopics:
    """Shows the authors of scripts what their scripts do."""

    def __init__(self, player: Player, inbox: Inbox):
        """Advertise and subscribe for the simulation of `player`, whose thread empties `inbox`."""
        self._player, self._simulation, self._inbox = player, player.simulation, inbox
        self._variables, self._names = LatchedText("~variables"), LatchedText("~names")
        self._throttle, self._names_throttle = Throttle(_PERIOD), Throttle(_NAMES_PERIOD)
        self._shown: Any = None  # when variables were last shown: run, step, state
        self._breakpoints = rospy.Subscriber("~breakpoints", String, self._on_breakpoints, queue_size=10)

    def update(self) -> None:
        """Publish what is new, if somebody listens."""
        if self._simulation.breakpoints and not self._breakpoints.get_num_connections():
            self._simulation.set_breakpoints({})  # who set them has gone
        if self._variables.is_heard:
            self._show_variables()
        if self._names.is_heard and (self._names.has_new_listeners or self._names_throttle.passes()):
            self._names.say(self._known_names())

    def _show_variables(self) -> None:
        if self._simulation.breakpoints.reached is not None and self._player.playing:
            return  # it is about to be paused
        now = self._simulation.run, self._simulation.steps, self._player.state
        is_due = self._variables.has_new_listeners or now != self._shown
        if is_due and (self._player.paused or self._throttle.passes()):
            self._shown = now
            self._variables.say(self._inspected())

    def _inspected(self) -> dict[str, Any]:
        reached = self._simulation.breakpoints.reached
        scripts: list[dict[str, Any]] = []
        for name, file, scopes in self._simulation.variables():
            if len(scripts) < _MOST_SCRIPTS:
                scripts.append({"name": name, "file": file, "scopes": [one.as_json() for one in scopes]})
        at: dict[str, Any] = {}
        if reached is not None:
            at = {"file": reached.file, "line": reached.line, "time": reached.time}
            at["scopes"] = [one.as_json() for one in reached.scopes]
        return {"time": self._simulation.time, "state": self._player.state, "reached": at, "scripts": scripts}

    def _known_names(self) -> dict[str, list[str]]:
        """Return the names of the scene's objects, and of the parameters of scripts."""
        context = self._simulation.context
        objects = sorted(context.objects.names)[:_MOST_NAMES]
        own = (one.script_parameters().values() for one in self._simulation.child_scripts.values())
        parameters = sorted({name for values in own for one in values for name in one})[:_MOST_NAMES]
        return {"objects": objects, "parameters": parameters}

    def _on_breakpoints(self, message: String) -> None:
        """Have other breakpoints from the next step on."""
        try:
            if len(message.data) > _LONGEST:
                raise ValueError(f"has more than {_LONGEST} characters")
            lines = read_breakpoints(json.loads(message.data))
        except (ValueError, RecursionError) as error:
            rospy.logwarn_throttle(1, f"breakpoints: refused: {error}")
            return
        self._inbox.put(self._setting(lines))

    def _setting(self, lines: dict[str, frozenset[int]]) -> Callable[[], None]:
        return lambda: self._simulation.set_breakpoints(lines)
