"""Our own socket: held keys, and the script editor. Messages are JSON; every question has an `id`, and one answer."""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import Callable, Mapping
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from drone_sim.ros.cockpit.flying import Flying, read_command

_BUSY = 32  # messages to a browser that does not take them, after which the oldest go

Answer = Callable[[Mapping[str, Any]], Mapping[str, Any]]


class Wire:
    """The browsers that are connected; what one asks is answered in a thread, for it may take its time."""

    def __init__(self, flying: Flying, answers: Mapping[str, Answer]):
        """Take who flies, and what answers a question, by its `ask`; what that raises as ValueError is told."""
        self._flying = flying
        self._answers = answers
        self._numbers = itertools.count()
        self._out: dict[int, tuple[asyncio.AbstractEventLoop, asyncio.Queue[str]]] = {}

    async def serve(self, connection: ServerConnection) -> None:
        """Talk with one browser until it goes."""
        browser = next(self._numbers)
        queue: asyncio.Queue[str] = asyncio.Queue()
        self._out[browser] = asyncio.get_running_loop(), queue
        sending = asyncio.create_task(_send_from(queue, connection))
        try:
            async for text in connection:
                await self._take(browser, text, connection)
        except ConnectionClosed:
            pass
        finally:
            del self._out[browser]
            sending.cancel()
            await asyncio.to_thread(self._flying.gone, browser)

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send something to all browsers; any thread may call."""
        text = json.dumps(message)
        for loop, queue in list(self._out.values()):
            loop.call_soon_threadsafe(_offer, queue, text)

    async def _take(self, browser: int, text: str | bytes, connection: ServerConnection) -> None:
        try:
            message = json.loads(text)
            if not isinstance(message, dict):
                raise ValueError("a message must be a mapping")
            if "hold" in message:
                self._flying.hold(browser, read_command(message["hold"]))
                return
            ask = self._answers.get(message.get("ask", ""))
            if ask is None:
                raise ValueError(f"ask: must be one of {', '.join(self._answers)}, or hold")
        except (ValueError, RecursionError) as error:
            await connection.send(json.dumps({"id": None, "error": str(error)}))
            return
        await connection.send(await asyncio.to_thread(_answered, ask, message))


def _answered(ask: Answer, message: Mapping[str, Any]) -> str:
    try:
        return json.dumps({"id": message.get("id"), **ask(message)})
    except ValueError as error:
        return json.dumps({"id": message.get("id"), "error": " ".join(str(error).split())})


async def _send_from(queue: asyncio.Queue[str], connection: ServerConnection) -> None:
    try:
        while True:
            await connection.send(await queue.get())
    except ConnectionClosed:
        return


def _offer(queue: asyncio.Queue[str], text: str) -> None:
    while queue.qsize() >= _BUSY:
        queue.get_nowait()
    queue.put_nowait(text)
