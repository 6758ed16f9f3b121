"""The server: the page at once, and socket and scene once there is something to show."""

from __future__ import annotations

import asyncio
import contextlib
import io
import secrets
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import viser
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer
from websockets.asyncio.server import ServerConnection

from drone_sim.ros.cockpit.server.access_control import AccessControl, Content, Handler
from drone_sim.ros.cockpit.server.address import free_place, urls

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return content type and content of the page around the scene, as `web/` builds it, by the path that is asked."""
    files = [file for file in (Path(__file__).parents[1] / "page").iterdir() if file.suffix in _KINDS]
    found = {f"/{file.name}": (_KINDS[file.suffix], file.read_bytes()) for file in files}
    return {**found, "/": found["/index.html"]}


class PageServer:
    """The server with page, socket and scene, which are empty until `begin`."""

    def __init__(self, address: Any, port: Any):
        """Listen at `address`, at `port` or the next one that is free. Raises AddressError where nothing can."""
        self._begun: Future[tuple[Handler, Callable[[str], Content]]] = Future()
        self._files, token = page_files(), secrets.token_urlsafe(16)
        access = AccessControl(token, self._find, self._talk)
        host, port = free_place(address, port)
        leave_to_the_loop()
        with access.before_viser(), contextlib.redirect_stdout(io.StringIO()):  # viser prints an address without token
            self.server = viser.ViserServer(host=host, port=port, label="drone_sim", verbose=False)
        self.port = self.server.get_port()
        self.address, self.address_elsewhere = urls(host, self.port, token)

    @property
    def addresses(self) -> str:
        """Where it is, for the user, with the token."""
        elsewhere = self.address_elsewhere
        return self.address + (f" and, on other machines, at {elsewhere}" if elsewhere else "")

    def begin(self, socket: Handler, beside: Callable[[str], Content]) -> None:
        """Let `socket` serve the browsers that are there, and those that come; `beside` finds pictures of the page."""
        self._begun.set_result((socket, beside))

    def _find(self, path: str) -> Content:
        return self._files.get(path) or (self._begun.result()[1](path) if self._begun.done() else None)

    async def _talk(self, connection: ServerConnection) -> None:
        socket, _ = await asyncio.shield(asyncio.wrap_future(self._begun))  # others wait for it, too
        await socket(connection)


# ---- what wakes viser's senders: an event of its event loop, which viser also sets from other threads


class _OfTheLoop(asyncio.Event):
    """An event that other threads than its loop's cannot set.

    asyncio.Event goes through those who wait for it, who come and go meanwhile: a thread that draws would end with
    "deque mutated during iteration". viser has the loop itself set the event after every such call.
    """

    def set(self) -> None:
        """Wake those who wait, in the event loop; do nothing in another thread."""
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return
        super().set()


class _MessageBuffer(AsyncMessageBuffer):
    """What is to be sent to browsers."""

    def __init__(self, *args: Any, **options: Any):
        """Take what viser gives."""
        super().__init__(*args, **options)
        self.message_event = _OfTheLoop()


def leave_to_the_loop() -> None:
    """Let no thread but the event loop wake the senders of any viser server of this process."""
    _infra.AsyncMessageBuffer = _MessageBuffer  # type: ignore[misc]
