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

from drone_sim.grading.jobs.job import count_results
from drone_sim.grading.plan import Plan
from drone_sim.offline.timeline import Entry, ScriptRequest
from drone_sim.ros.cockpit.editor.script_store import ScriptStoreError
from drone_sim.ros.cockpit.server.access_control import Content
from drone_sim.ros.cockpit.server.page_server import find_below
from drone_sim.ros.grading.timeline_sender import TimelineSender

_QUEUE = 1000  # messages; none may be lost, since they are counted
_STOPPED = "stopped"
_LINGER = 1.0  # s after the last entry, so that its messages are sent
_SEEDS = 3  # flights of one grade
_TIMEOUT = 300.0  # s of real time; a flight with cameras takes some seconds, and has its own limits
_NICENESS = 10  # the flight in real time has priority
_MAX_ERROR = 500  # characters
_HEARS_ALL = "pilot"  # the built-in script, which others import
_REPORT = "report"  # the folder of `grade --html`, in that of the results
_REPORT_URL = "/graded/"


class TimelinePlayer:
    """Publisher of the timeline of one plan at a time, some steps late: good enough to watch, not to grade.

    Simulated time is the number of odometry messages with a new stamp: in real time, stamps are not simulated time.
    """

    def __init__(self, node: str):
        self._node = node
        self._lock = threading.Lock()
        self._sender: TimelineSender | None = None
        self._subscribers: list[rospy.Subscriber] = []

    def prepare(self, plan: Plan | None, script: str = "") -> None:
        """Replace the plan and advertise its topics; None for no plan. Raises Mismatch.

        Requests that the text of the `script` does not name are left out: if the script did not subscribe to them, each
        would log a warning.
        """
        self.end()
        if plan is None:
            return
        parameters = plan.parameters()
        entries = [entry for entry in plan.timeline_of(parameters).entries if _is_named(entry, script)]
        if not entries:
            return
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
    """Grading of one script at a time, with the first seeds, in a child process, which also writes its report."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        # A page that was open while an earlier cockpit ran may ask for a grade of that one.
        self._number = secrets.randbelow(1 << 30)
        self._result: dict[str, Any] = {}
        self.best: dict[str, tuple[float, float]] = {}  # points, and how many there are, of each task's best run
        self._folder: tempfile.TemporaryDirectory[str] | None = None  # of the last run: its results and its report
        atexit.register(self._kill)

    def start(self, task: str, script: Path) -> int:
        """Begin to grade a script; return the run's number. Raises ScriptStoreError if another run has not ended."""
        with self._lock:
            if self._process is not None:
                raise ScriptStoreError("grade: another script is being graded; it takes some seconds")
            if self._folder is not None:
                self._folder.cleanup()
            self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_grade_")
            folder = self._folder.name
            command = ["nice", "-n", str(_NICENESS), sys.executable, "-m", "drone_sim.grading.grade", task, str(script)]
            command += ["--seeds", str(_SEEDS), "--jobs", "1", "--results", folder]
            command += ["--json", f"{folder}/result.json", "--html", f"{folder}/{_REPORT}"]
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
            arguments = task, self._process, Path(folder)
            threading.Thread(target=self._wait, args=arguments, name="grade", daemon=True).start()
            return self._number

    def result(self, number: Any) -> dict[str, Any]:
        """Return the result of a run, until it has ended the number of finished `flights` of all `seeds`.

        Raises ScriptStoreError if a later run replaced it.
        """
        if number != self._number or self._folder is None:
            raise ScriptStoreError("grade: another script was graded in the meantime")
        return self._result or {"flights": count_results(Path(self._folder.name)), "seeds": _SEEDS}

    def report_file(self, path: str) -> Content:
        """Return content type and content of a file of the last run's report by its URL; None if there is none."""
        folder = self._folder
        if folder is None or not path.startswith(_REPORT_URL):
            return None
        return find_below(Path(folder.name) / _REPORT, path.removeprefix(_REPORT_URL))

    def _wait(self, task: str, process: subprocess.Popen[str], folder: Path) -> None:
        try:
            errors = process.communicate(timeout=_TIMEOUT)[1]
        except subprocess.TimeoutExpired:
            self._kill()
            process.communicate()
            errors = f"it took more than {_TIMEOUT:g} s"
        with self._lock:
            self._result = _read_result(folder, errors)
            if not self._result["problem"]:
                result = float(self._result["points"]), float(self._result["of"])
                self.best[task] = max(result, self.best.get(task, result))
            self._process = None

    def _kill(self) -> None:
        process = self._process
        if process is not None and process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def _is_named(entry: Entry, script: str) -> bool:
    """Return whether the text of a script names the topic of an entry that is a request; True for all other entries.

    The simulator does not tell which requests a script subscribes to. `pilot` subscribes to all of them. A request that
    only a module of the user's names is not sent.
    """
    action = entry.action
    if not isinstance(action, ScriptRequest):
        return True
    return _HEARS_ALL in script or f'"{action.topic}"' in script.replace("'", '"')


def _read_result(folder: Path, errors: str) -> dict[str, Any]:
    """Return the result for the page, or only a `problem`, a line that says why nothing was graded; otherwise it is ''.

    The key is not `error`, because a reply with that key means that the request itself has failed. `cards` are the
    result cards of the flights as HTML; `page` is the report's page, which has the replay of each.
    """
    try:
        content = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        (script,), results = content["scripts"], content["results"]
        (page,) = (folder / _REPORT).glob("scripts/*/index.html")
        cards = [(page.parent / f"flights/{key}.html").read_text(encoding="utf-8") for key in range(len(results))]
    except (OSError, ValueError, LookupError):
        return {"problem": " ".join(errors.split())[:_MAX_ERROR] or "nothing was graded"}
    return {
        "problem": "",
        "points": script["points"],
        "of": script["of"],
        "flights": [{key: result[key] for key in ("seed", "passed", "points", "of")} for result in results],
        "cards": cards,
        "page": f"{_REPORT_URL[1:]}{page.relative_to(folder / _REPORT)}",
    }
