"""The rules of the game: what others have done to the world against the plan, as the simulator reports it."""

from __future__ import annotations

import rospy
from std_msgs.msg import String

from drone_sim.grading.permissions import CALL, MOST_TRIED
from drone_sim.grading.plan import Plan

_QUEUE = 1000  # messages


class LiveRules:
    """Hears what others than the grader do to the world; docs/interface.md describes `interventions`."""

    def __init__(self, plan: Plan, simulator: str):
        """Hear what a `plan` does not allow of the node `simulator`."""
        self._allowed, self._calls = {*plan.allowed}, {*plan.calls}
        self.tried: list[str] = []
        self._topic = rospy.Subscriber(f"{simulator}/interventions", String, self._hear, queue_size=_QUEUE)

    def is_connected(self) -> bool:
        """Whether the simulator is heard."""
        return bool(self._topic.get_num_connections())

    def clear(self) -> None:
        """Forget what was done before the flight."""
        self.tried = []

    def _hear(self, message: String) -> None:
        said = message.data
        is_own = said.endswith(f", by {rospy.get_name()})")
        if not is_own and not self._is_allowed(*said.split(" ", 2)) and len(self.tried) < MOST_TRIED:
            self.tried.append(f"tried to {said}")

    def _is_allowed(self, action: str, what: str = "", *_rest: str) -> bool:
        return what in self._calls if action == CALL else action in self._allowed
