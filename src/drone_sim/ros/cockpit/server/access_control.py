"""Who comes in: whoever has the token that the printed address holds, and no page of another origin."""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import http
import logging
import re
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import replace
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

import msgspec
import rospy
from websockets import Headers
from websockets.asyncio import server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

SUBPROTOCOL = "drone_sim"  # of our own socket
_VISER = "viser-v"  # what viser's subprotocols begin with
_SCENE = "/scene/"  # where viser's page is
_LARGEST = 8 << 20  # bytes of a message from a browser: a script, with all that JSON makes longer
_REFUSED = "The cockpit opens with the address that the simulation has printed: it ends in ?token=..."
_SAFE = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Cache-Control": "no-store",
    "Connection": "close",  # after every answer; a browser would send the next request into it
}
# What our page, and viser's in its frame, may load and do: what comes from here, and nothing else.
_POLICY = (
    "default-src 'none'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "frame-ancestors 'self'; base-uri 'none'; form-action 'none'; "
)
_OF_OUR_PAGE = "script-src 'self'; frame-src 'self'; connect-src 'self' {sockets}"
# viser's page is one file, which unpacks its script with WebAssembly, and makes scripts and workers of text.
_OF_THE_SCENE = (
    "script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; worker-src blob:; font-src 'self' data:; "
    "connect-src 'self' {sockets} blob: data:"
)
_ONCE = ("Host", "Cookie", "Origin", "Upgrade", "Accept-Encoding")  # of what is read here, and in viser
_HOST = re.compile(r"[\w.:\[\]-]+", re.ASCII)

Handler = Callable[[ServerConnection], Awaitable[None]]
Content = tuple[str, bytes] | None  # its type, and itself; None for what is not there
# What viser would do for anybody who asks: lay a tunnel from a public server to this port; keep files in memory.
_NOT_FOR_THIS_PAGE = frozenset({"ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload", "FileTransferPart"})
_BROKEN = (CloseCode.PROTOCOL_ERROR, CloseCode.INVALID_DATA, CloseCode.MESSAGE_TOO_BIG)


class AccessControl:
    """What stands before viser's server: its port serves our page and socket, too, to who has the token."""

    def __init__(self, token: str, page: Callable[[str], Content], socket: Handler):
        """Let in whoever has `token`; `page` finds what is asked for by its path, `socket` serves our `SUBPROTOCOL`."""
        self._token = token
        self._page = page
        self._socket = socket

    @contextlib.contextmanager
    def before_viser(self) -> Iterator[None]:
        """Put the gate before a viser server that is made inside.

        viser has no place for it; it calls `websockets.asyncio.server.serve` by its full name.
        """
        serve = websocket_server.serve
        websocket_server.serve = self._serve_with(serve)  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            websocket_server.serve = serve  # type: ignore[misc]

    def _serve_with(self, serve: Callable[..., Any]) -> Callable[..., Any]:
        def guarded(scene: Handler, host: str, port: int, **options: Any) -> Any:
            asyncio.get_running_loop().set_exception_handler(_log_message_error)
            log = logging.Logger("cockpit", logging.ERROR)
            log.addHandler(_OneLineHandler())
            scene_page, choose = options.pop("process_request"), options.pop("select_subprotocol")
            return serve(
                lambda connection: (self._socket if connection.subprotocol == SUBPROTOCOL else scene)(connection),
                host,
                port,
                process_request=lambda connection, request: self._answer(connection, request, scene_page),
                select_subprotocol=lambda connection, offers: (
                    SUBPROTOCOL if SUBPROTOCOL in offers else choose(connection, offers)
                ),
                **{**options, "max_size": _LARGEST},
                create_connection=_CheckedConnection,
                logger=log,
            )

        return guarded

    def _answer(self, connection: ServerConnection, request: Request, scene_page: Callable[..., Any]) -> Any:
        """Return the answer to a request; None lets a socket be opened."""
        try:
            return self._answered(connection, request, scene_page)
        except ValueError as error:
            return _response(http.HTTPStatus.BAD_REQUEST, str(error))

    def _answered(self, connection: ServerConnection, request: Request, scene_page: Callable[..., Any]) -> Any:
        host = _checked_host(request.headers)
        path, _, query = request.path.partition("?")
        if self._is_token(parse_qs(query).get("token", [""])[0]) and not _is_socket(request):
            return self._let_in(request)
        if not self._is_token(_cookie(request, self._name_of_cookie(request))):
            return _response(http.HTTPStatus.FORBIDDEN, _REFUSED)
        if _is_socket(request):
            return None if _is_of_our_page(request) else _response(http.HTTPStatus.FORBIDDEN, "of another origin")
        if path.startswith(_SCENE):
            # The browser shows it inside our page.
            scene = scene_page(connection, replace(request, path="/" + path.removeprefix(_SCENE)))
            return _secured(scene, _OF_THE_SCENE, host)
        found = self._page(path)
        if found is None:
            return _response(http.HTTPStatus.NOT_FOUND, "There is no such page.")
        kind, content = found
        return _secured(_response(http.HTTPStatus.OK, content, kind), _OF_OUR_PAGE, host)

    def _let_in(self, request: Request) -> Response:
        """Remember the token in a cookie, and take it out of the address, which people send to each other."""
        cookie = f"{self._name_of_cookie(request)}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        response = _response(http.HTTPStatus.SEE_OTHER, "")
        response.headers["Location"] = "/"
        response.headers["Set-Cookie"] = cookie
        return response

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(errors="backslashreplace"), self._token.encode())

    @staticmethod
    def _name_of_cookie(request: Request) -> str:
        """Return a name of its own for every port: browsers keep cookies by host alone."""
        return f"drone_sim_{request.headers.get('Host', '').rpartition(':')[2]}"


