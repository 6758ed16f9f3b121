#!/usr/bin/env python3
"""`./dev.sh soak-web [MINUTES] [--seed N] [roslaunch args]`: the cockpit, and browsers that come and go.

Chromium now and then, where it is installed, and several clients that speak as the page does: they fly, watch a
camera, press buttons and write scripts; some vanish while they hold a key, some take nothing of what they are sent.
Every minute a line on cockpit and simulation. Exit status 1 where one of them died or grew, a traceback was printed,
or the cockpit still listens after the last browser has gone.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

from measure import MOST_MORE, Sample, growth, last_half, late_steps, slope
from run import ENDS, STARTS, Launch

OFTEN, EVERY = 10.0, 60.0  # s between two samples, and between two lines
LIMITS = (0.3, 6.0, 300.0)  # arguments of growth()
SETTLES = 5.0  # s until the cockpit has found the vehicle, and may command it
QUIET = 90.0  # s after the last browser until the cockpit has unsubscribed: it drops a deaf client after 40
HERE = Path(__file__).parent
NODES = ("cockpit", "drone_sim")


def take_sample(pid: int, node: str) -> Sample:
    """Return a sample of a node; memory is its proportional set size. Raises OSError if it has died."""
    folder = Path(f"/proc/{pid}")
    share = re.search(r"^Pss:\s+(\d+)", (folder / "smaps_rollup").read_text(), re.MULTILINE)
    threads, descriptors = len(os.listdir(folder / "task")), len(os.listdir(folder / "fd"))
    memory = int(share[1]) * 1024 / 1e6 if share else 0.0
    return Sample(time.monotonic(), memory, threads, descriptors, registrations(node))


def registrations(node: str) -> int:
    """Return the number of topics and services that a node has registered with the master."""
    state: Any = ServerProxy(os.environ["ROS_MASTER_URI"]).getSystemState("/soak")
    return sum(f"/{node}" in names for kind in state[2] for _, names in kind)


def pid_of(node: str) -> int:
    answer: Any = ServerProxy(os.environ["ROS_MASTER_URI"]).lookupNode("/soak", f"/{node}")
    process: Any = ServerProxy(answer[2]).getPid("/soak")
    return int(process[2])


def address(launch: Launch) -> str:
    end = time.monotonic() + STARTS
    while time.monotonic() < end:
        for line in launch.lines:
            found = re.search(r"the cockpit is at (\S+)", line)
            if found:
                return found[1]
        time.sleep(0.1)
    raise SystemExit("the cockpit does not start:\n" + "\n".join(launch.lines[-20:]))


@contextlib.contextmanager
def browsers(cockpit_address: str, seed: int, folder: Path) -> Iterator[list[subprocess.Popen]]:
    """Run browsers at the cockpit, with lower priority than the nodes."""
    programs = ["browsers.py"]
    if shutil.which("chromium") and importlib.util.find_spec("playwright"):
        programs.append("chromium.py")
    else:
        print("no chromium, or no playwright (./dev.sh test-web installs both): the browsers are Python alone")
    processes = []
    for program in programs:
        command = ["nice", "-n", "10", sys.executable, str(HERE / program), cockpit_address, str(seed), str(folder)]
        with (folder / f"{program}.log").open("w") as log:
            processes.append(subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, start_new_session=True))
    try:
        yield processes
    finally:
        for one in processes:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(one.pid, signal.SIGKILL)
            one.wait()


def soak(launch: Launch, pids: dict[str, int], folder: Path, minutes: float) -> dict[str, list[Sample]]:
    """Sample the nodes for `minutes`, and print a line every minute; return the samples of each node."""
    start_time = time.monotonic()
    samples: dict[str, list[Sample]] = {node: [] for node in NODES}
    next_report = start_time + EVERY
    with contextlib.suppress(OSError):
        while time.monotonic() < start_time + 60 * minutes:
            time.sleep(OFTEN)
            for node, pid in pids.items():
                samples[node].append(take_sample(pid, node))
            if time.monotonic() > next_report:
                next_report += EVERY
                print(line(samples, launch, diary(folder), time.monotonic() - start_time), flush=True)
    return samples


def diary(folder: Path) -> list[Any]:
    """Return all visits: role, time until the scene was loaded (s), error."""
    lines = [one for path in folder.glob("*.jsonl") for one in path.read_text(encoding="utf-8").splitlines()]
    return [json.loads(one) for one in lines]


def line(samples: dict[str, list[Sample]], launch: Launch, visits: list[Any], time_: float) -> str:
    parts = [f"{time_ / 60:5.1f} min"]
    for node, states in samples.items():
        _, memory, threads, descriptors, registered = states[-1]
        grows = slope(last_half(states))
        parts.append(
            f"{node} {memory:6.1f} MB {grows:+5.2f} MB/min {threads:3d} threads {descriptors:3d} descriptors "
            f"{registered:3d} registrations"
        )
    return "   ".join([*parts, f"{late_steps(launch.lines)} late   {len(visits)} visits"])


def quiet(pid: int, before: Sample) -> list[str]:
    """Wait until the cockpit has no more subscriptions than before the first browser; return the failure."""
    end = time.monotonic() + QUIET
    while time.monotonic() < end:
        now = take_sample(pid, "cockpit")
        if now.registrations <= before.registrations and now.threads <= before.threads + MOST_MORE:
            return []
        time.sleep(1.0)
    return [f"nobody looks, and the cockpit has {now}; it began with {before}"]


def dead(pids: dict[str, int], launch: Launch) -> list[str]:
    """Return the nodes that have died, and the last lines of output."""
    found = [f"{node} died" for node, pid in pids.items() if not Path(f"/proc/{pid}/exe").exists()]
    return [*found, "printed last:", *launch.lines[-10:]] if found else []


def verdict(launch: Launch, samples: dict[str, list[Sample]], visits: list[Any]) -> list[str]:
    """Print statistics of the visits; return the failures."""
    done = [one for one in visits if not one[2]]
    for role in sorted({one[0] for one in visits}):
        load_times = [one[1] for one in done if one[0] == role]
        early, late = load_times[: len(load_times) // 3 + 1], load_times[-(len(load_times) // 3 + 1) :]
        if load_times:
            waits = f"{statistics.median(early):.2f} s at first, {statistics.median(late):.2f} s in the end"
            print(f"{role}: {len(load_times)} visits; until the scene had come {waits}")
    for role, _, trouble in [one for one in visits if one[2]][:10]:
        print(f"{role}: {trouble[:200]}")
    printed = [f"printed: {one[:200]}" for one in launch.lines if "Traceback" in one]
    return [*printed[:5], *(f"{node}: {one}" for node, states in samples.items() for one in growth(states, *LIMITS))]


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="./dev.sh soak-web", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("minutes", nargs="?", type=float, default=10.0, help="how long (default: 10)")
    parser.add_argument("--seed", type=int, default=0, help="of what the browsers do (default: 0)")
    options, arguments = parser.parse_known_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # and clean up
    folder = Path(tempfile.mkdtemp(prefix="soak"))
    try:
        with Launch(folder, ["web:=true", *arguments]) as launch:
            cockpit_address = address(launch)
            time.sleep(SETTLES)
            pids = {node: pid_of(node) for node in NODES}
            before = take_sample(pids["cockpit"], "cockpit")
            with browsers(cockpit_address, options.seed, folder) as processes:
                samples = soak(launch, pids, folder, options.minutes)
                found = [f"a client of the soak ended: {one.args}" for one in processes if one.poll() is not None]
            found += dead(pids, launch) or quiet(pids["cockpit"], before)
            found += verdict(launch, samples, diary(folder))
            duration = launch.end()
            found += [f"the node took {duration:.1f} s to end"] if duration > ENDS else []
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    log = HERE.parents[1] / "build" / "soak_web.log"
    log.write_text("\n".join(launch.lines), encoding="utf-8")
    print(f"what the nodes printed is in {log}", *found, "something broke" if found else "nothing broke", sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
