"""The program that flies one job after the other, each in a process forked from it: everything is imported already.

Its input brings requests in JSON, each with the files that are handed in; it answers each with JSON and a table, as
`fork_server_client` sends and receives them. It runs no script itself. It ends with its input, whatever a flight does,
and where nothing has been asked for a while.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import shutil
import signal
import stat
import sys
import tempfile
from multiprocessing.connection import Connection
from typing import Any

from drone_sim.command_line import format_error
from drone_sim.files.resources import FileCache, ReadFile
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import grade
from drone_sim.grading.jobs.flight_process import FlightProcess, guard
from drone_sim.grading.jobs.sandbox import HANDED_IN
from drone_sim.grading.plan import Plan, PlanError
from drone_sim.world import connect_ahead

READY = b"ready"  # said once, after the imports
_IDLE = 120.0  # s
_MOST_PLANS = 8  # kept in memory
_BESIDE = ("cv2", "drone_sim.scripting.lua.script", "drone_sim.render.renderer")  # imported where they are needed


def main() -> None:
    """Serve."""
    is_alone = sys.argv[1:] == ["alone"]  # in a sandbox, where it sees its own processes only
    for module in _BESIDE:
        importlib.import_module(module)
    guard()
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # from the first process of a sandbox the kernel keeps it, then
    requests, replies = _own_streams()
    server = ForkServer(is_alone, requests)
    folders = [tempfile.gettempdir(), *([HANDED_IN] if is_alone else [])]
    replies.send_bytes(READY)
    with contextlib.suppress(EOFError):  # the input has ended
        while requests.poll(_IDLE):
            request = json.loads(requests.recv_bytes())
            for path in request["handed_in"]:
                _lay(f"{HANDED_IN}{path}", requests.recv_bytes())
            reply, table = server.answer(request)
            is_last = not all([_cleared(folder) for folder in folders])  # what cannot be removed here, its client does
            replies.send_bytes(json.dumps({**reply, "is_last": is_last}).encode())
            replies.send_bytes(table)
            if is_last:
                break


def _own_streams() -> tuple[Connection, Connection]:
    """Return input and output under other numbers; under theirs is nothing any more."""
    own = Connection(os.dup(0), writable=False), Connection(os.dup(1), readable=False)
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1):
        os.dup2(nothing, number)
    os.close(nothing)
    return own


def _lay(path: str, content: bytes) -> None:
    """Write a file of the script that is to be flown."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(content)


def _cleared(folder: str) -> bool:
    """Remove what a flight has left in a folder; return whether nothing is there any more."""
    os.chmod(folder, stat.S_IRWXU)
    for entry in os.scandir(folder):
        with contextlib.suppress(OSError, RecursionError):
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path)
            else:
                os.unlink(entry.path)
    return not os.listdir(folder)


class ForkServer:
    """Answers requests, and remembers plans."""

    def __init__(self, is_alone: bool, lifeline: Connection):
        """Begin. `is_alone`: all processes in sight are its own; the end of the pipe `lifeline` ends everything."""
        self._is_alone = is_alone
        self._lifeline = lifeline
        self._plans: FileCache[Plan] = FileCache(_read_plan, _MOST_PLANS)

    def answer(self, request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Fly; return the result, or why there is none, and the table, b'' where none is wanted or left."""
        try:
            plan = self._plans.get(request["plan"])
        except (OSError, PlanError) as error:
            return {"lost": format_error(error)}, b""
        flight = FlightProcess(plan, request, self._is_alone)
        with flight:
            if not flight.watch(self._lifeline.fileno()):
                sys.exit(0)
        return flight.reply()


def _read_plan(path: str) -> ReadFile:
    """Return a plan, once all that a flight of it needs has been read and compiled. Raises OSError and PlanError."""
    plan = plans.read(path)
    with contextlib.suppress(Exception):
        grade(plan.model_copy(update={"duration": 0.1}), "pilot")  # what this reads and compiles, forks have
    connect_ahead()  # which forks need not do, either
    gc.collect()
    gc.freeze()  # a fork that counts references copies fewer pages
    return ReadFile(plan, 1, map(str, plan.files))


if __name__ == "__main__":
    main()
