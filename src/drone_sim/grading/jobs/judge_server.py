"""The judge: a program that forks a process for each flight, which simulates the world and judges the flight.

The flying script runs in another process, behind a connection (scripting.rpc), and never in this one.
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
from drone_sim.grading.flight import Flight, grade, result_of, write_table
from drone_sim.grading.jobs.limited_process import LimitedProcess, stay_on_one_processor
from drone_sim.grading.jobs.server import DISCONNECTED, Requests
from drone_sim.grading.plan import Plan, PlanError
from drone_sim.scripting.rpc.connection import ScriptConnection
from drone_sim.world import connect_ahead

_LOG = logging.getLogger(__name__)
_OUTPUT_LIMITS = {"result": 2**22, "table": 2**28}  # bytes
_MAX_PLANS = 8  # in the cache
_LATE_IMPORTS = ("cv2", "drone_sim.scripting.lua.script", "drone_sim.render.renderer")  # of functions


def main() -> None:
    """Answer each request, which names a plan, a seed, changes and whether a table is wanted, with result and table."""
    for module in _LATE_IMPORTS:
        importlib.import_module(module)
    requests = Requests()
    plan_cache: FileCache[Plan] = FileCache(_read_plan, _MAX_PLANS)
    with contextlib.suppress(*DISCONNECTED):
        for request, link in requests:
            requests.reply(*_answer(request, link, requests, plan_cache))


def _answer(
    request: dict[str, Any], link: socket.socket, requests: Requests, plan_cache: FileCache[Plan]
) -> tuple[bytes, bytes]:
    """Return the result, or the reason why there is none, as JSON, and the table, b'' if there is none."""
    try:
        plan = plan_cache.get(request["plan"])
    except (OSError, PlanError) as error:
        return json.dumps({"lost": format_error(error)}).encode(), b""
    judge = functools.partial(_judge, plan, request, link)
    process = LimitedProcess(request["limits"], judge, _OUTPUT_LIMITS, [link.fileno()])
    link.close()
    with process:
        if not process.watch(requests.fileno()):
            sys.exit(0)  # the client has ended
    with contextlib.suppress(ValueError):
        reply = json.loads(process.output("result"))
        return json.dumps(reply).encode(), process.output("table")
    return json.dumps({"lost": process.end}).encode(), b""


def _judge(plan: Plan, request: dict[str, Any], link: socket.socket, outputs: Mapping[str, int]) -> None:
    """Fly once, in the forked process, and write result and table to the outputs."""
    script, seed, changes = request["script"], request["seed"], request["changes"]
    connection = ScriptConnection(link, processor=stay_on_one_processor())
    rows, is_gone = None, False
    try:
        flight = Flight(plan, script, seed, changes, connection)
        result = flight.grade()
        rows, is_gone = flight.rows if request["table"] else None, connection.is_gone
    except BaseException as error:  # also an unexpected one, such as MemoryError
        try:
            message = format_error(error)
        except Exception:
            message = ""
        reason = f"{type(error).__name__}: {message:.300}".removesuffix(": ")
        result = result_of(plan, script, seed, changes, reason)
    if rows is not None:
        with open(outputs["table"], "w") as file:
            write_table(rows, file)
    with open(outputs["result"], "wb") as file:
        file.write(json.dumps({"result": result.to_json(), "is_gone": is_gone}).encode())


def _read_plan(path: str) -> ReadFile:
    """Return a plan after reading and compiling everything that its flights need. Raises OSError and PlanError."""
    plan = plans.read(path)
    try:
        grade(plan.model_copy(update={"duration": 0.1}), "pilot")  # forks inherit what this reads and compiles
    except Exception:  # a bug of drone_sim; flights work, but each reads and compiles again
        _LOG.warning("a warm-up flight failed: flights will be slower", exc_info=True)
    permissions.free_functions()
    connect_ahead()  # so that forks need not do it
    gc.collect()
    gc.freeze()
    return ReadFile(plan, 1, map(str, plan.files))


if __name__ == "__main__":
    main()
