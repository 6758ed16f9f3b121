"""Check of HTTP requests and WebSockets.

They need the token of the printed address, or come from the user's own proxy, which has checked them. WebSockets also
need the cockpit's own origin.
"""

from __future__ import annotations

import gzip
import hmac
import http
import logging
import os
import re
import socket
import struct
from collections.abc import Awaitable, Callable, Mapping
from functools import lru_cache
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

import rospy
from websockets import Headers
from websockets.asyncio.server import Server, ServerConnection, serve, unix_serve
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from drone_sim.ros.cockpit.server.return_pass import ReturnPass, is_local

SUBPROTOCOL = "drone_sim"  # of the page's WebSocket
_MAX_MESSAGE = 8 << 20  # bytes of a message from a browser: a script of at most 1 MiB, escaped as JSON
_REFUSED = "To open the cockpit, use the whole address that the simulation printed. It ends in ?token=..."
_NOT_THE_PROXY = "Only a proxy of the same user may use this socket."
_CREDENTIALS = struct.Struct("3i")  # of a UNIX socket's peer: process, user and group
_SECURITY_HEADERS = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Cache-Control": "no-store",
    "Connection": "close",  # the server closes the connection after every response, so no browser may reuse it
}
# The page may load only what this server sends. Textures of meshes are blobs.
_POLICY = (
    "default-src 'none'; script-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self' blob: {sockets}; "
    "frame-ancestors 'self'; base-uri 'none'; form-action {forms}"
)
RETURN = "/return"  # the path at which a tab of an earlier cockpit gets a challenge, and sends its signature
MANUAL = "/manual/"  # the path of the manual, whose search is an HTML form
_UNIQUE_HEADERS = ("Host", "Cookie", "Origin", "Upgrade", "Accept-Encoding")  # all headers that are read here
_HOST = re.compile(r"[\w.:\[\]-]+", re.ASCII)

Handler = Callable[[ServerConnection], Awaitable[None]]
Content = tuple[str, bytes] | None  # content type and body of a page; None if there is no such page
_COMPRESSED_TYPES = ("text/", "model/")
# The codes with which the server closes the WebSocket of a browser that violates the protocol.
_VIOLATIONS = (CloseCode.PROTOCOL_ERROR, CloseCode.INVALID_DATA, CloseCode.MESSAGE_TOO_BIG)


class AccessControl:
    """Server of the page and its WebSocket that accepts only requests with the token, or of the user's own proxy."""

    def __init__(self, token: str, page: Callable[[str], Content], socket: Handler):
        """Accept clients that have `token`; `page` returns a page by its path, `socket` serves a WebSocket."""
        self._token = token
        self._is_behind_proxy = False
        self.return_pass: ReturnPass | None = None  # for the tabs of an earlier cockpit; None accepts none
        self._page = page
        self._socket = socket

    async def serve(self, host: str, port: int) -> Server:
        """Listen at a numeric address, in the running event loop; port 0 is any free port. Raises OSError."""
        return await serve(self._socket, host, port, **self._options())

    async def serve_proxy(self, path: str) -> Server:
        """Listen at a UNIX socket for a proxy of the same user, whose requests need no token. Raises OSError."""
        self._is_behind_proxy = True
        return await unix_serve(self._socket, path, **self._options())

    def _options(self) -> dict[str, Any]:
        log = logging.Logger("cockpit", logging.ERROR)
        log.addHandler(_OneLineHandler())
        return {
            "process_request": self._answer,
            "subprotocols": [SUBPROTOCOL],
            "compression": None,  # messages stay on this machine, or SSH can compress them
            "max_size": _MAX_MESSAGE,
            "create_connection": _CheckedConnection,
            "logger": log,
        }

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response to a request; None accepts a WebSocket."""
        try:
            host = _checked_host(request.headers)
            return self._refuse(connection, request) or self._response_to(request, host)
        except ValueError as error:
            return _response(http.HTTPStatus.BAD_REQUEST, str(error))

    def _refuse(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response to a client that is not let in, or gets a cookie first; None lets it in."""
        if self._is_behind_proxy:
            return None if _is_of_this_user(connection) else _response(http.HTTPStatus.FORBIDDEN, _NOT_THE_PROXY)
        path, _, query = request.path.partition("?")
        if not _is_socket(request):
            if path == "/" and self._is_token(parse_qs(query).get("token", [""])[0]):
                response = _response(http.HTTPStatus.SEE_OTHER, "")
                # An address without the token, which people can safely share; relative, because a proxy may serve the
                # page below a prefix.
                response.headers["Location"] = "./"
                self._set_cookie(request, response)
                return response
            if path == RETURN and self.return_pass is not None and is_local(connection):
                return self._accept_return(self.return_pass, parse_qs(query), request)
        is_known = self._is_token(_cookie(request, self._name_of_cookie(request)))
        return None if is_known else _response(http.HTTPStatus.FORBIDDEN, _REFUSED)

    def _response_to(self, request: Request, host: str) -> Response | None:
        """Return the response to a client that is let in."""
        if _is_socket(request):
            return None if _is_of_our_page(request) else _response(http.HTTPStatus.FORBIDDEN, "of another origin")
        path = request.path.partition("?")[0]
        found = self._page(path)
        if found is None:
            return _response(http.HTTPStatus.NOT_FOUND, "There is no such page.")
        kind, content = found
        encodings = {item.partition(";")[0].strip() for item in request.headers.get("Accept-Encoding", "").split(",")}
        is_compressed = "gzip" in encodings and kind.startswith(_COMPRESSED_TYPES)
        forms = "'self'" if path.startswith(MANUAL) else "'none'"
        response = _response(http.HTTPStatus.OK, _compress(content) if is_compressed else content, kind, host, forms)
        if is_compressed:
            response.headers["Content-Encoding"] = "gzip"
        return response

    def _accept_return(self, return_pass: ReturnPass, query: Mapping[str, list[str]], request: Request) -> Response:
        """Return a challenge to a tab of an earlier cockpit; if the tab has signed one, set the token as a cookie."""
        if "signature" not in query:
            return _response(http.HTTPStatus.OK, return_pass.challenge())
        if not return_pass.is_signed(query.get("challenge", [""])[0], query["signature"][0]):
            return _response(http.HTTPStatus.FORBIDDEN, _REFUSED)
        response = _response(http.HTTPStatus.OK, "")
        self._set_cookie(request, response)
        return response

    def _set_cookie(self, request: Request, response: Response) -> None:
        # Without a path, browsers keep the cookie for the page's folder, which also is a proxy's prefix.
        cookie = f"{self._name_of_cookie(request)}={self._token}; HttpOnly; SameSite=Strict"
        response.headers["Set-Cookie"] = cookie

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(errors="backslashreplace"), self._token.encode())

    @staticmethod
    def _name_of_cookie(request: Request) -> str:
        """Return the cookie's name, with the port: browsers send a host's cookies to all of its ports."""
        return f"drone_sim_{request.headers.get('Host', '').rpartition(':')[2]}"


