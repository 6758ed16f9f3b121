"""Flights, each in two processes of its own: the side that requests them."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from drone_sim.files.resources import FileCache, ReadFile
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import random_of
from drone_sim.grading.jobs import files, sandbox
from drone_sim.grading.jobs.files import Unreadable
from drone_sim.grading.jobs.job import Job, JobResult, lost
from drone_sim.grading.jobs.limited_process import keep_to_itself
from drone_sim.grading.jobs.server import HANDED_IN
from drone_sim.grading.jobs.server_process import ServerDied, ServerProcess
from drone_sim.grading.jobs.settings import FlightLimits
from drone_sim.grading.result import Result
from drone_sim.scripting.errors import ScriptError

_GRACE = 10.0  # s beyond what a flight may take
_LATER = 5.0  # s that a script's process may last longer
_MOST_PLANS = 8  # kept in memory
_TRIES = 2  # of a flight whose processes have died: it may have been somebody else's doing


class Cancelled(Exception):
    """The flight has been cancelled."""


class Flyer:
    """Flies with two servers, the judge's and the script's; with everything imported, they fork a process per flight.

    They start when they are needed. One thread uses this, and closes it.
    """

    def __init__(self, limits: FlightLimits, sandboxed: bool = True):
        """Start nothing yet. `limits`: of a flight; `sandboxed`: scripts are in the sandbox, which must be there."""
        self._limits = limits
        self._sandboxed = sandboxed
        if not sandboxed:  # a script might look for this process
            keep_to_itself()
        self._judge = ServerProcess("judge_server")
        self._scripts = ServerProcess("script_server")
        self._plans: FileCache[plans.Plan] = FileCache(_read_plan, _MOST_PLANS)
        self._is_stopped = False

    def fly(self, job: Job, table: bool = False) -> JobResult:
        """Fly once, whatever the script does. Raises PlanError, Cancelled, and NoSandbox where one is wanted."""
        plan = self._plans.get(job.plan)
        if job.error:
            return lost(job, plan, job.error)
        why = ""
        if self._is_stopped:
            raise Cancelled
        for _ in range(_TRIES):
            try:
                reply, rows, end = self._ask(plan, job, table)
            except Unreadable as error:
                return lost(job, plan, str(error))
            except ServerDied:
                self.close()
                if self._is_stopped:
                    raise Cancelled from None
                why = "ended the process that watches its flight"
                continue
            if reply.get("result") is not None and not reply["is_gone"]:
                result = _as_asked(job, Result.from_json(reply["result"]))
                return JobResult(job, result, rows if result.flown else b"")
            why = end or reply.get("lost") or "ended its process before the flight was over"
            break
        return lost(job, plan, f"the script {why}")

    def stop(self) -> None:
        """Let `fly` raise Cancelled, now and from now on; called by another thread."""
        self._is_stopped = True
        self._judge.cut()
        self._scripts.cut()

    def close(self) -> None:
        """End both servers, and any flight in progress."""
        self._judge.close()
        self._scripts.close()

    @property
    def folder(self) -> str | None:
        """Where scripts that run without a sandbox have their temporary files, while there is such a place."""
        return self._scripts.folder

    def _ask(self, plan: plans.Plan, job: Job, table: bool) -> tuple[dict[str, Any], bytes, str]:
        """Return the judge's reply, the table, and how the script's process ended ('': it was no longer needed).

        Raises ServerDied, Unreadable and NoSandbox.
        """
        handed_in = _handed_in(plan, job) if self._sandboxed else {}
        script, judge = self._script_request(job, plan.duration, handed_in), self._judge_request(job, plan, table)
        self._start()
        patience = judge["limits"]["real_time"] + _GRACE
        ends = socket.socketpair()
        try:
            self._scripts.send(script, ends[0].fileno(), *handed_in.values())
            self._judge.send(judge, ends[1].fileno())
        finally:
            for one in ends:
                one.close()
        reply, rows = json.loads(self._judge.receive(patience)), self._judge.receive(_GRACE)
        ended = self._scripts.end(reply.get("is_gone", False))
        if ended["is_last"]:
            self._scripts.close()
        return reply, rows, ended["end"]

    def _start(self) -> None:
        """Have both processes. Raises ServerDied and NoSandbox."""
        self._judge.start()
        self._scripts.start((lambda: sandbox.command(self._limits.files)) if self._sandboxed else None)

    def _limits_of(self, duration: float) -> dict[str, Any]:
        own = self._limits
        return {
            "seconds": own.processor_time(duration),
            "real_time": own.real_time(duration),
            **own.model_dump(include={"memory", "files", "processes", "open_files"}),
        }

    def _script_request(self, job: Job, duration: float, handed_in: Mapping[str, bytes]) -> dict[str, Any]:
        script = f"{HANDED_IN}{job.script}" if handed_in else job.script
        limits = self._limits_of(duration)
        limits["real_time"] += _LATER  # by then the judge has said what was wrong
        return {"script": script, "handed_in": list(handed_in), "random": random_of(job.seed), "limits": limits}

    def _judge_request(self, job: Job, plan: plans.Plan, table: bool) -> dict[str, Any]:
        asked = {"plan": job.plan, "script": job.script, "seed": job.seed, "changes": dict(job.changes)}
        return {**asked, "table": table, "limits": {**self._limits_of(plan.duration), "processes": None}}


def _read_plan(path: str) -> ReadFile:
    plan = plans.read(path)
    return ReadFile(plan, 1, map(str, plan.files))


def _handed_in(plan: plans.Plan, job: Job) -> dict[str, bytes]:
    """Return the files of a job's script. Raises Unreadable."""
    try:
        return {str(path): files.read(path) for path in files.of_script(plan, job.script)}
    except (OSError, ScriptError) as error:
        raise Unreadable(str(error)) from None


def _as_asked(job: Job, result: Result) -> Result:
    """Return a result that names the script where it lies, not where it was flown."""
    folder = os.path.dirname(job.script)
    error = result.error and result.error.replace(f"{HANDED_IN}{folder}", folder)
    return replace(result, script=job.script, error=error)
