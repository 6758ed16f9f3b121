"""The server: the page at once, and its socket once there is something to show."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import threading
from collections.abc import Callable
from concurrent import futures
from pathlib import Path
from typing import Any

from websockets.asyncio.server import Server, ServerConnection
from websockets.exceptions import ConnectionClosed

from drone_sim.ros.cockpit.server.access_control import AccessControl, Content, Handler
from drone_sim.ros.cockpit.server.address import free_place, urls
from drone_sim.ros.cockpit.server.return_pass import is_local, new_pass

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_PATIENCE = 5.0  # s, in which the server ends


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return content type and content of the page, as `web/` builds it, by the path that is asked."""
    files = [file for file in (Path(__file__).parents[1] / "page").iterdir() if file.suffix in _KINDS]
    found = {f"/{file.name}": (_KINDS[file.suffix], file.read_bytes()) for file in files}
    return {**found, "/": found["/index.html"]}


class PageServer:
    """The server with page and socket, in a thread of its own. The socket waits until `begin`."""

    def __init__(self, address: Any, port: Any):
        """Listen at `address`, at `port` or the next one that is free. Raises AddressError where nothing can."""
        self._begun: futures.Future[tuple[Handler, Callable[[str], Content]]] = futures.Future()
        self._files, token = page_files(), secrets.token_urlsafe(16)
        host, wanted = free_place(address, port)
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, name="page server", daemon=True).start()
        self._access = AccessControl(token, self._find, self._talk)
        self._server = asyncio.run_coroutine_threadsafe(self._listen(host, wanted), self._loop).result()
        self.port = int(next(iter(self._server.sockets)).getsockname()[1])
        self.address, self.address_elsewhere = urls(host, self.port, token)

    @property
    def addresses(self) -> str:
        """Where it is, for the user, with the token."""
        elsewhere = self.address_elsewhere
        return self.address + (f" and, on other machines, at {elsewhere}" if elsewhere else "")

    def begin(self, socket: Handler, beside: Callable[[str], Content]) -> None:
        """Let `socket` serve the browsers that are there, and those that come; `beside` finds what the page shows."""
        self._begun.set_result((socket, beside))

    def stop(self) -> None:
        """Close all sockets, and listen no more."""
        self._server.close()
        closing = asyncio.run_coroutine_threadsafe(self._server.wait_closed(), self._loop)
        try:
            closing.result(_PATIENCE)
        except futures.TimeoutError:
            closing.cancel()
        self._loop.call_soon_threadsafe(self._loop.stop)

    async def _listen(self, host: str, port: int) -> Server:
        """Bind the port, then replace its key: a cockpit that cannot bind it must not revoke the key of another one."""
        server = await self._access.serve(host, port)
        if port:  # a number that the system has chosen is another one at the next start
            self._access.return_pass = new_pass(port)
        return server

    def _find(self, path: str) -> Content:
        return self._files.get(path) or (self._begun.result()[1](path) if self._begun.done() else None)

    async def _talk(self, connection: ServerConnection) -> None:
        return_pass = self._access.return_pass
        if return_pass is not None and is_local(connection):
            with contextlib.suppress(ConnectionClosed):
                await connection.send(json.dumps({"pass": return_pass.key}))
        socket, _ = await asyncio.shield(asyncio.wrap_future(self._begun))  # others wait for it, too
        await socket(connection)
