"""Who opens the cockpit during a soak: `browsers.py ADDRESS SEED FOLDER`, until it is killed.

Several at once speak as the page does, in Python: that is cheap. What they saw goes to FOLDER/browsers.jsonl, a line
for each visit: what it did, after how many s it had the whole scene, and what went wrong ('' for nothing).
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
DAY, NIGHT, BETWEEN = 90.0, 10.0, 8.0  # s; between two visits at most
LONGEST = 30.0  # s of a visit
DEAF = 60.0  # s; the node gives up somebody who takes nothing after 40
PATIENCE = 30.0  # s until the scene is there
PING = 100.0  # s; who is deaf does not hear the answers to its own, either
MINE = "mine/soak.py"
TEXTS = ("# a line\n", "1 / 0\n", "")
REACH = 0.3  # m, how far a drone is dragged


class Door:
    """Where the cockpit is, and the cookie that lets in."""

    def __init__(self, address: str):
        """Come in with the printed address, as a browser does."""
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
    """One visit, and the handles that it has heard of: server and name."""

    def __init__(self, wire: ClientConnection, dice: random.Random):
        """Take an open socket."""
        self.wire, self.dice = wire, dice
        self.handles: list[tuple[str, str]] = []
        self._number = 0

    async def look(self) -> float:
        """Take the whole scene; return how long that took (s)."""
        began = time.monotonic()
        await asyncio.wait_for(self._take_all(), PATIENCE)
        return time.monotonic() - began

    async def _take_all(self) -> None:
        """Take messages until a drone is there."""
        layers: set[str] = set()
        while "view/bodies" not in layers:
            message = await self.wire.recv()
            layers |= {one["layer"] for one in await self.take(message)}

    async def take(self, message: str | bytes) -> list[dict[str, Any]]:
        """Say of a picture, or of a part of the scene, that it has been shown; return the markers that it brings."""
        if isinstance(message, str):
            return []
        said = json.loads(message.partition(b"\n")[0])
        await self.say(shown=said.get("picture", "scene"))
        markers: list[dict[str, Any]] = said.get("markers", [])
        self.handles += [(one["layer"], one["ns"]) for one in markers if one["kind"] == "handle"]
        return markers

    async def say(self, **message: Any) -> None:
        await self.wire.send(json.dumps(message))

    async def ask(self, ask: str, **more: Any) -> dict[str, Any]:
        """Ask the node something; return the answer."""
        self._number += 1
        await self.wire.send(json.dumps({"id": self._number, "ask": ask, **more}))
        return await asyncio.wait_for(self._hear(self._number), PATIENCE)

    async def _hear(self, number: int) -> dict[str, Any]:
        while True:
            message = await self.wire.recv()
            await self.take(message)
            answer = json.loads(message) if isinstance(message, str) else {}
            if answer.get("id") == number:
                return dict(answer)

    async def stay(self, seconds: float) -> None:
        """Take what comes, without looking at it."""
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._stay(), seconds)

    async def _stay(self) -> None:
        async for message in self.wire:
            await self.take(message)

    def vanish(self) -> None:
        """Be gone without a word, as a browser that is killed."""
        self.wire.transport.abort()


async def watch(browser: Browser) -> None:
    await browser.stay(browser.dice.uniform(1.0, LONGEST))


async def fly(browser: Browser) -> None:
    """Hold a key, and vanish while it is held."""
    taking = asyncio.create_task(browser.stay(LONGEST))
    for _ in range(browser.dice.randrange(10, 200)):
        await browser.say(hold={"vx": 0.3, "wz": browser.dice.choice([-1.0, 1.0])})
        await asyncio.sleep(0.1)
    taking.cancel()
    browser.vanish()


async def drag(browser: Browser) -> None:
    """Push the drone, drag it about, and let go of it, or vanish meanwhile."""
    await browser.say(push="drone", ray=[1.0, 0.0, 0.0], newtons=0.5)
    for server, name in browser.handles[:1]:
        for phase in ("start", *("move" for _ in range(20)), "end"):
            x, y = (browser.dice.uniform(-REACH, REACH) for _ in "xy")
            await browser.say(drag=phase, server=server, name=name, pose=[x, y, 0.8, 0.0, 0.0, 0.0, 1.0])
            await browser.stay(0.05)


async def write(browser: Browser) -> None:
    """Write a script, well or badly, and fly it; fly others."""
    groups = (await browser.ask("scripts"))["groups"]
    if MINE not in [name for group in groups for name in group["scripts"]]:
        await browser.ask("save_as", name=MINE.partition("/")[2], text="")
    for _ in range(browser.dice.randrange(1, 6)):
        shipped = await browser.ask("open", script=browser.dice.choice(browser.dice.choice(groups[:2])["scripts"]))
        mine = await browser.ask("open", script=MINE)
        text = browser.dice.choice(TEXTS) + shipped["text"]
        await browser.ask("save", script=MINE, version=mine["version"], text=text)
        await browser.ask("run", script=browser.dice.choice([MINE, shipped["script"]]))
    await browser.ask("run", script="built-in/pilot.py")


async def be_deaf(browser: Browser) -> None:
    """Take nothing of what is sent, until the node gives up."""
    await asyncio.sleep(DEAF)
    browser.vanish()


ROLES: dict[str, Callable[[Browser], Awaitable[None]]] = {
    one.__name__: one for one in (watch, fly, drag, write, be_deaf)
}


async def visit(door: Door, role: str, dice: random.Random) -> float:
    """Open the cockpit, and do what the role does; return how long the scene took to come (s)."""
    for path in ("/", "/cockpit.js", "/cockpit.css")[: dice.randrange(4)]:
        await asyncio.to_thread(door.get, path, door.cookie)
    await asyncio.to_thread(door.get, "/?token=wrong")
    async with door.open() as wire:
        browser = Browser(wire, dice)
        waited = await browser.look()
        await ROLES[role](browser)
        if dice.random() < 0.5:
            browser.vanish()
    return waited


async def visit_again_and_again(door: Door, end: float, dice: random.Random, diary: Path) -> None:
    """Come and go until a time."""
    while time.monotonic() < end:
        role, waited, trouble = dice.choice(sorted(ROLES)), 0.0, ""
        await asyncio.sleep(dice.uniform(0.0, BETWEEN))
        try:
            waited = await visit(door, role, dice)
        except Exception as error:  # also what the node should not do
            trouble = f"{type(error).__name__}: {error}"
        with diary.open("a", encoding="utf-8") as file:
            file.write(json.dumps([role, round(waited, 3), trouble]) + "\n")


async def main() -> None:
    """Be several browsers by day, and none in the short nights."""
    address, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    door, diary = Door(address), folder / "browsers.jsonl"
    dices = [random.Random(f"browser {seed} {number}") for number in range(AT_ONCE)]
    while True:
        end = time.monotonic() + DAY
        await asyncio.gather(*(visit_again_and_again(door, end, dice, diary) for dice in dices))
        await asyncio.sleep(NIGHT)


if __name__ == "__main__":
    asyncio.run(main())
