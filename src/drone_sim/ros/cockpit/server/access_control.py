"""Access to the cockpit: only with the token in the printed address, and not from pages of another origin."""

from __future__ import annotations

import gzip
import hmac
import http
import logging
import re
from collections.abc import Awaitable, Callable, Mapping
from functools import lru_cache
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

import rospy
from websockets import Headers
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from drone_sim.ros.cockpit.server.return_pass import ReturnPass, is_local

SUBPROTOCOL = "drone_sim"  # of our own socket
_LARGEST = 8 << 20  # bytes of a message from a browser: a script, with all that JSON makes longer
_REFUSED = "To open the cockpit, use the whole address that the simulation printed. It ends in ?token=..."
_SAFE = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Cache-Control": "no-store",
    "Connection": "close",  # after every answer; a browser would send the next request into it
}
# What our page may load and do: what comes from here, and nothing else. Textures of meshes are blobs.
_POLICY = (
    "default-src 'none'; script-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self' blob: {sockets}; "
    "frame-ancestors 'self'; base-uri 'none'; form-action {forms}"
)
RETURN = "/return"  # where a tab of an earlier cockpit asks for a challenge, and answers it
MANUAL = "/manual/"  # whose search is a form
_ONCE = ("Host", "Cookie", "Origin", "Upgrade", "Accept-Encoding")  # of what is read here
_HOST = re.compile(r"[\w.:\[\]-]+", re.ASCII)

Handler = Callable[[ServerConnection], Awaitable[None]]
Content = tuple[str, bytes] | None  # its type, and itself; None for what is not there
_PACKED = ("text/", "model/")  # what is worth being compressed
_BROKEN = (CloseCode.PROTOCOL_ERROR, CloseCode.INVALID_DATA, CloseCode.MESSAGE_TOO_BIG)


