"""Graded flights of 30 s without a camera, each in a process of its own with all limits: how many a second."""

import contextlib
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from drone_sim.grading import plan as plans
from drone_sim.grading.jobs import pool, sandbox, settings
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.jobs.pool import FlightOptions, Fly

Row = dict[str, Any]
FLIGHTS = 1000
PLAN = """
duration: 30.0
spread: {position: [0.2, 0.2, 0.1], yaw: 0.3}
timeline:
  - {at: 1.0, twist: {linear: [1, 0, 0]}}
  - {at: 8.0, twist: {angular: [0, 0, 0.5]}}
  - {at: 15.0, twist: {linear: [0, -1, 0.2]}}
  - {at: 22.0, twist: {}}
criteria:
  - {kind: rise_time, of: vx, after: 1.0, from: 0.0, to: 1.0, at_most: 1.0}
  - {kind: attitude, at_most: 0.8}
  - {kind: no_contact}
"""


def _flight_options() -> FlightOptions:
    numbers = settings.load()
    try:
        sandbox.command(1)
        return FlightOptions(numbers.limits, numbers.batches)
    except sandbox.NoSandbox as why:
        print(f"  without a sandbox: {why}", file=sys.stderr, flush=True)
        return FlightOptions(numbers.limits, numbers.batches, sandboxed=False)


def _jobs(folder: str) -> list[Job]:
    path = Path(folder) / "steps.yaml"
    path.write_text(PLAN)
    contents = contents_of(plans.read(path), "")
    return [Job(str(path), "", seed, {}, key_of(contents, seed, {})) for seed in range(FLIGHTS)]


def _fly(name: str, jobs: list[Job], fly: Fly, began: float) -> Row:
    print(f"  {len(jobs)} flights, {name}", file=sys.stderr, flush=True)
    results = {flight.job.seed: flight.result for flight in fly(jobs)}
    took = time.perf_counter() - began
    told = json.dumps([results[job.seed].to_json() for job in jobs])
    return {
        "name": f"{len(jobs)} flights of 30 s, {name}",
        "seconds": took,
        "flights_per_s": len(jobs) / took,
        "passed": sum(one.passed for one in results.values()),
        "results": hashlib.sha256(told.encode()).hexdigest()[:12],  # the same to the bit, or not
    }


@contextlib.contextmanager
def _cluster(workers: int) -> Iterator[str]:
    """A scheduler and workers, each a process of its own, as on several hosts; give the address."""
    from distributed import Client, LocalCluster

    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-m", "dask", "worker", "--no-dashboard", "--no-nanny", "--nthreads", "1"]
    with LocalCluster(n_workers=0, dashboard_address=None, silence_logs=50) as cluster:
        address = cluster.scheduler_address
        running = [
            subprocess.Popen([*command, address], env=environment, stderr=subprocess.DEVNULL) for _ in range(workers)
        ]
        try:
            with Client(address) as client:
                client.wait_for_workers(workers, timeout=60)
            yield address
        finally:
            for one in running:
                one.terminate()
                one.wait(60)


def measure() -> list[Row]:
    """Return all rows; `seconds` are from nothing running to the last result."""
    options = _flight_options()
    cores = len(os.sched_getaffinity(0))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        jobs = _jobs(folder)
        for workers in dict.fromkeys((1, 2, cores)):
            began = time.perf_counter()
            with pool.open_pool(options, workers) as fly:
                rows.append(_fly(f"{workers} at a time", jobs, fly, began))
        with _cluster(2) as address:
            began = time.perf_counter()
            with pool.open_pool(options, scheduler=address) as fly:
                rows.append(_fly("2 Dask workers", jobs, fly, began))
    return rows
