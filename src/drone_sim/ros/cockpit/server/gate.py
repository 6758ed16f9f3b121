"""Who comes in: whoever has the token that the printed address holds, and no page of another origin."""

from __future__ import annotations

import contextlib
import hmac
import http
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets import Headers
from websockets.asyncio import server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from drone_sim.ros.cockpit.page import Page

WIRE = "drone_sim"  # the subprotocol of our own socket; the scene's is viser's
_SCENE = "/scene/"  # where viser's page is
_LARGEST = 8 << 20  # bytes of a message from a browser: a script, with all that JSON makes longer
_REFUSED = "The cockpit opens with the address that the simulation has printed: it ends in ?token=..."
_SAFE = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Cache-Control": "no-store",
}

Handler = Callable[[ServerConnection], Awaitable[None]]


class Gate:
    """What stands before viser's server: its port serves our page and socket, too, to who has the token."""

    def __init__(self, token: str, page: Page, wire: Handler):
        """Take what is served beside the scene: a page, and a socket that speaks `WIRE`."""
        self._token = token
        self._page = page
        self._wire = wire

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
            scene_page, choose = options.pop("process_request"), options.pop("select_subprotocol")
            return serve(
                lambda connection: (self._wire if connection.subprotocol == WIRE else scene)(connection),
                host,
                port,
                process_request=lambda connection, request: self._answer(connection, request, scene_page),
                select_subprotocol=lambda connection, offered: WIRE if WIRE in offered else choose(connection, offered),
                **{**options, "max_size": _LARGEST},
            )

        return guarded

    def _answer(self, connection: ServerConnection, request: Request, scene_page: Callable[..., Any]) -> Any:
        """Return the answer to a request; None lets a socket be opened."""
        url = urlsplit(request.path)
        if self._is_token(parse_qs(url.query).get("token", [""])[0]) and not _is_socket(request):
            return self._let_in(request)
        if not self._is_token(_cookie(request, self._name_of_cookie(request))):
            return _response(http.HTTPStatus.FORBIDDEN, _REFUSED)
        if _is_socket(request):
            return None if _is_of_our_page(request) else _response(http.HTTPStatus.FORBIDDEN, "of another origin")
        if url.path.startswith(_SCENE):
            # Its headers are viser's own: the browser shows it inside our page.
            return scene_page(connection, replace(request, path="/" + url.path.removeprefix(_SCENE)))
        found = self._page.find(url.path)
        if found is None:
            return _response(http.HTTPStatus.NOT_FOUND, "There is no such page.")
        kind, content = found
        return _response(http.HTTPStatus.OK, content, kind)

    def _let_in(self, request: Request) -> Response:
        """Remember the token in a cookie, and take it out of the address, which people send to each other."""
        cookie = f"{self._name_of_cookie(request)}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        response = _response(http.HTTPStatus.SEE_OTHER, "")
        response.headers["Location"] = "/"
        response.headers["Set-Cookie"] = cookie
        return response

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self._token.encode())

    @staticmethod
    def _name_of_cookie(request: Request) -> str:
        """Return a name of its own for every port: browsers keep cookies by host alone."""
        return f"drone_sim_{request.headers.get('Host', '').rpartition(':')[2]}"


def _is_socket(request: Request) -> bool:
    return str(request.headers.get("Upgrade", "")).lower() == "websocket"


def _is_of_our_page(request: Request) -> bool:
    """Tell whether a socket is opened by our own page; what is no browser says no origin."""
    origin = request.headers.get("Origin")
    return origin is None or urlsplit(origin).netloc == request.headers.get("Host")


def _cookie(request: Request, name: str) -> str:
    try:
        found = SimpleCookie(request.headers.get("Cookie", "")).get(name)
    except CookieError:
        return ""
    return found.value if found is not None else ""


def _response(status: http.HTTPStatus, content: str | bytes, kind: str = "text/plain; charset=utf-8") -> Response:
    body = content if isinstance(content, bytes) else content.encode()
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(body)), **_SAFE})
    return Response(status.value, status.phrase, headers, body)
