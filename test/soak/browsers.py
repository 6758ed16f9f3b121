"""Clients of the cockpit during a soak: `browsers.py ADDRESS SEED FOLDER`, until it is killed.

Several Python clients use the page's protocol at once, which is cheap. They log to FOLDER/browsers.jsonl, one line for
each visit: its role, the time until it had the whole scene (s), and its error ('' for none).
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import sys
import time
from collections.abc import Awaitable, Callable
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect

AT_ONCE = 4
DAY, NIGHT, BETWEEN = 90.0, 10.0, 8.0  # s; BETWEEN is the longest pause between two visits
LONGEST = 30.0  # s, longest visit
DEAF = 60.0  # s; the node closes the connection of a client that reads nothing after 40
PATIENCE = 30.0  # s until the scene is loaded
PING = 100.0  # s; more than DEAF, since a client that reads nothing does not get its pongs
MINE = "mine/soak.py"
TEXTS = ("# a line\n", "1 / 0\n", "")
REACH = 0.3  # m, how far a drone is dragged


class Cockpit:
    """Address of the cockpit, and the cookie of a session."""

    def __init__(self, address: str):
        """Log in with the printed address, like a browser."""
        parts = urlsplit(address)
        self.host, self.port = str(parts.hostname), int(parts.port or 80)
        status, headers, _ = self.get(f"/?{parts.query}")
        if status != 303:
            raise RuntimeError(f"the door answers {status}")
        self.cookie = headers["Set-Cookie"].partition(";")[0]

    def get(self, path: str, cookie: str = "") -> tuple[int, Any, bytes]:
        """Return status, headers and content of a page."""
        connection = HTTPConnection(self.host, self.port, timeout=PATIENCE)
        try:
            connection.request("GET", path, headers={"Cookie": cookie, "Accept-Encoding": "gzip"})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def open(self) -> Any:
        return connect(
            f"ws://{self.host}:{self.port}/",
            subprotocols=["drone_sim"],  # type: ignore[list-item]
            additional_headers={"Cookie": self.cookie},
            compression=None,
            max_size=None,
            ping_interval=PING,
        )


class Browser:
    """One connection, and the drag handles that it has received: (server, name)."""

    def __init__(self, wire: ClientConnection, rng: random.Random):
        """Use an open WebSocket."""
        self.wire, self.rng = wire, rng
        self.handles: list[tuple[str, str]] = []
        self._number = 0

    async def load_scene(self) -> float:
        """Receive the whole scene; return the time that it took (s)."""
        start_time = time.monotonic()
        await asyncio.wait_for(self._load_scene(), PATIENCE)
        return time.monotonic() - start_time

    async def _load_scene(self) -> None:
        """Receive messages until the scene has a drone."""
        layers: set[str] = set()
        while "view/bodies" not in layers:
            message = await self.wire.recv()
            layers |= {one["layer"] for one in await self.take(message)}

    async def take(self, message: str | bytes) -> list[dict[str, Any]]:
        """Acknowledge an image or a part of the scene as shown; return its markers."""
        if isinstance(message, str):
            return []
        header = json.loads(message.partition(b"\n")[0])
        await self.say(shown=header.get("picture", "scene"))
        markers: list[dict[str, Any]] = header.get("markers", [])
        self.handles += [(one["layer"], one["ns"]) for one in markers if one["kind"] == "handle"]
        return markers

    async def say(self, **message: Any) -> None:
        await self.wire.send(json.dumps(message))

    async def ask(self, ask: str, **more: Any) -> dict[str, Any]:
        """Send a request to the node; return the answer."""
        self._number += 1
        await self.wire.send(json.dumps({"id": self._number, "ask": ask, **more}))
        return await asyncio.wait_for(self._receive_answer(self._number), PATIENCE)

    async def _receive_answer(self, number: int) -> dict[str, Any]:
        while True:
            message = await self.wire.recv()
            await self.take(message)
            answer = json.loads(message) if isinstance(message, str) else {}
            if answer.get("id") == number:
                return dict(answer)

    async def stay(self, seconds: float) -> None:
        """Receive and acknowledge all messages for a time."""
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._stay(), seconds)

    async def _stay(self) -> None:
        async for message in self.wire:
            await self.take(message)

    def vanish(self) -> None:
        """Abort the connection, like a browser that is killed."""
        self.wire.transport.abort()


async def watch(browser: Browser) -> None:
    await browser.stay(browser.rng.uniform(1.0, LONGEST))


async def fly(browser: Browser) -> None:
    """Hold a key, and abort the connection while it is held."""
    receiver = asyncio.create_task(browser.stay(LONGEST))
    for _ in range(browser.rng.randrange(10, 200)):
        await browser.say(hold={"vx": 0.3, "wz": browser.rng.choice([-1.0, 1.0])})
        await asyncio.sleep(0.1)
    receiver.cancel()
    browser.vanish()


async def drag(browser: Browser) -> None:
    """Push the drone, drag its first handle to random places, and release it."""
    await browser.say(push="drone", ray=[1.0, 0.0, 0.0], newtons=0.5)
    for server, name in browser.handles[:1]:
        for phase in ("start", *("move" for _ in range(20)), "end"):
            x, y = (browser.rng.uniform(-REACH, REACH) for _ in "xy")
            await browser.say(drag=phase, server=server, name=name, pose=[x, y, 0.8, 0.0, 0.0, 0.0, 1.0])
            await browser.stay(0.05)


async def write(browser: Browser) -> None:
    """Save and run correct and broken scripts, and run shipped ones."""
    groups = (await browser.ask("scripts"))["groups"]
    if MINE not in [name for group in groups for name in group["scripts"]]:
        await browser.ask("save_as", name=MINE.partition("/")[2], text="")
    for _ in range(browser.rng.randrange(1, 6)):
        shipped = await browser.ask("open", script=browser.rng.choice(browser.rng.choice(groups[:2])["scripts"]))
        mine = await browser.ask("open", script=MINE)
        text = browser.rng.choice(TEXTS) + shipped["text"]
        await browser.ask("save", script=MINE, version=mine["version"], text=text)
        await browser.ask("run", script=browser.rng.choice([MINE, shipped["script"]]))
    await browser.ask("run", script="built-in/pilot.py")


async def be_deaf(browser: Browser) -> None:
    """Read nothing until the node has closed the connection."""
    await asyncio.sleep(DEAF)
    browser.vanish()


ROLES: dict[str, Callable[[Browser], Awaitable[None]]] = {
    one.__name__: one for one in (watch, fly, drag, write, be_deaf)
}


async def visit(cockpit: Cockpit, role: str, rng: random.Random) -> float:
    """Open the cockpit, and play the role; return the time until the scene was loaded (s)."""
    for path in ("/", "/cockpit.js", "/cockpit.css")[: rng.randrange(4)]:
        await asyncio.to_thread(cockpit.get, path, cockpit.cookie)
    await asyncio.to_thread(cockpit.get, "/?token=wrong")
    async with cockpit.open() as wire:
        browser = Browser(wire, rng)
        load_time = await browser.load_scene()
        await ROLES[role](browser)
        if rng.random() < 0.5:
            browser.vanish()
    return load_time


async def visit_repeatedly(cockpit: Cockpit, end: float, rng: random.Random, diary: Path) -> None:
    """Visit the cockpit again and again until the time `end`."""
    while time.monotonic() < end:
        role, load_time, trouble = rng.choice(sorted(ROLES)), 0.0, ""
        await asyncio.sleep(rng.uniform(0.0, BETWEEN))
        try:
            load_time = await visit(cockpit, role, rng)
        except Exception as error:  # also errors of the node
            trouble = f"{type(error).__name__}: {error}"
        with diary.open("a", encoding="utf-8") as file:
            file.write(json.dumps([role, round(load_time, 3), trouble]) + "\n")


async def main() -> None:
    """Alternate between several clients for DAY seconds and none for NIGHT seconds."""
    address, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    cockpit, diary = Cockpit(address), folder / "browsers.jsonl"
    rngs = [random.Random(f"browser {seed} {number}") for number in range(AT_ONCE)]
    while True:
        end = time.monotonic() + DAY
        await asyncio.gather(*(visit_repeatedly(cockpit, end, rng, diary) for rng in rngs))
        await asyncio.sleep(NIGHT)


if __name__ == "__main__":
    asyncio.run(main())
