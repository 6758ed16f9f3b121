"""A task graded from the page: `grade` in a process of its own, of low priority, which ends in a bounded time."""

from __future__ import annotations

import atexit
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

from drone_sim.ros.cockpit.scripts.script_files import ShelfError

_MOST = 180.0  # s of real time; a flight with cameras takes some seconds, and has limits of its own
_PATIENT = 10  # of `nice`: what flies in real time comes first
_SAID = 500  # characters of what went wrong


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
        """Begin to grade a script; return the number to ask for it by. Raises ShelfError while one is."""
        with self._lock:
            if self._process is not None:
                raise ShelfError("grade: another script is being graded; it takes some seconds")
            self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_grade_")
            command = [
                sys.executable,
                "-m",
                "drone_sim.grading.grade",
                task,
                str(script),
                "--seeds",
                "1",
                "--jobs",
                "1",
            ]
            outputs = ["--json", f"{self._folder.name}/result.json", "--results", self._folder.name]
            self._process = subprocess.Popen(
                ["nice", "-n", str(_PATIENT), *command, *outputs],
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
        """Return the result of a number, {} while it flies. Raises ShelfError where it is not known any more."""
        if number != self._asked:
            raise ShelfError("grade: another script has been graded since")
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
