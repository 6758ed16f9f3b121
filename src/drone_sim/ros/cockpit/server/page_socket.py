"""The page's WebSocket. Messages are JSON, pictures and scenes binary; each request has an `id`, and gets one reply."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import logging
import math
import socket
import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from drone_sim.ros.cockpit.teleop import HeldCommands, read_command

Answer = Callable[[Mapping[str, Any]], Mapping[str, Any]]
Handler = Callable[[int, Mapping[str, Any]], None]
SceneSince = Callable[[int], tuple[int, bytes]]
_LOG = logging.getLogger(__name__)
_MAX_MESSAGES = 32  # in the queue of a browser; then the oldest are dropped
_MAX_REQUESTS = 64  # of a browser that wait for their answers; then it is not heard until one is answered
_MAX_UNSENT = 1 << 14  # bytes in the kernel: more would be old when a slow network has sent them, and delay pings
# What a page that only watches may ask.
_READS = ("graded", "lesson", "locate", "look", "models", "open", "panel", "properties", "scripts", "tree", "windows")
_SCENE = "scene"  # name by which a browser reports that it has shown a message of the scene
_MAX_SCENES = 2  # sent messages of the scene that are not shown yet: one can be sent while the browser shows another


class PageSocket:
    """The connections to browsers. Requests are answered in threads, because an answer may take long."""

    def __init__(
        self,
        held: HeldCommands,
        answers: Mapping[str, Answer],
        handlers: Mapping[str, Handler] | None = None,
        scene: SceneSince = lambda version: (version, b""),
    ):
        """`held` gets the keys' commands; `answers` answer requests, by the value of `ask`, and may raise ValueError.

        `handlers` process messages without a reply, by a key that such a message has. They get the browser's number,
        are called in the order of the messages, and must return quickly. `scene` returns the present version of the
        scene, and the changes since another version.
        """
        self._held = held
        self._answers = answers
        self._handlers = handlers or {}
        self._scene = scene
        self._numbers = itertools.count()
        self._queues: dict[int, tuple[asyncio.AbstractEventLoop, SendQueue]] = {}
        self._has_browsers = threading.Event()

    async def serve(self, connection: ServerConnection) -> None:
        """Serve one browser until it disconnects."""
        browser = next(self._numbers)
        own = connection.transport.get_extra_info("socket")
        if own.family != socket.AF_UNIX:
            own.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, _MAX_UNSENT)
        queue = SendQueue(self._scene)
        query = urlsplit(connection.request.path).query if connection.request else ""
        only_watches = "watch" in parse_qs(query, keep_blank_values=True)
        self._queues[browser] = asyncio.get_running_loop(), queue
        self._has_browsers.set()
        requests = asyncio.Queue[tuple[Answer, dict[str, Any]]](_MAX_REQUESTS)
        running = [asyncio.create_task(task) for task in (_send(queue, connection), _answer(requests, connection))]
        try:
            async for text in connection:
                await self._process(browser, text, connection, requests, only_watches)
        except ConnectionClosed:
            pass
        finally:
            del self._queues[browser]
            if not self._queues:
                self._has_browsers.clear()
            for task in running:
                task.cancel()
            await asyncio.to_thread(self._held.release, browser)

    # ---- for any thread

    @property
    def browsers(self) -> set[int]:
        """The numbers of the connected browsers."""
        return set(self._queues)

    def wait_for_browser(self, timeout: float) -> None:
        """Return when a browser is connected, or after `timeout` (s)."""
        self._has_browsers.wait(timeout)

    def show_scene(self) -> None:
        """Send the changes of the scene to each browser that has shown the last ones."""
        self._call_queues(SendQueue.wake)

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send a message to all browsers."""
        self._call_queues(SendQueue.put, json.dumps(message))

    def tell_tree(self, message: Mapping[str, Any]) -> None:
        """Send a change of the object tree to the browsers that edit the scene."""
        text = json.dumps(message)
        self._call_queues(lambda queue: queue.put(text) if queue.follows_tree else None)

    def wants_picture(self, name: str) -> bool:
        """Return whether any browser has shown the last picture with this name."""
        return any(queue.wants(name) for _, queue in list(self._queues.values()))

    def show_picture(self, header: Mapping[str, Any], content: bytes) -> None:
        """Send a picture to all browsers that have shown the last one with its name.

        `header` has the name as `picture`, and other properties for the page; `content` is a JPEG or PNG.
        """
        picture = json.dumps(header).encode() + b"\n" + content
        self._call_queues(SendQueue.put_picture, header["picture"], picture)

    def close_picture(self, name: str) -> None:
        """Remove the pictures with this name from the queues."""
        self._call_queues(SendQueue.forget, name)

    def _call_queues(self, method: Callable[..., Any], *arguments: Any) -> None:
        for loop, queue in list(self._queues.values()):
            with contextlib.suppress(RuntimeError):  # the server has ended, and its loop with it
                loop.call_soon_threadsafe(method, queue, *arguments)

    # ---- messages

    async def _process(
        self,
        browser: int,
        text: str | bytes,
        connection: ServerConnection,
        requests: asyncio.Queue[tuple[Answer, dict[str, Any]]],
        only_watches: bool,
    ) -> None:
        try:
            message = _parse(text)
            if "hold" in message and not only_watches:
                self._held.hold(browser, read_command(message["hold"]))
                return
            if isinstance(message.get("shown"), str):
                self._queues[browser][1].shown(message["shown"])
                return
            if "follow_tree" in message:
                self._queues[browser][1].follows_tree = message["follow_tree"] is True
                return
            handler = next((handler for key, handler in self._handlers.items() if key in message), None)
            if handler is not None and not only_watches:
                handler(browser, message)
                return
            name = message.get("ask")
            answer = self._answers.get(name) if isinstance(name, str) else None
            if only_watches and name not in _READS:
                answer = _refuse_change
            if answer is None:
                raise ValueError(f"ask: must be one of {', '.join(self._answers)}, or hold")
        except (ValueError, RecursionError) as error:
            await connection.send(json.dumps({"id": None, "error": str(error)}))
            return
        await requests.put((answer, message))


