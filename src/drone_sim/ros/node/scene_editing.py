"""~edit_scene: everything that can be done to the scene, as JSON; ~scene_objects: the tree of its objects; ~save_scene.

docs/interface.md says what both hold. A window in the browser, or a script, needs nothing else to build a scene.
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
from drone_sim.editing.editor import SceneEditor
from drone_sim.editing.rows import SceneRows
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
_WAITING = 50  # messages of the tree, each of which goes on with the one before
_LONGEST = 8 << 20  # characters of a request
_READING = {"text", "text_of"}  # requests
_REFUSED = (ParameterError, ScriptError, ValueError, OSError, RuntimeError, RecursionError)


class SceneEditing:
    """The scene's editor, for whoever asks by ROS."""

    def __init__(self, player: Player, inbox: Inbox, services: Services):
        """Advertise for the simulation of `player`, whose thread empties `inbox`; `services` tell who flies."""
        self._player, self._inbox, self._services = player, inbox, services
        name = rospy.get_name().strip("/").replace("/", "_")
        self.editor = SceneEditor(player, Path(rospkg.get_ros_home()) / "drone_sim" / name)
        self._rows = SceneRows(self.editor.simulation)
        self._topic = LatchedText("~scene_objects", queue_size=_WAITING)
        self._throttle = Throttle(_PERIOD)
        self._version = 0
        self._said: dict[str, Any] = {}
        rospy.Service("~edit_scene", AddDiagnostics, self._answer)
        rospy.Service("~save_scene", Trigger, lambda request: self._attempt(self._save, "~save_scene", request))

    def _answer(self, request: AddDiagnosticsRequest) -> tuple[bool, str]:
        text = request.load_namespace
        if len(text) > _LONGEST:
            return False, f"edit_scene: a request may have at most {_LONGEST} characters"
        try:
            said = json.loads(text)
        except (json.JSONDecodeError, RecursionError) as error:
            return False, f"edit_scene: the request is not JSON: {error}"
        is_reading = isinstance(said, dict) and said.keys() <= _READING
        return self._attempt(lambda: self._do(said), "" if is_reading else "~edit_scene", request)

    def _save(self) -> str:
        """Write the scene as it stands now, to the file that the parameter `scene_file` names."""
        name = scene_parameter()
        is_other = Path(name).suffix in _SCENES and package_path() not in locate(name).resolve().parents
        return str(self.editor.answer({"save": name if is_other else True})["said"])

    def _attempt(self, job: Callable[[], str], changing: str, request: Any) -> tuple[bool, str]:
        """Do a job for a request; `changing` is the service that changes the scene by it, '' for none."""
        done = intervention(CHANGE, "the scene", changing, request) if changing else None
        try:
            return True, self._inbox.ask(job, done)
        except _REFUSED as error:
            said = error.text if isinstance(error, ParameterError) else str(error)
            return False, encodable(" ".join(said.split()))

    def _do(self, said: Any) -> str:
        before, had_vehicle = self.editor.scene_file, bool(self._player.simulation.vehicles)
        answer = self.editor.answer(said)
        if self.editor.scene_file != before:
            rospy.set_param("~scene_file", self.editor.scene_file)
        has_first_vehicle = not had_vehicle and bool(self._player.simulation.vehicles)
        if "new" in said or "open" in said or said.get("draft") == "take" or has_first_vehicle:
            self._services.forget_script()
        self._services.update_vehicles()
        return json.dumps(answer)

    def update(self) -> None:
        """Say what is new of the tree, while somebody listens."""
        self.editor.follow()
        self.editor.keep_draft()
        if not self._topic.is_heard or not self._throttle.passes():
            return
        is_whole = self._topic.has_new_listeners or not self._version
        changed, gone = self._rows.follow()
        said = self.editor.described()
        if not (is_whole or changed or gone or said != self._said):
            return
        self._said, before = said, self._version
        self._version += 1
        rows = [*self._rows.rows.values()] if is_whole else changed
        since = None if is_whole else before
        self._topic.say({"version": self._version, "since": since, **said, "objects": rows, "gone": gone})
