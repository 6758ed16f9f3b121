"""Runner of cases in a worker process, which is replaced if it dies, hangs, or grows."""

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

HANGS = 3.0  # s of processor time that a case may take
GROWTH = 800 << 20  # bytes that a case may leave allocated, and growth of a worker before it is replaced
_BUSY = 6.0  # s of processor time, and
_IDLE = 120.0  # s of wall time, after which a case counts as hung
_FIRST = 180.0  # s for the first case: imports, compiling shaders
_SOURCE = Path(__file__).resolve().parents[2] / "src"


class Trier:
    """Runner with one worker at a time; not thread-safe."""

    def __init__(self) -> None:
        """Start without a worker: the first case starts one."""
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
            if not self._has_answer():
                return self._close_with_fault("hang: it does not end")
            answer: Answer = self._connection.recv()
        except (EOFError, OSError):
            return self._close_with_fault("")
        if not answer.fault and answer.resident > self._last + GROWTH:
            answer = answer._replace(fault=f"memory: grew by {(answer.resident - self._last) >> 20} MB")
        self._last = answer.resident
        if answer.busy or answer.resident > self._resident + GROWTH:
            self.close()  # a script that never ends still runs in its thread
        return answer

    def _has_answer(self) -> bool:
        start, end = self._processor_time(), time.monotonic() + _IDLE
        while not self._connection.poll(0.5):
            if self._processor_time() > start + _BUSY or time.monotonic() > end:
                return False
        return True

    def _processor_time(self) -> float:
        """Return the processor time of the worker (s)."""
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

    def _close_with_fault(self, fault: str) -> Answer:
        assert self._process is not None
        if not fault:
            self._process.wait(_FIRST)
            self._log.seek(0)
            lines = self._log.read().decode("utf-8", "replace").splitlines()
            log_lines = [line for line in lines if "drone_sim/" in line] + lines[-20:]  # our code in faulthandler
            fault = f"crash: status {self._process.returncode}\n" + "\n".join(log_lines)[:3000]
        self.close()
        return Answer(fault)

    def close(self) -> None:
        """Kill the worker, even if it is busy."""
        if self._process is not None:
            self._connection.close()
            self._process.kill()
            self._process.wait()
            self._process = None
