"""The loop of this checkout against that of another revision, in turns on one core: ratios, not times, are compared."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from benchmarks.cores import one_core
from benchmarks.loop_worker import FLIGHTS

Row = dict[str, Any]
ROOT = Path(__file__).parents[1]
ROUNDS = 200  # short turns: other programs disturb both sides alike


def compare(revision: str, rounds: int = ROUNDS) -> list[Row]:
    """Return for each flight the step times (us) in the quietest turn, and the median, p10 and p90 of their ratio.

    A ratio below 1 means that this checkout is faster. Raises subprocess.CalledProcessError for an unknown revision.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        archive = subprocess.run(["git", "archive", revision], cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
        subprocess.run(["tar", "-xC", folder], input=archive, check=True)
        stack.enter_context(one_core())
        return [_compare_flight(flight, folder, rounds) for flight in FLIGHTS]


def _compare_flight(flight: str, other: Path, rounds: int) -> Row:
    with ExitStack() as stack:
        workers = [stack.enter_context(_worker(flight, tree)) for tree in (other, ROOT)]
        for worker in workers:
            _ask(worker)  # "ready"
        before, now = zip(*([float(_ask(worker, "time")) for worker in workers] for _ in range(rounds)))
    ratios = sorted(new / old for old, new in zip(before, now))
    low, high = ratios[len(ratios) // 10], ratios[-1 - len(ratios) // 10]
    times = {"before_us": 1e6 * min(before), "now_us": 1e6 * min(now)}
    return {"name": flight, **times, "ratio": statistics.median(ratios), "p10": low, "p90": high}


def _worker(flight: str, tree: Path) -> subprocess.Popen[str]:
    path = f"{tree / 'src'}:{os.environ.get('PYTHONPATH', '')}"
    command = [sys.executable, str(Path(__file__).with_name("loop_worker.py")), flight]
    return subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": path}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def _ask(worker: subprocess.Popen[str], line: str = "") -> str:
    """Send a line, unless it is empty; return the next line of the answer that is not PyBullet's."""
    assert worker.stdin is not None and worker.stdout is not None
    if line:
        worker.stdin.write(f"{line}\n")
        worker.stdin.flush()
    for answer in worker.stdout:
        if not answer.startswith("pybullet build time"):
            return answer
    raise RuntimeError("a worker of the benchmark has ended: its traceback is above")
