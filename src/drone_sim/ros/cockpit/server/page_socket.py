"""Our own socket: held keys, script editor, windows. Messages are JSON; every question has an `id`, and one answer."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import logging
import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from drone_sim.ros.cockpit.teleop import HeldCommands, read_command

Answer = Callable[[Mapping[str, Any]], Mapping[str, Any]]
Taken = Callable[[int, Mapping[str, Any]], None]
SceneSince = Callable[[int], tuple[int, bytes]]
_LOG = logging.getLogger(__name__)
_MESSAGES = 32  # after which the oldest go: this browser does not take them
_SCENE = "scene"  # the name under which a browser says that it has shown a message of the scene
_UNSHOWN = 2  # messages of the scene that are on their way at most: over a slow line one is shown while another comes


class PageSocket:
    """The browsers that are connected; what one asks is answered in a thread, for it may take its time."""

    def __init__(
        self,
        held: HeldCommands,
        answers: Mapping[str, Answer],
        takes: Mapping[str, Taken] | None = None,
        scene: SceneSince = lambda version: (version, b""),
    ):
        """Leave commands in `held`; `answers` answer questions, by their `ask`, and raise ValueError.

        `takes` take messages that are not answered, with the number of the browser, by what they begin with; they are
        called in their order and must be quick. `scene` returns what has changed since a version, and the version now.
        """
        self._held = held
        self._answers = answers
        self._takes = takes or {}
        self._scene = scene
        self._numbers = itertools.count()
        self._out: dict[int, tuple[asyncio.AbstractEventLoop, SendQueue]] = {}

    async def serve(self, connection: ServerConnection) -> None:
        """Talk with one browser until it goes."""
        browser = next(self._numbers)
        box = SendQueue(self._scene)
        self._out[browser] = asyncio.get_running_loop(), box
        sending = asyncio.create_task(_send_from(box, connection))
        try:
            async for text in connection:
                await self._take(browser, text, connection)
        except ConnectionClosed:
            pass
        finally:
            del self._out[browser]
            sending.cancel()
            await asyncio.to_thread(self._held.release, browser)

    @property
    def browsers(self) -> set[int]:
        """The numbers of those that are connected; any thread may ask."""
        return set(self._out)

    def show_scene(self) -> None:
        """Send what has changed in the scene to each browser that has shown what it got; any thread may call."""
        self._leave(SendQueue.wake)

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send something to all browsers; any thread may call."""
        text = json.dumps(message)
        self._leave(lambda box: box.put(text))

    def wants_picture(self, name: str) -> bool:
        """Whether any browser has shown the last picture of that name; any thread may call."""
        return any(box.wants(name) for _, box in list(self._out.values()))

    def show_picture(self, said: Mapping[str, str], content: bytes) -> None:
        """Send a picture to all browsers that have shown the last one of its name; any thread may call.

        `said` has its name as `picture`, and what else the page is to know of it; `content` is a JPEG or PNG.
        """
        picture = json.dumps(said).encode() + b"\n" + content
        self._leave(lambda box: box.put_picture(said["picture"], picture))

    def close_picture(self, name: str) -> None:
        """Send no more of that name; any thread may call."""
        self._leave(lambda box: box.forget(name))

    def _leave(self, leave: Callable[[SendQueue], None]) -> None:
        for loop, box in list(self._out.values()):
            with contextlib.suppress(RuntimeError):  # the server ends, and its loop with it
                loop.call_soon_threadsafe(leave, box)

    async def _take(self, browser: int, text: str | bytes, connection: ServerConnection) -> None:
        try:
            message = _read(text)
            if "hold" in message:
                self._held.hold(browser, read_command(message["hold"]))
                return
            if isinstance(message.get("shown"), str):
                self._out[browser][1].shown(message["shown"])
                return
            take = next((take for name, take in self._takes.items() if name in message), None)
            if take is not None:
                take(browser, message)
                return
            asked = message.get("ask")
            ask = self._answers.get(asked) if isinstance(asked, str) else None
            if ask is None:
                raise ValueError(f"ask: must be one of {', '.join(self._answers)}, or hold")
        except (ValueError, RecursionError) as error:
            await connection.send(json.dumps({"id": None, "error": str(error)}))
            return
        await connection.send(await asyncio.to_thread(_answered, ask, message))


def _read(text: str | bytes) -> dict[str, Any]:
    """Return a message. Raises ValueError, RecursionError."""
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


def _answered(ask: Answer, message: Mapping[str, Any]) -> str:
    try:
        return json.dumps({"id": message.get("id"), **ask(message)})
    except Exception as error:  # an OSError for an impossible name, or a fault of our own: the socket stays open
        if not isinstance(error, (ValueError, OSError, RecursionError)):
            _LOG.exception("the question '%s' could not be answered", message.get("ask"))
        return json.dumps(
            {"id": message.get("id"), "error": " ".join(str(error).split()), "kind": type(error).__name__}
        )


async def _send_from(box: SendQueue, connection: ServerConnection) -> None:
    try:
        while True:
            await connection.send(await box.take())
    except ConnectionClosed:
        return


class SendQueue:
    """What waits to be sent to one browser; used in the thread of its event loop.

    A picture is sent when the browser has shown the last one of that name. So is the scene, of which a browser gets
    what has changed since the message before.
    """

    def __init__(self, scene: SceneSince = lambda version: (version, b"")):
        """Begin empty; `scene` returns what has changed since a version, and the version now."""
        self._scene, self._version = scene, -1
        self._unshown = 0
        self._messages: deque[str] = deque(maxlen=_MESSAGES)
        self._pictures: dict[str, bytes] = {}
        self._owed: set[str] = set()  # names of those that are on their way
        self._came = asyncio.Event()

    def put(self, message: str) -> None:
        """Leave a message."""
        self._messages.append(message)
        self._came.set()

    def wake(self) -> None:
        """Hear that there may be something new in the scene."""
        self._came.set()

    def wants(self, name: str) -> bool:
        """Whether a picture of that name would be taken now; any thread may ask."""
        return name not in self._owed

    def put_picture(self, name: str, picture: bytes) -> None:
        """Leave a picture in the place of the last one."""
        self._pictures[name] = picture
        self._came.set()

    def shown(self, name: str) -> None:
        """Hear that a picture, or a message of the scene, has been shown."""
        self._owed.discard(name)
        if name == _SCENE:
            self._unshown = max(0, self._unshown - 1)
        self._came.set()

    def forget(self, name: str) -> None:
        """Hear that a picture is closed, whether or not the last one has been shown."""
        self._pictures.pop(name, None)
        self._owed.discard(name)

    async def take(self) -> str | bytes:
        """Return what is to be sent next; wait for it."""
        while True:
            for found in self._ready():
                return found
            self._came.clear()
            await self._came.wait()

    def _ready(self) -> Iterator[str | bytes]:
        if self._messages:
            yield self._messages.popleft()
        if self._unshown < _UNSHOWN:
            self._version, changed = self._scene(self._version)
            if changed:
                self._unshown += 1
                yield changed
        for name in self._pictures.keys() - self._owed:
            self._owed.add(name)
            yield self._pictures.pop(name)
