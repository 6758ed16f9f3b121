"""Errors while somebody types: the texts of scripts, checked by a process of its own within a time limit."""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
import sys
import threading
from typing import Any

from drone_sim.scripting.checking.findings import LARGEST, Finding

_SECONDS = 5.0  # that a check may take
_FIRST_SECONDS = 30.0  # of the first one, which reads the API
_TOO_LARGE = f"is larger than {LARGEST} bytes, so it is not checked while you type"
_NO_ANSWER = "this text takes too long to check while you type"


class TextChecker:
    """Asks a process, which begins with the first question and is replaced where it does not answer in time."""

    def __init__(self, seconds: float = _SECONDS):
        """`seconds` are how long a check may take."""
        self._seconds = seconds
        self._process: subprocess.Popen[str] | None = None
        self._turn = threading.Lock()  # several browsers may ask at once

    def check(self, text: str, is_lua: bool) -> dict[str, Any]:
        """Return what is wrong with a text, or why that is not known, as JSON takes it."""
        if len(text.encode("utf-8", "replace")) > LARGEST:
            return {"found": [], "unchecked": _TOO_LARGE}
        question = json.dumps({"text": text, "lua": is_lua})
        with self._turn:
            line = self._asked(question)
        if not line:
            return {"found": [], "unchecked": _NO_ANSWER}
        return {"found": [Finding(*one)._asdict() for one in json.loads(line)]}

    def _asked(self, question: str) -> str:
        """Return a line of answer, '' for none."""
        is_first = self._process is None
        if self._process is None:
            command = [sys.executable, "-m", "drone_sim.scripting.checking.worker"]
            self._process = subprocess.Popen(  # its errors are of nobody's interest but of who looks into them
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
            )
        line = ""
        with contextlib.suppress(OSError):  # it has ended
            line = self._line(self._process, question, _FIRST_SECONDS if is_first else self._seconds)
        if not line:
            self.close()
        return line

    def _line(self, process: subprocess.Popen[str], question: str, seconds: float) -> str:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(f"{question}\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], seconds)
        return process.stdout.readline() if ready else ""

    def close(self) -> None:
        """End the process; the next question begins another one."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
