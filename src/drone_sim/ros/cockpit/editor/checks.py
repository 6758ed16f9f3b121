"""Checks of a script while the user types, in a separate process with a time limit."""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
import sys
import threading
from typing import Any

from drone_sim.scripting.checking import LARGEST, Finding

_TIMEOUT = 5.0  # s for a check
_FIRST_TIMEOUT = 30.0  # s for the first one, which imports the API
_TOO_LARGE = f"is larger than {LARGEST} bytes, so it is not checked while you type"
_NO_ANSWER = "this text takes too long to check while you type"


class TextChecker:
    """Client of a checking process, which starts with the first check and is replaced after a timeout."""

    def __init__(self, timeout: float = _TIMEOUT):
        self._timeout = timeout
        self._process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()  # several browsers may ask at once

    def check(self, text: str, is_lua: bool) -> dict[str, Any]:
        """Return the findings in a text, or the reason why it is `unchecked`, as JSON-compatible values."""
        if len(text.encode("utf-8", "replace")) > LARGEST:
            return {"found": [], "unchecked": _TOO_LARGE}
        request = json.dumps({"text": text, "lua": is_lua})
        with self._lock:
            reply = self._call(request)
        if not reply:
            return {"found": [], "unchecked": _NO_ANSWER}
        return {"found": [Finding(*fields)._asdict() for fields in json.loads(reply)]}

    def _call(self, request: str) -> str:
        """Return the process's reply, one line; '' if it did not reply in time."""
        is_first = self._process is None
        if self._process is None:
            command = [sys.executable, "-m", "drone_sim.scripting.checking"]
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
            )
        process, reply = self._process, ""
        assert process.stdin is not None and process.stdout is not None
        with contextlib.suppress(OSError):  # the process has ended
            process.stdin.write(f"{request}\n")
            process.stdin.flush()
            timeout = _FIRST_TIMEOUT if is_first else self._timeout
            if select.select([process.stdout], [], [], timeout)[0]:
                reply = process.stdout.readline()
        if not reply:
            self.close()
        return reply

    def close(self) -> None:
        """End the process; the next check starts another one."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
