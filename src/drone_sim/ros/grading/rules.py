"""The rules of the game, as far as topics tell: who else has asked for what the plan does not allow."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import rospy

from drone_sim.grading.permissions import CHANGE, MOST_TRIED, MOVE, PUSH
from drone_sim.grading.plan import Plan

_HANDLES = ("objects/feedback", "markers/feedback")  # rviz's, of a vehicle that is alone, or of all
_OF_A_VEHICLE = {  # what a topic asks for
    **dict.fromkeys(("set_pose", "initialpose", "reset", *_HANDLES), MOVE),
    "push": PUSH,
    **dict.fromkeys(("weather", "set_wind", "faults"), CHANGE),
}
_OF_THE_SCENE = ("set_object_pose", *_HANDLES)


class LiveRules:
    """Hears what others than whoever grades ask the simulator for; the first time of each thing is kept."""

    def __init__(self, plan: Plan, simulator: str, vehicles: Iterable[str], clock: Callable[[], float]):
        """Subscribe to what a `plan` does not allow of these vehicles; `clock` returns the simulated time in s."""
        self._clock = clock
        self.tried: list[str] = []
        self._known: set[str] = set()
        asked = [(f"/{name}/{topic}", action, name) for name in vehicles for topic, action in _OF_A_VEHICLE.items()]
        asked += [(f"{simulator}/{topic}", MOVE, "the scene") for topic in _OF_THE_SCENE]
        for topic, action, what in asked:
            if action not in plan.allowed:
                rospy.Subscriber(topic, rospy.AnyMsg, partial(self._hear, topic, f"{action} {what}"))

    def clear(self) -> None:
        """Forget what was asked for before the flight."""
        self.tried, self._known = [], set()

    def _hear(self, topic: str, said: str, message: rospy.AnyMsg) -> None:
        sender = message._connection_header.get("callerid", "?")
        if sender != rospy.get_name() and topic not in self._known and len(self.tried) < MOST_TRIED:
            self._known.add(topic)
            self.tried.append(f"tried to {said} at {self._clock():.2f} s ({topic}, by {sender})")
