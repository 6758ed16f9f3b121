"""A task flown from the page: its plan's timeline while its script flies, and the task graded."""

from __future__ import annotations

import atexit
import json
import os
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

_QUEUE = 1000  # messages; every one counts
_STOPPED = "stopped"
_LINGERS = 1.0  # s, for the last messages to go out
_MOST = 180.0  # s of real time; a flight with cameras takes some seconds, and has limits of its own
_PATIENT = 10  # of `nice`: what flies in real time comes first
_SAID = 500  # characters of what went wrong


class TimelinePlayer:
    """Sends the timeline of one plan at a time, some steps late: good enough to watch, not to grade.

    Time is counted in steps, one for each new stamp of odometry: in real time, stamps do not tell the simulated time.
    """

    def __init__(self, node: str):
        """Follow the flights of `node`, the simulation's."""
        self._node = node
        self._lock = threading.Lock()
        self._sender: TimelineSender | None = None
        self._listening: list[rospy.Subscriber] = []

    def prepare(self, plan: Plan | None) -> None:
        """Send nothing more of the last plan, and advertise what the next one needs. Raises Mismatch."""
        self.end()
        if plan is None or not plan.timeline:
            return
        parameters = plan.parameters()
        entries = plan.timeline_of(parameters).entries
        self._step, self._first = parameters.time_step, parameters.first.name
        self._last = max(one.at for one in entries)
        self._sender = TimelineSender(entries, parameters, self._node)

    def begin(self) -> None:
        """Send what has been prepared, from the flight's first step on."""
        with self._lock:
            if self._sender is None:
                return
            self._stamp, self._steps = rospy.Time(), 0
            on_odometry = partial(self._on_odometry, self._sender)
            self._listening = [  # the first of them hears at once what was said last, before this flight
                rospy.Subscriber(f"{self._node}/state", String, self._on_state, queue_size=1),
                rospy.Subscriber(f"/{self._first}/odom", Odometry, on_odometry, queue_size=_QUEUE),
            ]

    def end(self) -> None:
        """Send and hear nothing more; may be called twice."""
        with self._lock:
            for one in self._listening:
                one.unregister()
            if self._sender is not None:
                self._sender.close()
            self._listening, self._sender = [], None

    def _on_odometry(self, sender: TimelineSender, message: Odometry) -> None:
        if message.header.stamp == self._stamp or sender is not self._sender:  # it stands still, or has ended
            return
        self._stamp = message.header.stamp
        self._steps += 1
        sender.send(self._steps * self._step)
        if self._steps * self._step > self._last + _LINGERS:
            self.end()

    def _on_state(self, message: String) -> None:
        if message.data == _STOPPED and self._steps:
            self.end()


class Grader:
    """Grades one script at a time, on seed 0."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._asked = 0
        self._result: dict[str, Any] = {}
        atexit.register(self._kill)

    def start(self, task: str, script: Path) -> int:
        """Begin to grade a script; return the number to ask for it by. Raises ScriptStoreError while one is."""
        with self._lock:
            if self._process is not None:
                raise ScriptStoreError("grade: another script is being graded; it takes some seconds")
            self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_grade_")
            command = ["nice", "-n", str(_PATIENT), sys.executable, "-m", "drone_sim.grading.grade", task, str(script)]
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
            self._asked += 1
            self._result = {}
            threading.Thread(target=self._wait, args=(self._process,), name="grade", daemon=True).start()
            return self._asked

    def result(self, number: Any) -> dict[str, Any]:
        """Return the result of a number, {} while it flies. Raises ScriptStoreError where it is not known any more."""
        if number != self._asked:
            raise ScriptStoreError("grade: another script was graded in the meantime")
        return self._result

    def _wait(self, process: subprocess.Popen[str]) -> None:
        try:
            said = process.communicate(timeout=_MOST)[1]
        except subprocess.TimeoutExpired:
            self._kill()
            process.communicate()
            said = f"it took more than {_MOST:g} s"
        with self._lock, self._folder:
            self._result = _read(Path(self._folder.name) / "result.json", said)
            self._process = None

    def _kill(self) -> None:
        process = self._process
        if process is not None and process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def _read(file: Path, said: str) -> dict[str, Any]:
    """Return what the page shows: how many points of how many, what went wrong, and a row for each criterion."""
    try:
        result = json.loads(file.read_text(encoding="utf-8"))["results"][0]
    except (OSError, ValueError, LookupError):
        return {"error": " ".join(said.split())[:_SAID] or "nothing was graded"}
    keys = ("name", "passed", "points", "of", "said")
    rows = [{key: one[key] for key in keys} for one in result["outcomes"]]
    return {"error": result["error"] or "", "points": result["points"], "of": result["of"], "rows": rows}