class AccessControl:
    """The check in front of the page and its socket: only requests with the token get in."""

    def __init__(self, token: str, page: Callable[[str], Content], socket: Handler):
        """Let in clients that have `token`; `page` finds a page by its path, `socket` serves sockets."""
        self._token = token
        self.return_pass: ReturnPass | None = None  # checks the tabs of an earlier cockpit; None lets none of them in
        self._page = page
        self._socket = socket

    async def serve(self, host: str, port: int) -> Server:
        """Listen at a numeric address, in the event loop that runs; port 0 is any. Raises OSError."""
        log = logging.Logger("cockpit", logging.ERROR)
        log.addHandler(_OneLineHandler())
        return await serve(
            self._socket,
            host,
            port,
            process_request=self._answer,
            subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
            compression=None,  # what is sent is for this machine, or goes through ssh
            max_size=_LARGEST,
            create_connection=_CheckedConnection,
            logger=log,
        )

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the answer to a request; None lets a socket be opened."""
        try:
            return self._answered(request, is_local(connection))
        except ValueError as error:
            return _response(http.HTTPStatus.BAD_REQUEST, str(error))

    def _answered(self, request: Request, may_return: bool) -> Response | None:
        host = _checked_host(request.headers)
        path, _, query = request.path.partition("?")
        if self._is_token(parse_qs(query).get("token", [""])[0]) and not _is_socket(request):
            return self._let_in(request)
        if path == RETURN and may_return and self.return_pass is not None and not _is_socket(request):
            return self._let_return(self.return_pass, parse_qs(query), request)
        if not self._is_token(_cookie(request, self._name_of_cookie(request))):
            return _response(http.HTTPStatus.FORBIDDEN, _REFUSED)
        if _is_socket(request):
            return None if _is_of_our_page(request) else _response(http.HTTPStatus.FORBIDDEN, "of another origin")
        found = self._page(path)
        if found is None:
            return _response(http.HTTPStatus.NOT_FOUND, "There is no such page.")
        return _page(*found, host, _takes_gzip(request), "'self'" if path.startswith(MANUAL) else "'none'")

    def _let_in(self, request: Request) -> Response:
        """Remember the token in a cookie, and take it out of the address, which people send to each other."""
        response = _response(http.HTTPStatus.SEE_OTHER, "")
        response.headers["Location"] = "/"
        self._remember(request, response)
        return response

    def _let_return(self, return_pass: ReturnPass, query: Mapping[str, list[str]], request: Request) -> Response:
        """Give a challenge to a tab of an earlier cockpit; if it has signed one, remember the token in a cookie."""
        if "signature" not in query:
            return _response(http.HTTPStatus.OK, return_pass.challenge())
        if not return_pass.is_signed(query.get("challenge", [""])[0], query["signature"][0]):
            return _response(http.HTTPStatus.FORBIDDEN, _REFUSED)
        response = _response(http.HTTPStatus.OK, "")
        self._remember(request, response)
        return response

    def _remember(self, request: Request, response: Response) -> None:
        cookie = f"{self._name_of_cookie(request)}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        response.headers["Set-Cookie"] = cookie

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(errors="backslashreplace"), self._token.encode())

    @staticmethod
    def _name_of_cookie(request: Request) -> str:
        """Return a name of its own for every port: browsers keep cookies by host alone."""
        return f"drone_sim_{request.headers.get('Host', '').rpartition(':')[2]}"


def _checked_host(headers: Headers) -> str:
    """Return the host that a browser asks for. Raises ValueError if that is wrong, or a header is repeated."""
    for name in _ONCE:
        if len(headers.get_all(name)) > 1:
            raise ValueError(f"{name}: must not be given twice")
    host = headers.get("Host", "")
    if host and not _HOST.fullmatch(host):
        raise ValueError("Host: must be a name or an address, and a port")
    return host


def _is_socket(request: Request) -> bool:
    return str(request.headers.get("Upgrade", "")).lower() == "websocket"


def _is_of_our_page(request: Request) -> bool:
    """Tell whether a socket is opened by our own page, or by a program other than a browser, which sends no origin."""
    origin, host = request.headers.get("Origin"), request.headers.get("Host", "")
    return origin is None or origin in (f"http://{host}", f"https://{host}")


def _cookie(request: Request, name: str) -> str:
    try:
        found = SimpleCookie(request.headers.get("Cookie", "")).get(name)
    except CookieError:
        return ""
    return found.value if found is not None else ""


def _takes_gzip(request: Request) -> bool:
    return "gzip" in (one.partition(";")[0].strip() for one in request.headers.get("Accept-Encoding", "").split(","))


def _page(kind: str, content: bytes, host: str, takes_gzip: bool, forms: str) -> Response:
    is_packed = takes_gzip and kind.startswith(_PACKED)
    response = _response(http.HTTPStatus.OK, _packed(content) if is_packed else content, kind, host, forms)
    if is_packed:
        response.headers["Content-Encoding"] = "gzip"
    return response


@lru_cache(maxsize=64)
def _packed(content: bytes) -> bytes:
    return gzip.compress(content, 6, mtime=0)


def _response(
    status: http.HTTPStatus,
    content: str | bytes,
    kind: str = "text/plain; charset=utf-8",
    host: str = "",
    forms: str = "'none'",
) -> Response:
    """Return an answer with headers that keep a browser from using it in any other way."""
    body = content if isinstance(content, bytes) else content.encode()
    # Older browsers take 'self' for our pages alone, not for our sockets.
    policy = _POLICY.format(sockets=f"ws://{host} wss://{host}" if host else "", forms=forms)
    headers = {"Content-Type": kind, "Content-Length": str(len(body)), **_SAFE, "Content-Security-Policy": policy}
    return Response(status.value, status.phrase, Headers(headers), body)


class _CheckedConnection(ServerConnection):
    """A browser's socket. A browser that breaks its rules is disconnected, and the user gets one line about it."""

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message, as `ServerConnection` does."""
        try:
            return await super().recv(decode)
        except ConnectionClosedError as error:
            if error.sent is not None and error.sent.code in _BROKEN and not error.rcvd_then_sent:
                self._say(error.sent.reason)
            raise

    def _say(self, what: str) -> None:
        rospy.logwarn(f"a browser at {self.remote_address[0]} is refused: {what}")


class _OneLineHandler(logging.Handler):
    """Tells in one line, without a traceback, what goes wrong with a socket that is open."""

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        if record.getMessage() != "opening handshake failed":  # by whoever is no browser; there is nobody to tell
            rospy.logwarn(f"a browser's socket: {_one_line(error) if error else record.getMessage()}")


def _one_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
