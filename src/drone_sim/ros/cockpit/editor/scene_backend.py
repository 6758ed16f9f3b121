"""Backend of the page's scene editor: forwards edits to the simulator and its changes to all browsers."""

from __future__ import annotations

import base64
import binascii
import json
import re
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import rospy
from diagnostic_msgs.srv import AddDiagnostics
from std_msgs.msg import String

from drone_sim.editing.properties import properties
from drone_sim.files import writing
from drone_sim.files.resources import package_path
from drone_sim.ros.cockpit.editor.lists import ModelList, RecentScenes
from drone_sim.ros.cockpit.server.page_socket import Answer
from drone_sim.ros.core.shell_files import script_from_shell
from drone_sim.ros.core.simulator import FAILURES
from drone_sim.scripting.load import DEFAULT
from drone_sim.scripting.python.helpers import BUILT_IN

_Message = Mapping[str, Any]
_LINE = re.compile(r"\bline (\d+)\b")
_TREE, _QUEUE_SIZE = "scene_objects", 50
_UPLOAD_SUFFIXES = (".ttm", ".obj", ".stl", ".dae", ".urdf", ".yaml")
_TREE_TIMEOUT, _TREE_POLL = 5.0, 0.02  # s, for the tree of a scene that was opened
_MAX_SIZE = 6 << 20  # bytes of an uploaded model: in base64 it must fit into a message of 8 MiB


