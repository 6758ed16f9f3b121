"""Tasks in the cockpit: the timeline of a task during a flight, and the grading of a script."""

from __future__ import annotations

import atexit
import json
import os
import secrets
import signal
import subprocess
import sys
import tempfile
import threading
from functools import partial
from pathlib import Path
from typing import Any

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from drone_sim.grading.plan import Plan
from drone_sim.ros.cockpit.editor.script_store import ScriptStoreError
from drone_sim.ros.grading.timeline_sender import TimelineSender

_QUEUE = 1000  # messages; none may be lost, since they are counted
_STOPPED = "stopped"
_LINGER = 1.0  # s after the last entry, so that its messages are sent
_TIMEOUT = 180.0  # s of real time; a flight with cameras takes some seconds, and has its own limits
_NICENESS = 10  # the flight in real time has priority
_MAX_ERROR = 500  # characters


class TimelinePlayer:
    """Publisher of the timeline of one plan at a time, some steps late: good enough to watch, not to grade.

    Simulated time is the number of odometry messages with a new stamp: in real time, stamps are not simulated time.
    """

    def __init__(self, node: str):
        """`node` is the simulator's name."""
        self._node = node
        self._lock = threading.Lock()
        self._sender: TimelineSender | None = None
        self._subscribers: list[rospy.Subscriber] = []

    def prepare(self, plan: Plan | None) -> None:
        """Replace the plan and advertise its topics; None for no plan. Raises Mismatch."""
        self.end()
        if plan is None or not plan.timeline:
            return
        parameters = plan.parameters()
        entries = plan.timeline_of(parameters).entries
        self._step, self._first = parameters.time_step, parameters.first.name
        self._last = max(entry.at for entry in entries)
        self._sender = TimelineSender(entries, parameters, self._node)

    def begin(self) -> None:
        """Publish the timeline from the first step of the flight on."""
        with self._lock:
            if self._sender is None:
                return
            self._stamp, self._steps = rospy.Time(), 0
            on_odometry = partial(self._on_odometry, self._sender)
            self._subscribers = [  # the state is latched: its first message is from before this flight
                rospy.Subscriber(f"{self._node}/state", String, self._on_state, queue_size=1),
                rospy.Subscriber(f"/{self._first}/odom", Odometry, on_odometry, queue_size=_QUEUE),
            ]

    def end(self) -> None:
        """Stop publishing; may be called twice."""
        with self._lock:
            for subscriber in self._subscribers:
                subscriber.unregister()
            if self._sender is not None:
                self._sender.close()
            self._subscribers, self._sender = [], None

    def _on_odometry(self, sender: TimelineSender, message: Odometry) -> None:
        if message.header.stamp == self._stamp or sender is not self._sender:  # paused, or ended
            return
        self._stamp = message.header.stamp
        self._steps += 1
        sender.send(self._steps * self._step)
        if self._steps * self._step > self._last + _LINGER:
            self.end()

    def _on_state(self, message: String) -> None:
        if message.data == _STOPPED and self._steps:
            self.end()


class Grader:
    """Grading of one script at a time, with seed 0, in a child process."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        # A page that was open while an earlier cockpit ran may ask for a grade of that one.
        self._number = secrets.randbelow(1 << 30)
        self._result: dict[str, Any] = {}
        atexit.register(self._kill)

    def start(self, task: str, script: Path) -> int:
        """Begin to grade a script; return the run's number. Raises ScriptStoreError if another run has not ended."""
        with self._lock:
            if self._process is not None:
                raise ScriptStoreError("grade: another script is being graded; it takes some seconds")
            self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_grade_")
            command = ["nice", "-n", str(_NICENESS), sys.executable, "-m", "drone_sim.grading.grade", task, str(script)]
            command += ["--seeds", "1", "--jobs", "1", "--results", self._folder.name]
            command += ["--json", f"{self._folder.name}/result.json"]
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                start_new_session=True,
            )
            self._number += 1
            self._result = {}
            threading.Thread(target=self._wait, args=(self._process,), name="grade", daemon=True).start()
            return self._number

    def result(self, number: Any) -> dict[str, Any]:
        """Return the result of a run, {} until it has ended. Raises ScriptStoreError if a later run replaced it."""
        if number != self._number:
            raise ScriptStoreError("grade: another script was graded in the meantime")
        return self._result

    def _wait(self, process: subprocess.Popen[str]) -> None:
        try:
            errors = process.communicate(timeout=_TIMEOUT)[1]
        except subprocess.TimeoutExpired:
            self._kill()
            process.communicate()
            errors = f"it took more than {_TIMEOUT:g} s"
        with self._lock, self._folder:
            self._result = _read_result(Path(self._folder.name) / "result.json", errors)
            self._process = None

    def _kill(self) -> None:
        process = self._process
        if process is not None and process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def _read_result(file: Path, errors: str) -> dict[str, Any]:
    """Return the result for the page: points, their maximum, a row for each criterion, and a problem ('' for none).

    The problem's key is not `error`, because a reply with that key means that the request itself has failed.
    """
    try:
        result = json.loads(file.read_text(encoding="utf-8"))["results"][0]
    except (OSError, ValueError, LookupError):
        return {"problem": " ".join(errors.split())[:_MAX_ERROR] or "nothing was graded"}
    keys = ("name", "passed", "points", "of", "said")
    rows = [{key: outcome[key] for key in keys} for outcome in result["outcomes"]]
    return {"problem": result["error"] or "", "points": result["points"], "of": result["of"], "rows": rows}
