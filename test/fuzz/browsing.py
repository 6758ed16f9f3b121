"""The cockpit's server without a ROS master, and browsers that send it odd requests and messages."""

from __future__ import annotations

import json
import logging
import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import commands  # noqa: F401 - it replaces rospy's publishers and subscribers
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))
from cockpit_asked import Asked

from drone_sim.ros.cockpit.editor.lists import SceneList
from drone_sim.ros.cockpit.editor.script_store import ScriptStore
from drone_sim.ros.cockpit.panel.cameras import CameraSwitches, ScriptWindows
from drone_sim.ros.cockpit.panel.panel import Panel
from drone_sim.ros.cockpit.scene.meshes import MeshStore
from drone_sim.ros.cockpit.scene.scene_state import SceneState
from drone_sim.ros.cockpit.scene.scene_view import SceneView
from drone_sim.ros.cockpit.server.access_control import SUBPROTOCOL
from drone_sim.ros.cockpit.server.page_server import PageServer
from drone_sim.ros.cockpit.server.page_socket import PageSocket
from drone_sim.ros.cockpit.teleop import CommandPublisher, HeldCommands
from drone_sim.ros.cockpit.topics import FoundTopics, ImageTopic

_PATIENCE = 60.0  # s
_LAST = 424242  # the id of a request that is sent after all others

Data = tuple[list[bytes], list[bytes]]


class Wrong(Exception):
    """A browser got a wrong answer, or none."""


class Cockpit:
    """One server for all cases: starting it takes longer than most cases."""

    def __init__(self) -> None:
        """Start to serve."""
        self._answers: dict[str, Any] = {}
        view = SceneView(SceneState(), MeshStore(), "/drone")
        handlers = {"drag": view.drag, "push": lambda _browser, message: view.push(message)}
        self.socket = PageSocket(HeldCommands(lambda _: None), self._answers, handlers)
        self._server = PageServer("127.0.0.1", 0)
        self._server.begin(self.socket.serve, lambda _path: None)
        self._port = self._server.port
        self._token = self._server.address.partition("?token=")[2]

    def hear(self, data: Data, folder: Path) -> Iterator[str]:
        """Let browsers send the requests and messages; yield the lines that they and the log get. Raises Wrong."""
        self._reset(folder)
        lines: list[str] = []
        log = logging.Handler()
        log.emit = lambda record: lines.append(record.getMessage())  # type: ignore[method-assign]
        logging.getLogger("rosout").addHandler(log)
        try:
            requests, messages = data
            for one in requests:
                self._request(one)
            lines += self._ask(messages)
        finally:
            logging.getLogger("rosout").removeHandler(log)
        yield from lines

    def _reset(self, folder: Path) -> None:
        os.environ["HOME"] = str(folder)  # scenes of tasks are created there
        own = folder / "scripts"
        own.mkdir()
        (own / "a.py").write_text("# a script\n", encoding="utf-8")
        (own / "link.py").symlink_to(folder / "outside.py")
        os.mkfifo(own / "fifo.py")
        (own / "d.py").mkdir()
        self._outside = folder / "outside.py"
        editor = Asked(ScriptStore(own))
        panel = Panel(editor.node, CommandPublisher(patience=0.0), SceneList(own), self.socket.tell)  # type: ignore[arg-type]
        panel.offer(FoundTopics("/drone", ("drone", "wing"), (), {"/drone/range": "sensor_msgs/Range"}), "")
        panel.follow("drone")
        cameras = CameraSwitches(panel.board, self.socket)
        cameras.offer((ImageTopic("/drone/front"),), ("drone", "wing"))
        windows = ScriptWindows("/drone_sim", cameras, self.socket)
        windows.listen(True)
        self._answers.update({**editor.answers, **panel.answers, **windows.answers})

    def _fill_in(self, content: bytes) -> bytes:
        replacements = {b"PORT": str(self._port), b"TOKEN": self._token}
        for word, value in replacements.items():
            content = content.replace(word, value.encode())
        return content

    def _request(self, content: bytes) -> None:
        with socket.create_connection(("127.0.0.1", self._port), timeout=_PATIENCE) as one:
            try:
                one.sendall(self._fill_in(content))
                one.shutdown(socket.SHUT_WR)
                reply = b"".join(iter(lambda: one.recv(1 << 16), b""))
            except ConnectionError:
                return
        if b" 500 " in reply[:20] or b"Traceback" in reply:
            raise Wrong(f"a request gets {reply[:200]!r}")

    def _open(self) -> Any:
        cookie = {"Cookie": f"drone_sim_{self._port}={self._token}"}
        address = f"ws://127.0.0.1:{self._port}/"
        return connect(address, subprotocols=[SUBPROTOCOL], additional_headers=cookie)  # type: ignore[list-item]

    def _ask(self, messages: list[bytes]) -> Iterator[str]:
        try:
            with self._open() as page:
                for one in messages:
                    page.send(one.decode("utf-8", "replace"))
                page.send(json.dumps({"id": _LAST, "ask": "look"}))
                answer: dict[str, Any] = {}
                while answer.get("id") != _LAST:
                    answer = json.loads(page.recv(timeout=_PATIENCE), parse_constant=_no_json)
                    if "error" in answer:
                        yield str(answer["error"])
        except ConnectionClosed as error:
            raise Wrong(f"the page's socket is closed: {error}") from None
        except TimeoutError:
            raise Wrong("the page gets no answer") from None
        if self._outside.exists():
            raise Wrong("something was written out of the folder")


def _no_json(text: str) -> float:
    raise Wrong(f"the page gets {text}, which is no JSON")
