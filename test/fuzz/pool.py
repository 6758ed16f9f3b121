"""Tries cases in a worker process, and makes a new one where it dies, hangs, or grows."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

from case import Answer, Case

HANGS = 3.0  # s of the processor that a case may take
GROWTH = 800 << 20  # bytes that a case may leave behind; and what a worker may grow by before it is replaced
_BUSY = 6.0  # s of the processor, and
_IDLE = 120.0  # s by the clock, after which nobody waits for it any more
_FIRST = 180.0  # s for the first case: imports, compiling shaders
_SOURCE = Path(__file__).resolve().parents[2] / "src"


class Trier:
    """One worker at a time; not thread-safe."""

    def __init__(self) -> None:
        """Begin without a worker: the first case starts it."""
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Any = None
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as this
        self._resident = self._last = 0

    def run(self, case: Case) -> Answer:
        answer = self._attempt(case)
        if not answer.fault and answer.seconds > HANGS:
            return answer._replace(fault=f"slow: {answer.seconds:.1f} s")
        return answer

    def _attempt(self, case: Case) -> Answer:
        if self._process is None:
            self._open()
        try:
            self._connection.send(case)
            if not self._answers():
                return self._lost("hang: it does not end")
            answer: Answer = self._connection.recv()
        except (EOFError, OSError):
            return self._lost("")
        if not answer.fault and answer.resident > self._last + GROWTH:
            answer = answer._replace(fault=f"memory: grew by {(answer.resident - self._last) >> 20} MB")
        self._last = answer.resident
        if answer.busy or answer.resident > self._resident + GROWTH:
            self.close()  # a script that never ends is left behind in its thread
        return answer

    def _answers(self) -> bool:
        began, end = self._spent(), time.monotonic() + _IDLE
        while not self._connection.poll(0.5):
            if self._spent() > began + _BUSY or time.monotonic() > end:
                return False
        return True

    def _spent(self) -> float:
        """Return how many seconds of the processor the worker has had."""
        assert self._process is not None
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def _open(self) -> None:
        ours, theirs = Pipe()
        self._log.truncate(0)
        paths = os.pathsep.join([str(_SOURCE), os.environ.get("PYTHONPATH", "")])
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("worker.py")), str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=self._log,
            env={
                **os.environ,
                "PYTHONPATH": paths,
                "LP_NUM_THREADS": "0",
                "OMP_NUM_THREADS": "1",
                "OPENBLAS_NUM_THREADS": "1",
            },
        )
        theirs.close()
        self._connection = ours
        ours.send(Case("parameters", {}, {}))  # imports, shaders
        if not ours.poll(_FIRST):
            raise RuntimeError("the worker does not start")
        first: Answer = ours.recv()
        if first.fault:
            raise RuntimeError(f"the default parameters fail: {first.fault}")
        self._resident = self._last = first.resident

    def _lost(self, fault: str) -> Answer:
        assert self._process is not None
        if not fault:
            self._process.wait(_FIRST)
            self._log.seek(0)
            lines = self._log.read().decode("utf-8", "replace").splitlines()
            said = [line for line in lines if "drone_sim/" in line] + lines[-20:]  # faulthandler names our own line
            fault = f"crash: status {self._process.returncode}\n" + "\n".join(said)[:3000]
        self.close()
        return Answer(fault)

    def close(self) -> None:
        """End the worker, however busy it is."""
        if self._process is not None:
            self._connection.close()
            self._process.kill()
            self._process.wait()
            self._process = None
