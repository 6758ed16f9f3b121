"""~edit_scene: edits of the scene as JSON; ~scene_objects: the tree of its objects; ~save_scene.

docs/interface.md describes both messages. The cockpit's editor needs nothing else to build a scene.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rospkg
import rospy
from diagnostic_msgs.srv import (  # of ROS's own services the one that takes a text and answers with one
    AddDiagnostics,
    AddDiagnosticsRequest,
)
from std_srvs.srv import Trigger

from drone_sim.config.types import ParameterError
from drone_sim.editing.editor import EditorState, SceneEditor
from drone_sim.editing.rows import Row, SceneRows
from drone_sim.files.resources import locate, package_path
from drone_sim.grading.permissions import CHANGE
from drone_sim.message_text import encodable
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.validation import intervention
from drone_sim.ros.node.inspection import LatchedText
from drone_sim.ros.node.services import Services, scene_parameter
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.scripting.errors import ScriptError

_SCENES = (".yaml", ".yml")
_PERIOD = 0.1  # s of real time, between two messages of the tree
_QUEUE_SIZE = 50  # messages of the tree, of which none may be lost: each has the changes since the last one
_MAX_LENGTH = 8 << 20  # characters of a request
_READING = {"text", "text_of"}  # requests that change nothing
_REFUSED = (ParameterError, ScriptError, ValueError, OSError, RuntimeError, RecursionError)


class TreeChange(EditorState):
    """A message of ~scene_objects."""

    version: int
    since: int | None  # the version that it changes; None: it has the whole tree
    objects: list[Row]  # that are new or have changed
    gone: list[int]  # handles of removed objects


class SceneEditing:
    """The scene's editor as services and a topic."""

    def __init__(self, player: Player, inbox: Inbox, services: Services):
        """Advertise for the simulation of `player`, whose thread runs the jobs in `inbox`.

        `services` are told of changed vehicles.
        """
        self._player, self._inbox, self._services = player, inbox, services
        name = rospy.get_name().strip("/").replace("/", "_")
        self.editor = SceneEditor(player, Path(rospkg.get_ros_home()) / "drone_sim" / name)
        self._rows = SceneRows(self.editor.simulation)
        self._topic = LatchedText("~scene_objects", queue_size=_QUEUE_SIZE)
        self._throttle = Throttle(_PERIOD)
        self._version = 0
        self._description: EditorState | None = None
        rospy.Service("~edit_scene", AddDiagnostics, self._answer)
        rospy.Service("~save_scene", Trigger, lambda request: self._attempt(self._save, "~save_scene", request))

    def _answer(self, request: AddDiagnosticsRequest) -> tuple[bool, str]:
        text = request.load_namespace
        if len(text) > _MAX_LENGTH:
            return False, f"edit_scene: a request may have at most {_MAX_LENGTH} characters"
        try:
            edit = json.loads(text)
        except (json.JSONDecodeError, RecursionError) as error:
            return False, f"edit_scene: the request is not JSON: {error}"
        is_reading = isinstance(edit, dict) and edit.keys() <= _READING
        return self._attempt(lambda: self._edit(edit), "" if is_reading else "~edit_scene", request)

    def _save(self) -> str:
        """Save the scene: to the file of the parameter `scene_file`, or to its own if that is none of the user's."""
        name = scene_parameter()
        is_other = Path(name).suffix in _SCENES and package_path() not in locate(name).resolve().parents
        return str(self.editor.answer({"save": name if is_other else True})["said"])

    def _attempt(self, job: Callable[[], str], changing: str, request: Any) -> tuple[bool, str]:
        """Run a job for a request, and return its answer; `changing` is the service if the job changes the scene."""
        change = intervention(CHANGE, "the scene", changing, request) if changing else None
        try:
            return True, self._inbox.ask(job, change)
        except _REFUSED as error:
            text = error.text if isinstance(error, ParameterError) else str(error)
            return False, encodable(" ".join(text.split()))

    def _edit(self, edit: Any) -> str:
        before, had_vehicle = self.editor.scene_file, bool(self._player.simulation.vehicles)
        answer = self.editor.answer(edit)
        if self.editor.scene_file != before:
            rospy.set_param("~scene_file", self.editor.scene_file)
        has_first_vehicle = not had_vehicle and bool(self._player.simulation.vehicles)
        if "new" in edit or "open" in edit or edit.get("draft") == "take" or has_first_vehicle:
            self._services.forget_script()
        self._services.update_vehicles()
        return json.dumps(answer)

    def update(self) -> None:
        """Publish the changes of the tree to subscribers, and the whole tree for a new one."""
        self.editor.follow()
        self.editor.keep_draft()
        if not self._topic.has_subscribers or not self._throttle.passes():
            return
        is_whole = self._topic.has_new_subscribers() or not self._version
        changed, gone = self._rows.follow()
        description = self.editor.described()
        if not (is_whole or changed or gone or description != self._description):
            return
        since, rows = (None, [*self._rows.rows.values()]) if is_whole else (self._version, changed)
        self._description = description
        self._version += 1
        change: TreeChange = {
            "version": self._version, "since": since, **description, "objects": rows, "gone": gone
        }  # fmt: skip
        self._topic.publish(change)
