"""Web server of the cockpit: it serves page and manual at once, and WebSockets after `begin`."""

from __future__ import annotations

import asyncio
import contextlib
import json
import mimetypes
import secrets
import threading
from collections.abc import Callable
from concurrent import futures
from pathlib import Path
from typing import Any

from websockets.asyncio.server import Server, ServerConnection
from websockets.exceptions import ConnectionClosed

from drone_sim.files.resources import MEBIBYTE, package_path, read_bytes
from drone_sim.ros.cockpit.server.access_control import MANUAL, AccessControl, Content, Handler
from drone_sim.ros.cockpit.server.address import AddressError, free_place, urls
from drone_sim.ros.cockpit.server.return_pass import is_local, new_pass

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_CLOSE_TIMEOUT = 5.0  # s, for the server to close its connections
_MAX_SIZE = 16 * MEBIBYTE  # bytes of a file of the manual, or of a report
_NOT_BUILT = "The manual has not been built. In a checkout, `./dev.sh docs` builds it."


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return content type and content of the files that `web/` builds, by their URL path."""
    files = [file for file in (Path(__file__).parents[1] / "page").iterdir() if file.suffix in _KINDS]
    found = {f"/{file.name}": (_KINDS[file.suffix], file.read_bytes()) for file in files}
    return {**found, "/": found["/index.html"]}


def find_manual(path: str, folder: Path | None = None) -> Content:
    """Return a file of the manual by its URL path; None if there is none. `folder` is where `./dev.sh docs` builds it.

    Thread-safe.
    """
    folder = folder or package_path() / "docs/html"
    if not path.startswith(MANUAL):
        return None
    if not folder.is_dir():
        return "text/plain; charset=utf-8", _NOT_BUILT.encode()
    return find_below(folder, path.removeprefix(MANUAL))


def find_below(folder: Path, name: str) -> Content:
    """Return content type and content of the file `name` in a folder; None if there is none, or it is outside."""
    try:
        file = (folder / name).resolve()
        if not file.is_relative_to(folder.resolve()):
            return None
        kind = mimetypes.guess_type(file.name)[0] or "text/plain"
        return f"{kind}; charset=utf-8" if kind.startswith("text/") else kind, read_bytes(file, _MAX_SIZE)
    except (OSError, ValueError):  # ValueError: a NUL in the name
        return None


class PageServer:
    """Web server in a thread of its own. WebSockets wait until `begin` is called."""

    def __init__(self, address: Any, port: Any, socket: str = ""):
        """Listen at `address`, at `port` or the next free one, or only at the UNIX socket of a proxy.

        Raises AddressError if that is impossible.
        """
        self._handlers: futures.Future[tuple[Handler, Callable[[str], Content]]] = futures.Future()  # set by `begin`
        self._files, token = page_files(), secrets.token_urlsafe(16)
        host, wanted = free_place(address, port) if not socket else ("", 0)
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, name="page server", daemon=True).start()
        self._access = AccessControl(token, self._find, self._serve_socket)
        self._server = asyncio.run_coroutine_threadsafe(self._listen(host, wanted, socket), self._loop).result()
        self.port, self.address, self.address_elsewhere = 0, "", ""
        if not socket:
            self.port = int(next(iter(self._server.sockets)).getsockname()[1])
            self.address, self.address_elsewhere = urls(host, self.port, token)

    @property
    def addresses(self) -> str:
        """The cockpit's URLs with the token, in words."""
        elsewhere = self.address_elsewhere
        return self.address + (f" and, on other machines, at {elsewhere}" if elsewhere else "")

    def begin(self, socket: Handler, find: Callable[[str], Content]) -> None:
        """Serve waiting and new WebSockets with `socket`; `find` returns other files by their path."""
        self._handlers.set_result((socket, find))

    def stop(self) -> None:
        self._server.close()
        closing = asyncio.run_coroutine_threadsafe(self._server.wait_closed(), self._loop)
        try:
            closing.result(_CLOSE_TIMEOUT)
        except futures.TimeoutError:
            closing.cancel()
        self._loop.call_soon_threadsafe(self._loop.stop)

    async def _listen(self, host: str, port: int, socket: str) -> Server:
        if socket:
            try:
                return await self._access.serve_proxy(socket)
            except OSError as error:
                raise AddressError(f"socket = {socket[:200]}: {error.strerror or error}") from None
        # The key is replaced once the port is bound: a cockpit that cannot bind it must not revoke another one's key.
        server = await self._access.serve(host, port)
        if port:  # with port 0, the next start has another port, so no tab could return
            self._access.return_pass = new_pass(port)
        return server

    def _find(self, path: str) -> Content:
        return self._files.get(path) or (self._handlers.result()[1](path) if self._handlers.done() else None)

    async def _serve_socket(self, connection: ServerConnection) -> None:
        return_pass = self._access.return_pass
        if return_pass is not None and is_local(connection):
            with contextlib.suppress(ConnectionClosed):
                await connection.send(json.dumps({"pass": return_pass.key}))
        socket, _ = await asyncio.shield(asyncio.wrap_future(self._handlers))  # other connections await it, too
        await socket(connection)
