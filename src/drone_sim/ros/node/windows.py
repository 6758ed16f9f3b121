"""~windows: what scripts have opened for a person to look at; ~window_answers: what that person says to a dialog."""

from __future__ import annotations

import json
from typing import Any

import rospy
from std_msgs.msg import String

from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.node.step_time import Stamp
from drone_sim.ros.node.view_pictures import ViewPictures
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.windows import read_answer

_PERIOD = 0.1  # s of real time, between two messages
_LONGEST = 10_000  # characters of an answer


class WindowTopics:
    """Says what is open, as JSON, whenever it changes; who advertises answers may answer."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Advertise and subscribe."""
        self._simulation, self._inbox = simulation, inbox
        self._windows = rospy.Publisher("~windows", String, queue_size=1, latch=True)
        self._answers = rospy.Subscriber("~window_answers", String, self._on_answer, queue_size=10)
        simulation.windows.can_answer = lambda: self._answers.get_num_connections() > 0
        self._pictures = ViewPictures(simulation)
        self._throttle = Throttle(_PERIOD)
        self._shown = 0  # the windows' changes, when they were

    def update(self, stamp: Stamp) -> None:
        """Say what is open, where that is news, and what views show."""
        self._pictures.publish(stamp)
        windows = self._simulation.windows
        if windows.changes == self._shown or not self._throttle.passes():
            return
        self._shown = windows.changes
        state: dict[str, list[dict[str, Any]]] = windows.state()
        topics = self._pictures.follow([one["sensor"] for one in state["views"]])
        for view, topic in zip(state["views"], topics):
            view["topic"] = topic
        self._windows.publish(json.dumps(state))

    def _on_answer(self, message: String) -> None:
        """Press a button before the next step."""
        try:
            if len(message.data) > _LONGEST:
                raise ValueError(f"has more than {_LONGEST} characters")
            answer = read_answer(json.loads(message.data))
        except (ValueError, RecursionError) as error:
            rospy.logwarn_throttle(1, f"window_answers: refused: {error}")
            return
        self._inbox.put(lambda: self._answer(*answer))

    def _answer(self, handle: int, button: str, typed: str) -> None:
        try:
            self._simulation.windows.answer(handle, button, typed)
        except ValueError as error:
            rospy.logwarn_throttle(1, f"window_answers: refused: {error}")