def _parse(text: str | bytes) -> dict[str, Any]:
    """Return a browser's message. Raises ValueError and RecursionError."""
    message = json.loads(text, parse_constant=_finite, parse_float=_finite)
    if not isinstance(message, dict):
        raise ValueError("a message must be a mapping")
    number = message.get("id", 0)
    if not isinstance(number, int) or isinstance(number, bool):
        raise ValueError("id: must be a whole number")
    return message


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:20]}: is not a number in JSON, or too large")
    return value


def _refuse_change(_message: Mapping[str, Any]) -> Mapping[str, Any]:
    raise ValueError("you only watch: open the simulator without ?watch to change anything")


def _reply(answer: Answer, message: Mapping[str, Any]) -> str:
    try:
        return json.dumps({"id": message.get("id"), **answer(message)})
    except Exception as error:  # an OSError, or a bug: the socket must stay open
        if not isinstance(error, (ValueError, OSError, RecursionError)):
            _LOG.exception("the question '%s' could not be answered", message.get("ask"))
        return json.dumps(
            {"id": message.get("id"), "error": " ".join(str(error).split()), "kind": type(error).__name__}
        )


async def _answer(requests: asyncio.Queue[tuple[Answer, dict[str, Any]]], connection: ServerConnection) -> None:
    """Answer requests in turn, beside the keys' commands, which must not wait for an answer that takes long."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            await connection.send(await asyncio.to_thread(_reply, *await requests.get()))


async def _send(queue: SendQueue, connection: ServerConnection) -> None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            await connection.send(await queue.take())


class SendQueue:
    """Messages to one browser. All methods but `wants` are for the thread of its event loop.

    A picture is sent once the browser has shown the last one with that name. Changes of the scene are sent while fewer
    than _MAX_SCENES messages are not shown.
    """

    def __init__(self, scene: SceneSince = lambda version: (version, b"")):
        self.follows_tree = False
        self._scene, self._version = scene, -1
        self._unshown_scenes = 0
        self._messages: deque[str] = deque(maxlen=_MAX_MESSAGES)
        self._pictures: dict[str, bytes] = {}
        self._unshown_pictures: set[str] = set()  # names of sent pictures
        self._has_news = asyncio.Event()

    def put(self, message: str) -> None:
        self._messages.append(message)
        self._has_news.set()

    def wake(self) -> None:
        """Check again whether the scene has changed."""
        self._has_news.set()

    def wants(self, name: str) -> bool:
        """Return whether a picture with this name would be sent now. Thread-safe."""
        return name not in self._unshown_pictures

    def put_picture(self, name: str, picture: bytes) -> None:
        """Add a picture; it replaces a picture with the same name that is not sent yet."""
        self._pictures[name] = picture
        self._has_news.set()

    def shown(self, name: str) -> None:
        """Note that the browser has shown a picture, or a message of the scene."""
        self._unshown_pictures.discard(name)
        if name == _SCENE:
            self._unshown_scenes = max(0, self._unshown_scenes - 1)
        self._has_news.set()

    def forget(self, name: str) -> None:
        """Remove a picture that the browser has closed."""
        self._pictures.pop(name, None)
        self._unshown_pictures.discard(name)

    async def take(self) -> str | bytes:
        """Wait for the next message to send, and return it."""
        while (message := self._next()) is None:
            self._has_news.clear()
            await self._has_news.wait()
        return message

    def _next(self) -> str | bytes | None:
        if self._messages:
            return self._messages.popleft()
        if self._unshown_scenes < _MAX_SCENES:
            self._version, changes = self._scene(self._version)
            if changes:
                self._unshown_scenes += 1
                return changes
        for name in self._pictures.keys() - self._unshown_pictures:
            self._unshown_pictures.add(name)
            return self._pictures.pop(name)
        return None
