"""The program that flies one job after the other, each in a process forked from it: everything is imported already.

It reads a request in each line of its input, and answers with a line and a table: JSON, both lines, see `process`. It
runs no script itself. It ends with its input, whatever a flight does, and where nothing has been asked for a while.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import select
import shutil
import signal
import stat
import sys
import tempfile
from typing import Any, BinaryIO

from drone_sim.grading import plan as plans
from drone_sim.grading.flight import grade, prepare
from drone_sim.grading.jobs import limits
from drone_sim.grading.jobs.flying import FlightProcess
from drone_sim.grading.jobs.sandbox import HANDED_IN
from drone_sim.grading.plan import Plan, PlanError

READY = b"ready\n"  # said once, after the imports
_IDLE = 120.0  # s
_MOST_PLANS = 8  # kept in memory
_BESIDE = ("cv2", "drone_sim.scripting.lua.script", "drone_sim.render.renderer")  # imported where they are needed
_Version = tuple[tuple[int, int], ...]


def main() -> None:
    """Serve."""
    is_alone = sys.argv[1:] == ["alone"]  # in a sandbox, where it sees its own processes only
    for module in _BESIDE:
        importlib.import_module(module)
    limits.guard()
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # from the first process of a sandbox the kernel keeps it, then
    requests, replies = _own_streams()
    server = Server(is_alone, requests)
    folders = [tempfile.gettempdir(), *([HANDED_IN] if is_alone else [])]
    replies.write(READY)
    replies.flush()
    while select.select([requests], [], [], _IDLE)[0]:
        line = requests.readline()
        if not line:
            break
        request = json.loads(line)
        for path, size in request["handed_in"].items():
            _lay(f"{HANDED_IN}{path}", requests.read(size))
        reply, table = server.answer(request)
        is_last = not all([_cleared(folder) for folder in folders])  # what cannot be removed here, `process` removes
        replies.write(json.dumps({**reply, "table": len(table), "is_last": is_last}).encode() + b"\n" + table)
        replies.flush()
        if is_last:
            break


def _own_streams() -> tuple[BinaryIO, BinaryIO]:
    """Return input and output under other numbers; under theirs is nothing any more."""
    own = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
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


class Server:
    """Answers requests, and remembers plans."""

    def __init__(self, is_alone: bool, lifeline: BinaryIO):
        """Take whether all processes in sight are its own, and the pipe whose end is the end of everything."""
        self._is_alone = is_alone
        self._lifeline = lifeline
        self._plans: dict[str, tuple[_Version, Plan]] = {}

    def answer(self, request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Fly; return the result, or why there is none, and the table, b'' where none is wanted or left."""
        try:
            plan = self._plan(request["plan"])
        except (OSError, PlanError) as error:
            return {"lost": " ".join(str(error).split())}, b""
        flight = FlightProcess(plan, request, self._is_alone)
        with flight:
            if not flight.watch(self._lifeline.fileno()):
                sys.exit(0)
        return flight.reply()

    def _plan(self, path: str) -> Plan:
        """Return a plan, read anew where one of its files is another. Raises OSError and PlanError."""
        known = self._plans.get(path)
        if known is None or known[0] != _version(known[1]):
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
            plan = plans.read(path)
            with contextlib.suppress(Exception):
                grade(plan.model_copy(update={"duration": 0.1}), "pilot")  # what this reads and compiles, forks have
            prepare()
            self._plans[path] = _version(plan), plan
            gc.collect()
            gc.freeze()  # a fork that counts references copies fewer pages
        return self._plans[path][1]


def _version(plan: Plan) -> _Version:
    return tuple((status.st_mtime_ns, status.st_size) for status in map(os.stat, plan.files))


if __name__ == "__main__":
    main()
