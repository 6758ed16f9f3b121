"""The program that judges: it forks a process for each flight, which holds the world and everything that is judged.

The script that flies is in another process, behind a door (scripting.rpc); none of its lines ever runs here.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import importlib
import json
import logging
import socket
import sys
from collections.abc import Mapping
from typing import Any

from drone_sim.command_line import format_error
from drone_sim.files.resources import FileCache, ReadFile
from drone_sim.grading import permissions
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import Flight, grade, ungraded, write_to
from drone_sim.grading.jobs.limited_process import LimitedProcess, stay_on_one_processor
from drone_sim.grading.jobs.server import GONE, Requests
from drone_sim.grading.plan import Plan, PlanError
from drone_sim.scripting.rpc.connection import ScriptConnection
from drone_sim.world import connect_ahead

_LOG = logging.getLogger(__name__)
_MOST = {"result": 2**22, "table": 2**28}  # bytes
_MOST_PLANS = 8  # kept in memory
_BESIDE = ("cv2", "drone_sim.scripting.lua.script", "drone_sim.render.renderer")  # imported where they are needed


def main() -> None:
    """Serve: each request names a plan, a seed, changes, and whether the table is wanted; result and table go back."""
    for module in _BESIDE:
        importlib.import_module(module)
    requests = Requests()
    known: FileCache[Plan] = FileCache(_read_plan, _MOST_PLANS)
    with contextlib.suppress(*GONE):
        for request, door in requests:
            requests.reply(*_answer(request, door, requests, known))


def _answer(
    request: dict[str, Any], door: socket.socket, requests: Requests, known: FileCache[Plan]
) -> tuple[bytes, bytes]:
    """Return result, or why there is none, as JSON; and the table, b'' where none is wanted or left."""
    try:
        plan = known.get(request["plan"])
    except (OSError, PlanError) as error:
        return json.dumps({"lost": format_error(error)}).encode(), b""
    judge = functools.partial(_judge, plan, request, door)
    process = LimitedProcess(request["limits"], judge, _MOST, [door.fileno()])
    door.close()
    with process:
        if not process.watch(requests.fileno()):
            sys.exit(0)  # nobody wants it any more
    with contextlib.suppress(ValueError):
        reply = json.loads(process.output("result"))
        return json.dumps(reply).encode(), process.output("table")
    return json.dumps({"lost": process.end}).encode(), b""


def _judge(plan: Plan, request: dict[str, Any], door: socket.socket, outputs: Mapping[str, int]) -> None:
    """Fly once, in a process of its own, and write what came of it."""
    script, seed, changes = request["script"], request["seed"], request["changes"]
    end = ScriptConnection(door, processor=stay_on_one_processor())
    rows, is_gone = None, False
    try:
        flight = Flight(plan, script, seed, changes, end)
        result = flight.grade()
        rows, is_gone = flight.rows if request["table"] else None, end.is_gone
    except BaseException as error:
        result = ungraded(plan, script, seed, changes, _format_error(error))
    if rows is not None:
        with open(outputs["table"], "w") as file:
            write_to(file, rows)
    with open(outputs["result"], "wb") as file:
        file.write(json.dumps({"result": result.to_json(), "is_gone": is_gone}).encode())


def _read_plan(path: str) -> ReadFile:
    """Return a plan, once all that a flight of it needs has been read and compiled. Raises OSError and PlanError."""
    plan = plans.read(path)
    try:
        grade(plan.model_copy(update={"duration": 0.1}), "pilot")  # forks inherit what this reads and compiles
    except Exception:  # an error of ours; every flight then reads and compiles for itself
        _LOG.warning("a warm-up flight failed: flights will be slower", exc_info=True)
    permissions.free()
    connect_ahead()  # which forks need not do, either
    gc.collect()
    gc.freeze()
    return ReadFile(plan, 1, map(str, plan.files))


def _format_error(error: BaseException) -> str:
    """Return one line for what no flight should raise, such as memory that ran out."""
    try:
        said = format_error(error)
    except Exception:
        said = ""
    return f"{type(error).__name__}: {said:.300}".removesuffix(": ")


if __name__ == "__main__":
    main()
