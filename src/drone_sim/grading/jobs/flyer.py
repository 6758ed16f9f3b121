"""The client of the judge's and the script's server, which run each flight in two processes."""

from __future__ import annotations

import json
import os
import socket
from dataclasses import replace
from typing import Any

from drone_sim.files.resources import FileCache, ReadFile
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import script_seed
from drone_sim.grading.jobs import files, sandbox
from drone_sim.grading.jobs.files import Unreadable
from drone_sim.grading.jobs.job import Job, JobResult, lost_flight
from drone_sim.grading.jobs.limited_process import hide_memory
from drone_sim.grading.jobs.server import HANDED_IN
from drone_sim.grading.jobs.server_process import ServerDied, ServerProcess
from drone_sim.grading.jobs.settings import FlightLimits
from drone_sim.grading.result import Result
from drone_sim.scripting.errors import ScriptError

_GRACE = 10.0  # s beyond the limit of a flight's duration
_SCRIPT_GRACE = 5.0  # s by which the script's limit is longer than the judge's, so that the judge reports first
_MAX_PLANS = 8  # in the cache
_ATTEMPTS = 2  # to fly if a server dies, which may have another cause than the flight


class Cancelled(Exception):
    """`Flyer.stop` has cancelled the flight."""


class Flyer:
    """Flies jobs with two servers, which have imported everything and fork a process for each flight.

    The servers start with the first flight. All methods but `stop` belong to one thread.
    """

    def __init__(self, limits: FlightLimits, sandboxed: bool = True):
        """Set the `limits` of a flight, and whether scripts run in the sandbox, which must be available then."""
        self._limits = limits
        self._sandboxed = sandboxed
        if not sandboxed:  # scripts can find this process
            hide_memory()
        self._judge = ServerProcess("judge_server")
        self._scripts = ServerProcess("script_server")
        self._plans: FileCache[plans.Plan] = FileCache(_read_plan, _MAX_PLANS)
        self._is_stopped = False

    def fly(self, job: Job, table: bool = False) -> JobResult:
        """Fly once, whatever the script does. Raises PlanError, Cancelled, and NoSandbox."""
        plan = self._plans.get(job.plan)
        if job.error:
            return lost_flight(job, plan, job.error)
        if self._is_stopped:
            raise Cancelled
        reason = ""
        for _ in range(_ATTEMPTS):
            try:
                reply, rows, end = self._request(plan, job, table)
            except Unreadable as error:
                return lost_flight(job, plan, str(error))
            except ServerDied:
                self.close()
                if self._is_stopped:
                    raise Cancelled from None
                reason = "ended the process that watches its flight"
                continue
            if reply.get("result") is not None and not reply["is_gone"]:
                result = _with_job_path(job, Result.from_json(reply["result"]))
                return JobResult(job, result, rows if result.flown else b"")
            reason = end or reply.get("lost") or "ended its process before the flight was over"
            break
        return lost_flight(job, plan, f"the script {reason}")

    def stop(self) -> None:
        """Make `fly` raise Cancelled from now on. Other threads may call this."""
        self._is_stopped = True
        self._judge.disconnect()
        self._scripts.disconnect()

    def close(self) -> None:
        """Stop both servers, and any flight in progress."""
        self._judge.close()
        self._scripts.close()

    @property
    def folder(self) -> str | None:
        """The folder for temporary files of scripts without a sandbox, or None."""
        return self._scripts.folder

    def _request(self, plan: plans.Plan, job: Job, table: bool) -> tuple[dict[str, Any], bytes, str]:
        """Return the judge's reply, the table, and how the script's process ended by itself, or ''.

        Raises ServerDied, Unreadable and NoSandbox.
        """
        if self._sandboxed:
            sandbox.check_hidden(job.plan)
            sandbox.check_hidden(job.script)
        handed_in = _submitted_files(plan, job) if self._sandboxed else {}
        limits = self._limits.of_flight(plan.duration)
        script_request = {
            "script": f"{HANDED_IN}{job.script}" if handed_in else job.script,
            "handed_in": list(handed_in),
            "random": script_seed(job.seed),
            "limits": {**limits, "real_time": limits["real_time"] + _SCRIPT_GRACE},
        }
        flight = {"plan": job.plan, "script": job.script, "seed": job.seed, "changes": dict(job.changes)}
        judge_request = {**flight, "table": table, "limits": {**limits, "processes": None}}
        self._judge.start()
        self._scripts.start((lambda: sandbox.command(self._limits.files)) if self._sandboxed else None)
        ends = socket.socketpair()
        try:
            self._scripts.send(script_request, ends[0].fileno(), *handed_in.values())
            self._judge.send(judge_request, ends[1].fileno())
        finally:
            for end in ends:
                end.close()
        reply = json.loads(self._judge.receive(limits["real_time"] + _GRACE))
        rows = self._judge.receive(_GRACE)
        ending = self._scripts.end_flight(reply.get("is_gone", False))
        if ending["is_last"]:
            self._scripts.close()
        return reply, rows, ending["end"]


def _read_plan(path: str) -> ReadFile:
    plan = plans.read(path)
    return ReadFile(plan, 1, map(str, plan.files))


def _submitted_files(plan: plans.Plan, job: Job) -> dict[str, bytes]:
    """Return the contents of the files of a job's script by their paths. Raises Unreadable."""
    try:
        return {str(path): files.read(path) for path in files.of_script(plan, job.script)}
    except (OSError, ScriptError) as error:
        raise Unreadable(str(error)) from None


def _with_job_path(job: Job, result: Result) -> Result:
    """Return a result with the script's path of the job instead of the path in the sandbox."""
    folder = os.path.dirname(job.script)
    error = result.error and result.error.replace(f"{HANDED_IN}{folder}", folder)
    return replace(result, script=job.script, error=error)
