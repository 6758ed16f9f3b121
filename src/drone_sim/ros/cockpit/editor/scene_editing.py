"""The page's scene editor: what browsers ask goes to the node, which has the scene; what changes goes to all."""

from __future__ import annotations

import base64
import binascii
import json
import re
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import rospy
from diagnostic_msgs.srv import AddDiagnostics
from std_msgs.msg import String

from drone_sim.editing.properties import properties
from drone_sim.files import writing
from drone_sim.ros.cockpit.editor.model_list import ModelList
from drone_sim.ros.cockpit.editor.recent_scenes import RecentScenes
from drone_sim.ros.cockpit.server.access_control import Content
from drone_sim.ros.cockpit.server.page_socket import Answer
from drone_sim.ros.core.simulator import FAILURES

_Message = Mapping[str, Any]
_Told = Callable[[_Message], None]
_LINE = re.compile(r"\bline (\d+)\b")
_TREE, _WAITING = "scene_objects", 50
_UPLOADED = (".ttm", ".obj", ".stl", ".dae", ".urdf", ".yaml")
_LARGEST = 6 << 20  # bytes of an uploaded model: of a message of 8 MiB


class SceneEditing:
    """Relays edits, and keeps the tree of objects for browsers that come later."""

    def __init__(self, node: str, folder: Path, tell: _Told):
        """Edit the scene of `node`; the user's scenes and models are in `folder`; `tell` sends to all browsers."""
        self._node, self._folder, self._tell = node, folder, tell
        self._listening: rospy.Subscriber | None = None
        self._has_missed = False  # a message, without which the later ones say nothing
        self._lock = threading.Lock()
        self._rows: dict[int, _Message] = {}
        self._said: dict[str, Any] = {}
        self._models, self._recent = ModelList(folder), RecentScenes(folder)

    def listen(self, wanted: bool) -> None:
        """Hear of the tree while a browser is open; called again and again."""
        if self._has_missed and self._listening is not None:
            self._listening.unregister()
            self._listening = None  # the node tells a new listener all
        if wanted and self._listening is None:
            self._has_missed = False
            self._listening = rospy.Subscriber(f"{self._node}/{_TREE}", String, self._on_tree, queue_size=_WAITING)
        elif not wanted and self._listening is not None:
            self._listening.unregister()
            self._listening = None
            with self._lock:
                self._rows, self._said = {}, {}

    def _on_tree(self, message: Any) -> None:
        said = json.loads(message.data)
        with self._lock:
            if said["since"] is None:
                self._rows = {}
            elif said["since"] != self._said.get("version"):
                self._has_missed = True
                return
            for handle in said["gone"]:
                self._rows.pop(handle, None)
            self._rows.update((row["handle"], row) for row in said["objects"])
            self._said = {key: value for key, value in said.items() if key not in ("objects", "gone")}
        self._tell({"tree": said})

    def picture(self, path: str) -> Content:
        """Return the picture of a model, by its path; None where it is none."""
        return self._models.picture(path)

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers each question."""
        return {
            "tree": lambda _: self._tree(),
            "edit": lambda one: self._ask({key: one[key] for key in ("edit", "name", "merge") if key in one}),
            "undo": lambda one: self._ask({"undo": True, **{key: one[key] for key in ("merge",) if key in one}}),
            "redo": lambda _: self._ask({"redo": True}),
            "properties": lambda _: {"types": properties()},
            "models": lambda _: {"groups": self._models.groups()},
            "upload_model": self._upload,
            "scene_files": lambda _: {**self._recent.listed(), **self._now("file", "draft")},
            "new_scene": lambda _: self._ask({"new": True}),
            "open_scene": self._open,
            "save_scene": self._save,
            "save_model": lambda one: self._ask({"save_model": one.get("object"), "file": self._path(one, "file")}),
            "scene_text": lambda _: self._ask({"text": True}),
            "objects_text": lambda one: self._ask({"text_of": one.get("objects")}),
            "write_scene_text": self._write,
            "draft": lambda one: self._ask({"draft": one.get("draft")}),
        }

    def _now(self, *keys: str) -> dict[str, Any]:
        with self._lock:
            return {key: self._said.get(key) for key in keys}

    def _tree(self) -> dict[str, Any]:
        with self._lock:
            rows = [self._rows[handle] for handle in sorted(self._rows)]
            return {"tree": {"version": -1, **self._said, "since": None, "objects": rows, "gone": []}}

    def _ask(self, request: _Message) -> dict[str, Any]:
        """Return the node's answer. Raises ValueError with its complaint."""
        try:
            answer = rospy.ServiceProxy(f"{self._node}/edit_scene", AddDiagnostics)(json.dumps(request))
        except FAILURES as error:
            raise ValueError(f"the simulation does not answer: {error}") from None
        if not answer.success:
            raise ValueError(answer.message)
        made: dict[str, Any] = json.loads(answer.message)
        return made

    def _open(self, message: _Message) -> dict[str, Any]:
        answer = self._ask({"open": self._path(message, "file")})
        self._recent.add(answer["file"])
        return answer

    def _save(self, message: _Message) -> dict[str, Any]:
        if "file" not in message:
            return self._saved(self._ask({"save": True}))
        path = self._path(message, "file")
        if Path(path).exists() and message.get("over") is not True and path != self._now("file")["file"]:
            raise ValueError(f"{message['file']} is there already")
        return self._saved(self._ask({"save": path}))

    def _saved(self, answer: dict[str, Any]) -> dict[str, Any]:
        self._recent.add(answer["file"])
        return answer

    def _path(self, message: _Message, key: str) -> str:
        """Return a file that a browser names, in the user's folder where it has none; with .yaml."""
        name = message.get(key)
        if not isinstance(name, str) or not name.strip():
            raise ValueError(f"{key}: must be the name of a file")
        path = Path(name) if Path(name).suffix else Path(f"{name}.yaml")
        return str(path if path.is_absolute() else self._folder / path)

    def _write(self, message: _Message) -> dict[str, Any]:
        try:
            return self._ask({"write": message.get("text"), "revision": message.get("revision")})
        except ValueError as error:
            found = _LINE.search(str(error))
            return {"error": str(error), "line": int(found[1]) if found else None}

    def _upload(self, message: _Message) -> dict[str, Any]:
        """Keep a model of the user's. Raises ValueError."""
        name = message.get("name")
        if not isinstance(name, str) or Path(name).name != name or Path(name).suffix.lower() not in _UPLOADED:
            raise ValueError(f"name: must end in {', '.join(_UPLOADED[:-1])} or {_UPLOADED[-1]}")
        try:
            content = base64.b64decode(str(message.get("content")), validate=True)
        except binascii.Error:
            raise ValueError("content: must be in base64") from None
        if len(content) > _LARGEST:
            raise ValueError(f"{name}: is larger than {_LARGEST >> 20} MiB")
        try:
            self._models.folder.mkdir(parents=True, exist_ok=True)
            writing.write_new(self._models.folder / name, content)
        except FileExistsError:
            raise ValueError(f"{name} is there already") from None
        except OSError as error:
            raise ValueError(str(error)) from None
        return {"model": self._models.operation(self._models.folder / name)}
