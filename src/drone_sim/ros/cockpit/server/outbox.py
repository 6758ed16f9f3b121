"""What waits to be sent to one browser: few messages, and of each picture the latest alone."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterator

_MESSAGES = 32  # after which the oldest go: this browser does not take them


class Outbox:
    """Used in the thread of its event loop. A picture goes when the browser has shown the last one of that name."""

    def __init__(self) -> None:
        """Begin empty."""
        self._messages: deque[str] = deque(maxlen=_MESSAGES)
        self._pictures: dict[str, bytes] = {}
        self._owed: set[str] = set()  # names of those that are on their way
        self._came = asyncio.Event()

    def put(self, message: str) -> None:
        """Leave a message."""
        self._messages.append(message)
        self._came.set()

    def wants(self, name: str) -> bool:
        """Whether a picture of that name would be taken now; any thread may ask."""
        return name not in self._owed

    def put_picture(self, name: str, picture: bytes) -> None:
        """Leave a picture in the place of the last one."""
        self._pictures[name] = picture
        self._came.set()

    def shown(self, name: str) -> None:
        """Hear that a picture has been shown."""
        self._owed.discard(name)
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
        for name in self._pictures.keys() - self._owed:
            self._owed.add(name)
            yield self._pictures.pop(name)