class SceneBackend:
    """Forwards edits to the simulator, and keeps the object tree for browsers that connect later."""

    def __init__(
        self, node: str, folder: Path, broadcast: Callable[[_Message], None], vehicle: Callable[[], str] = lambda: ""
    ):
        """`node` is the simulator's name, `folder` that of the user's scenes; `broadcast` sends to browsers that edit.

        `vehicle` returns the name of the vehicle that the page flies.
        """
        self._vehicle = vehicle
        self._node, self._folder, self._broadcast = node, folder, broadcast
        self._subscriber: rospy.Subscriber | None = None
        self._has_gap = False  # a change was lost, so that later changes cannot be applied
        self._lock = threading.Lock()
        self._rows: dict[int, _Message] = {}
        self._header: dict[str, Any] = {}  # of the last message: all keys except its rows
        self.models, self._recent = ModelList(folder), RecentScenes(folder)

    def subscribe(self, wanted: bool) -> None:
        """Subscribe to the object tree while `wanted` (a browser is open); to be called repeatedly."""
        if self._has_gap and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None  # a new subscriber gets the whole tree
        if wanted and self._subscriber is None:
            self._has_gap = False
            self._subscriber = rospy.Subscriber(f"{self._node}/{_TREE}", String, self._on_tree, queue_size=_QUEUE_SIZE)
        elif not wanted and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None
            with self._lock:
                self._rows, self._header = {}, {}

    def _on_tree(self, message: Any) -> None:
        change = json.loads(message.data)
        with self._lock:
            if change["since"] is None:
                self._rows = {}
            elif change["since"] != self._header.get("version"):
                self._has_gap = True
                return
            for handle in change["gone"]:
                self._rows.pop(handle, None)
            changed = [
                {"handle": row["handle"], **difference}
                for row in change["objects"]
                if (difference := _difference(self._rows.get(row["handle"], {}), row))
            ]
            self._rows.update((row["handle"], row) for row in change["objects"])
            self._header = {key: value for key, value in change.items() if key not in ("objects", "gone")}
        self._broadcast({"tree": {**change, "objects": changed}})

    @property
    def is_new(self) -> bool:
        """Whether the scene was begun in the editor and has no file yet."""
        return bool(self._state("new")["new"])

    @property
    def is_modified(self) -> bool:
        """Whether the scene has changes that are not saved."""
        return bool(self._state("modified")["modified"])

    @property
    def is_own(self) -> bool:
        """Whether the scene has changes that are not saved, or is a file in the user's folder."""
        return self.is_modified or self._folder in Path(self._state("file")["file"] or "").parents

    def reopen(self, file: str, was_modified: bool) -> None:
        """Open a scene file, or the draft of a scene that another one replaced before it was saved; nothing flies then.

        Returns when the object tree is that of the scene. Raises ValueError.
        """
        revision = self._call({"draft": "take"} if was_modified else {"open": file})["revision"]
        end = time.monotonic() + _TREE_TIMEOUT
        while (self._state("revision")["revision"] or 0) < revision and time.monotonic() < end:
            time.sleep(_TREE_POLL)

    # ---- the script of the vehicle that the page flies

    @property
    def scene(self) -> tuple[object, ...]:
        """What tells the scene from another one: its file, and the names of its vehicles."""
        with self._lock:
            vehicles = frozenset(str(row["vehicle"]) for row in self._rows.values() if row.get("root"))
            return self._header.get("file"), self._header.get("new"), vehicles

    @property
    def has_no_vehicle(self) -> bool:
        """Whether the scene is known to have no vehicle."""
        with self._lock:
            return bool(self._rows) and not any(row.get("root") for row in self._rows.values())

    @property
    def own_script(self) -> str:
        """The script that the scene names for the vehicle; '' if it names none."""
        row = self._vehicle_row()
        return str(row["own_script"]) if row else ""

    def set_script(self, script: str) -> None:
        """Write the script of the vehicle into the scene. Raises ValueError."""
        row, script = self._vehicle_row(), _name_in_scene(script)
        if row is not None and row["own_script"] != script:
            operation = {"do": "set", "object": row["handle"], "values": {"script": script}}
            self._call({"edit": [operation], "name": f"Fly {Path(script).name}"})

    def _keep_flown_script(self) -> None:
        """Write the script that was last run into a scene that names none, so that the saved scene flies the same."""
        if self._vehicle_row() is None or self.own_script or self._state("state")["state"] != "stopped":
            return
        script = script_from_shell(str(rospy.get_param(f"{self._node}/script", "")))
        if Path(script).is_absolute() and Path(script).stem != DEFAULT:
            self.set_script(script)

    def _vehicle_row(self) -> _Message | None:
        with self._lock:
            roots = [row for row in self._rows.values() if row.get("root")]
        wanted = self._vehicle()
        return next((row for row in roots if row["vehicle"] == wanted), roots[0] if roots else None)

    @property
    def answers(self) -> dict[str, Answer]:

        def pick(message: _Message, *keys: str) -> dict[str, Any]:
            return {key: message[key] for key in keys if key in message}

        return {
            "tree": lambda _: self._tree(),
            "edit": lambda message: self._call(pick(message, "edit", "name", "merge")),
            "undo": lambda message: self._call({"undo": True, **pick(message, "merge")}),
            "redo": lambda _: self._call({"redo": True}),
            "properties": lambda _: {"types": properties()},
            "models": lambda _: {"groups": self.models.groups()},
            "upload_model": self._upload,
            "scene_files": lambda _: {**self._recent.listed(), **self._state("file", "draft")},
            "new_scene": lambda _: self._call({"new": True}),
            "open_scene": self._open,
            "save_scene": self._save,
            "save_model": lambda message: self._call(
                {"save_model": message.get("object"), "file": self._path(message)}
            ),
            "scene_text": lambda _: self._call({"text": True}),
            "objects_text": lambda message: self._call({"text_of": message.get("objects")}),
            "write_scene_text": self._write,
            "draft": lambda message: self._call({"draft": message.get("draft")}),
        }

    def _state(self, *keys: str) -> dict[str, Any]:
        with self._lock:
            return {key: self._header.get(key) for key in keys}

    def _tree(self) -> dict[str, Any]:
        with self._lock:
            rows = [self._rows[handle] for handle in sorted(self._rows)]
            return {"tree": {"version": -1, **self._header, "since": None, "objects": rows, "gone": []}}

    def _call(self, request: _Message) -> dict[str, Any]:
        """Return the simulator's reply to `edit_scene`. Raises ValueError with its error."""
        try:
            response = rospy.ServiceProxy(f"{self._node}/edit_scene", AddDiagnostics)(json.dumps(request))
        except FAILURES as error:
            raise ValueError(f"the simulation does not answer: {error}") from None
        if not response.success:
            raise ValueError(response.message)
        reply: dict[str, Any] = json.loads(response.message)
        return reply

    def _open(self, message: _Message) -> dict[str, Any]:
        reply = self._call({"open": self._path(message)})
        self._recent.add(reply["file"])
        return reply

    def _save(self, message: _Message) -> dict[str, Any]:
        path: str | bool = self._path(message) if "file" in message else True  # true: to its own file
        if isinstance(path, str):
            is_own = message.get("over") is True or path == self._state("file")["file"]
            if Path(path).exists() and not is_own:
                raise ValueError(f"{message['file']} is there already")
        self._keep_flown_script()
        reply = self._call({"save": path})
        self._recent.add(reply["file"])
        return reply

    def _path(self, message: _Message) -> str:
        """Return the path of a file named by a browser: relative to the user's folder, with .yaml as default suffix."""
        name = message.get("file")
        if not isinstance(name, str) or not name.strip():
            raise ValueError("file: must be the name of a file")
        path = Path(name) if Path(name).suffix else Path(f"{name}.yaml")
        return str(path if path.is_absolute() else self._folder / path)

    def _write(self, message: _Message) -> dict[str, Any]:
        try:
            return self._call({"write": message.get("text"), "revision": message.get("revision")})
        except ValueError as error:
            match = _LINE.search(str(error))
            return {"error": str(error), "line": int(match[1]) if match else None}

    def _upload(self, message: _Message) -> dict[str, Any]:
        """Save an uploaded model in the user's folder; return the operation that adds it. Raises ValueError."""
        name = message.get("name")
        if not isinstance(name, str) or Path(name).name != name or Path(name).suffix.lower() not in _UPLOAD_SUFFIXES:
            raise ValueError(f"name: must end in {', '.join(_UPLOAD_SUFFIXES[:-1])} or {_UPLOAD_SUFFIXES[-1]}")
        try:
            content = base64.b64decode(str(message.get("content")), validate=True)
        except binascii.Error:
            raise ValueError("content: must be in base64") from None
        if len(content) > _MAX_SIZE:
            raise ValueError(f"{name}: is larger than {_MAX_SIZE >> 20} MiB")
        try:
            self.models.folder.mkdir(parents=True, exist_ok=True)
            writing.write_new(self.models.folder / name, content)
        except FileExistsError:
            raise ValueError(f"{name} is there already") from None
        except OSError as error:
            raise ValueError(str(error)) from None
        return {"model": self.models.operation(self.models.folder / name)}


def _difference(before: _Message, row: _Message) -> dict[str, Any]:
    """Return the changed keys of a row, None for those that are gone. In flight, these are the poses of what moves."""
    changed = {key: value for key, value in row.items() if key not in before or before[key] != value}
    return dict.fromkeys(before.keys() - row.keys()) | changed


def _name_in_scene(script: str) -> str:
    """Return the name of a script file that a scene on any machine may have: a built-in script's, or package://."""
    path = Path(script)
    if path.parent == BUILT_IN:
        return path.stem
    package = package_path()
    return f"package://drone_sim/{path.relative_to(package)}" if path.is_relative_to(package) else script
