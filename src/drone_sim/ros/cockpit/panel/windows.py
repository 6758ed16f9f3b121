"""What scripts have opened for a person to look at, and what that person answers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import rospy
from std_msgs.msg import String

from drone_sim.ros.cockpit.panel.cameras import Cameras
from drone_sim.ros.cockpit.server.wire import Answer, Wire

_KINDS = ("views", "dialogs", "consoles")
_LONGEST = 1 << 21  # characters of a message; the simulation's own have less


class Windows:
    """Tells the browsers of views, dialogs and consoles; a view switches its camera on."""

    def __init__(self, node: str, cameras: Cameras, wire: Wire):
        """Take the simulation's node, and begin without listening."""
        self._node = node
        self._cameras, self._wire = cameras, wire
        self._listening: rospy.Subscriber | None = None
        self._answering: rospy.Publisher | None = None
        self._state: dict[str, Any] = {kind: [] for kind in _KINDS}

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers `windows`, `answer` and `camera`."""
        return {
            "windows": lambda _: {"windows": self._state, "pictures": self._cameras.shown},
            "answer": self._answer,
            "camera": self._turn,
        }

    def listen(self, on: bool) -> None:
        """Listen, and be there to answer dialogs, or do neither."""
        if on and self._listening is None:
            self._answering = rospy.Publisher(f"{self._node}/window_answers", String, queue_size=10)
            self._listening = rospy.Subscriber(f"{self._node}/windows", String, self._hear, queue_size=1)
        elif not on and self._listening is not None and self._answering is not None:
            self._listening.unregister()
            self._answering.unregister()
            self._listening = self._answering = None
            self._show({kind: [] for kind in _KINDS})

    def _hear(self, message: String) -> None:
        try:
            state = json.loads(message.data) if len(message.data) <= _LONGEST else None
        except (ValueError, RecursionError):
            state = None
        if isinstance(state, Mapping) and all(isinstance(state.get(kind), list) for kind in _KINDS):
            self._show({kind: [one for one in state[kind] if isinstance(one, dict)] for kind in _KINDS})

    def _show(self, state: dict[str, Any]) -> None:
        self._state = state
        self._cameras.follow_views(frozenset(str(one.get("topic")) for one in state["views"] if one.get("topic")))
        self._wire.tell({"windows": state})

    def _answer(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        """Hand on which button was pressed; the simulation checks it."""
        if self._answering is None:
            raise ValueError("there is no simulation that hears the answer")
        self._answering.publish(json.dumps({key: message.get(key) for key in ("handle", "button", "typed")}))
        return {}

    def _turn(self, message: Mapping[str, Any]) -> Mapping[str, Any]:
        self._cameras.turn(str(message.get("topic")), bool(message.get("on")))
        return {}