def _checked_host(headers: Headers) -> str:
    """Return the Host header, '' without one. Raises ValueError if it is invalid, or a header is repeated."""
    for name in _UNIQUE_HEADERS:
        if len(headers.get_all(name)) > 1:
            raise ValueError(f"{name}: must not be given twice")
    host = headers.get("Host", "")
    if host and not _HOST.fullmatch(host):
        raise ValueError("Host: must be a name or an address, and a port")
    return host


def _is_of_this_user(connection: ServerConnection) -> bool:
    """Return whether the client of a UNIX socket is a process of this process's user."""
    peer = connection.transport.get_extra_info("socket")
    _, user, _ = _CREDENTIALS.unpack(peer.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size))
    return bool(user == os.getuid())


def _is_socket(request: Request) -> bool:
    return str(request.headers.get("Upgrade", "")).lower() == "websocket"


def _is_of_our_page(request: Request) -> bool:
    """Return whether a WebSocket is opened by the cockpit's page, or by a program that sends no origin (no browser)."""
    origin, host = request.headers.get("Origin"), request.headers.get("Host", "")
    return origin is None or origin in (f"http://{host}", f"https://{host}")


def _cookie(request: Request, name: str) -> str:
    try:
        found = SimpleCookie(request.headers.get("Cookie", "")).get(name)
    except CookieError:
        return ""
    return found.value if found is not None else ""


@lru_cache(maxsize=64)
def _compress(content: bytes) -> bytes:
    return gzip.compress(content, 6, mtime=0)


def _response(
    status: http.HTTPStatus,
    content: str | bytes,
    kind: str = "text/plain; charset=utf-8",
    host: str = "",
    forms: str = "'none'",
) -> Response:
    """Return a response whose headers keep a browser from using it in another page or for another purpose."""
    body = content if isinstance(content, bytes) else content.encode()
    # In older browsers, 'self' does not include WebSockets.
    policy = _POLICY.format(sockets=f"ws://{host} wss://{host}" if host else "", forms=forms)
    headers = {
        "Content-Type": kind,
        "Content-Length": str(len(body)),
        **_SECURITY_HEADERS,
        "Content-Security-Policy": policy,
    }
    return Response(status.value, status.phrase, Headers(headers), body)


class _CheckedConnection(ServerConnection):
    """WebSocket of a browser. If the browser violates the protocol, it is disconnected, with one warning."""

    async def recv(self, decode: bool | None = None) -> Any:
        try:
            return await super().recv(decode)
        except ConnectionClosedError as error:
            if error.sent is not None and error.sent.code in _VIOLATIONS and not error.rcvd_then_sent:
                where = self.remote_address[0] if self.remote_address else "the proxy"
                rospy.logwarn(f"a browser at {where} is refused: {error.sent.reason}")
            raise


class _OneLineHandler(logging.Handler):
    """Logs errors of an open WebSocket in one line, without a traceback."""

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        if record.getMessage() == "opening handshake failed":  # a client that is no browser, such as a port scanner
            return
        line = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}" if error else record.getMessage()
        rospy.logwarn(f"a browser's socket: {line}")