def _checked_host(headers: Headers) -> str:
    """Return whom a browser thinks that it asks. Raises ValueError for it and for other headers."""
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
    """Tell whether a socket is opened by our own page; what is no browser says no origin."""
    origin, host = request.headers.get("Origin"), request.headers.get("Host", "")
    return origin is None or origin in (f"http://{host}", f"https://{host}")


def _cookie(request: Request, name: str) -> str:
    try:
        found = SimpleCookie(request.headers.get("Cookie", "")).get(name)
    except CookieError:
        return ""
    return found.value if found is not None else ""


def _response(status: http.HTTPStatus, content: str | bytes, kind: str = "text/plain; charset=utf-8") -> Response:
    body = content if isinstance(content, bytes) else content.encode()
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(body))})
    return _secured(Response(status.value, status.phrase, headers, body), "", "")


def _secured(response: Response, policy: str, host: str) -> Response:
    """Return an answer with what keeps a browser from doing something else with it."""
    # Older browsers take 'self' for our pages alone, not for our sockets.
    sockets = f"ws://{host} wss://{host}" if host else ""
    for name, value in {**_SAFE, "Content-Security-Policy": (_POLICY + policy).format(sockets=sockets)}.items():
        response.headers.pop(name, None)
        response.headers[name] = value
    return response


class _Message(msgspec.Struct):
    type: str


_DECODER = msgspec.msgpack.Decoder(_Message)


class _CheckedConnection(ServerConnection):
    """A browser's socket. Whoever speaks something else than our page does is sent away with one line."""

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message, as `ServerConnection` does."""
        try:
            message = await super().recv(decode)
        except ConnectionClosedError as error:
            if error.sent is not None and error.sent.code in _BROKEN and not error.rcvd_then_sent:
                self._say(error.sent.reason)
            raise
        wrong = _wrong(message) if str(self.subprotocol).startswith(_VISER) else ""
        if not wrong:
            return message
        self._say(wrong)
        await self.close(CloseCode.POLICY_VIOLATION, wrong)
        return await super().recv(decode)  # which raises ConnectionClosed

    def _say(self, what: str) -> None:
        rospy.logwarn(f"a browser at {self.remote_address[0]} is sent away: {what}")


def _wrong(message: str | bytes) -> str:
    """Return what is wrong with a message to viser, '' for nothing."""
    try:
        kind = _DECODER.decode(message if isinstance(message, bytes) else b"").type
    except (msgspec.MsgspecError, RecursionError):
        return "no message of viser's"
    return f"{kind}: is not for this page" if kind in _NOT_FOR_THIS_PAGE else ""


class _OneLineHandler(logging.Handler):
    """Tells in one line, without a traceback, what goes wrong with a socket that is open."""

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        if record.getMessage() != "opening handshake failed":  # by whoever is no browser; there is nobody to tell
            rospy.logwarn(f"a browser's socket: {_one_line(error) if error else record.getMessage()}")


def _log_message_error(_loop: asyncio.AbstractEventLoop, context: Mapping[str, Any]) -> None:
    """Tell in one line what went wrong with a message that viser has taken; a loop calls it."""
    error = context.get("exception")
    rospy.logwarn(f"a browser's message: {_one_line(error) if error else context['message']}")


def _one_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
