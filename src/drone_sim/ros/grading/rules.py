"""The rules of the game: what others have done to the world against the plan, as the simulator reports it."""

from __future__ import annotations

import rospy
from std_msgs.msg import String

from drone_sim.grading.permissions import MOST_TRIED
from drone_sim.grading.plan import Plan

_QUEUE = 1000  # messages


class LiveRules:
    """Hears what others than the grader do to the world; docs/interface.md describes `interventions`."""

    def __init__(self, plan: Plan, simulator: str):
        """Hear what a `plan` does not allow of the node `simulator`."""
        self._allowed = {*plan.allowed}
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
        if not is_own and said.partition(" ")[0] not in self._allowed and len(self.tried) < MOST_TRIED:
            self.tried.append(f"tried to {said}")
