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

OFTEN, EVERY = 10.0, 60.0  # s between two samples, two lines
LIMITS = (0.3, 6.0, 300.0)  # of growth
SETTLES = 5.0  # s until the cockpit has found the vehicle, and may command it
QUIET = 90.0  # s after the last browser in which the cockpit becomes quiet: a deaf one is given up after 40
HERE = Path(__file__).parent
NODES = ("cockpit", "drone_sim")


def look(pid: int, node: str) -> Sample:
    """Look at a node now, whose memory is its share of what it uses. Raises OSError where it has died."""
    folder = Path(f"/proc/{pid}")
    share = re.search(r"^Pss:\s+(\d+)", (folder / "smaps_rollup").read_text(), re.MULTILINE)
    threads, descriptors = len(os.listdir(folder / "task")), len(os.listdir(folder / "fd"))
    memory = int(share[1]) * 1024 / 1e6 if share else 0.0
    return Sample(time.monotonic(), memory, threads, descriptors, registrations(node))


def registrations(node: str) -> int:
    """Return how many topics and services a node has with the master."""
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
def browsers(where: str, seed: int, folder: Path) -> Iterator[list[subprocess.Popen]]:
    """Let browsers at the cockpit; they yield to the nodes."""
    programs = ["browsers.py"]
    if shutil.which("chromium") and importlib.util.find_spec("playwright"):
        programs.append("chromium.py")
    else:
        print("no chromium, or no playwright (./dev.sh test-web installs both): the browsers are Python alone")
    started = []
    for program in programs:
        command = ["nice", "-n", "10", sys.executable, str(HERE / program), where, str(seed), str(folder)]
        with (folder / f"{program}.log").open("w") as log:
            started.append(subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, start_new_session=True))
    try:
        yield started
    finally:
        for one in started:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(one.pid, signal.SIGKILL)
            one.wait()


def soak(launch: Launch, pids: dict[str, int], folder: Path, minutes: float) -> dict[str, list[Sample]]:
    """Look for so long, and say every minute how it is; return what was seen of each node."""
    began = time.monotonic()
    seen: dict[str, list[Sample]] = {node: [] for node in NODES}
    due = began + EVERY
    with contextlib.suppress(OSError):
        while time.monotonic() < began + 60 * minutes:
            time.sleep(OFTEN)
            for node, pid in pids.items():
                seen[node].append(look(pid, node))
            if time.monotonic() > due:
                due += EVERY
                print(line(seen, launch, diary(folder), time.monotonic() - began), flush=True)
    return seen


def diary(folder: Path) -> list[Any]:
    """Return all visits: what was done, s until the scene had come, what went wrong."""
    lines = [one for path in folder.glob("*.jsonl") for one in path.read_text(encoding="utf-8").splitlines()]
    return [json.loads(one) for one in lines]


def line(seen: dict[str, list[Sample]], launch: Launch, visits: list[Any], time_: float) -> str:
    parts = [f"{time_ / 60:5.1f} min"]
    for node, states in seen.items():
        _, memory, threads, descriptors, registered = states[-1]
        grows = slope(last_half(states))
        parts.append(
            f"{node} {memory:6.1f} MB {grows:+5.2f} MB/min {threads:3d} threads {descriptors:3d} descriptors "
            f"{registered:3d} registrations"
        )
    return "   ".join([*parts, f"{late_steps(launch.lines)} late   {len(visits)} visits"])


def quiet(pid: int, before: Sample) -> list[str]:
    """Wait until the cockpit listens to no more than before the first browser; name what it still has."""
    end = time.monotonic() + QUIET
    while time.monotonic() < end:
        now = look(pid, "cockpit")
        if now.registrations <= before.registrations and now.threads <= before.threads + MOST_MORE:
            return []
        time.sleep(1.0)
    return [f"nobody looks, and the cockpit has {now}; it began with {before}"]


def dead(pids: dict[str, int], launch: Launch) -> list[str]:
    """Name the nodes that have died, and what was printed last."""
    found = [f"{node} died" for node, pid in pids.items() if not Path(f"/proc/{pid}/exe").exists()]
    return [*found, "printed last:", *launch.lines[-10:]] if found else []


def verdict(launch: Launch, seen: dict[str, list[Sample]], visits: list[Any]) -> list[str]:
    """Say what there was of visits; return what went wrong."""
    done = [one for one in visits if not one[2]]
    for role in sorted({one[0] for one in visits}):
        came = [one[1] for one in done if one[0] == role]
        early, late = came[: len(came) // 3 + 1], came[-(len(came) // 3 + 1) :]
        if came:
            waits = f"{statistics.median(early):.2f} s at first, {statistics.median(late):.2f} s in the end"
            print(f"{role}: {len(came)} visits; until the scene had come {waits}")
    for role, _, trouble in [one for one in visits if one[2]][:10]:
        print(f"{role}: {trouble[:200]}")
    printed = [f"printed: {one[:200]}" for one in launch.lines if "Traceback" in one]
    return [*printed[:5], *(f"{node}: {one}" for node, states in seen.items() for one in growth(states, *LIMITS))]


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="./dev.sh soak-web", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("minutes", nargs="?", type=float, default=10.0, help="how long (default: 10)")
    parser.add_argument("--seed", type=int, default=0, help="of what the browsers do (default: 0)")
    options, arguments = parser.parse_known_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # and tidy up
    folder = Path(tempfile.mkdtemp(prefix="soak"))
    try:
        with Launch(folder, ["web:=true", *arguments]) as launch:
            where = address(launch)
            time.sleep(SETTLES)
            pids = {node: pid_of(node) for node in NODES}
            before = look(pids["cockpit"], "cockpit")
            with browsers(where, options.seed, folder) as started:
                seen = soak(launch, pids, folder, options.minutes)
                found = [f"a client of the soak ended: {one.args}" for one in started if one.poll() is not None]
            found += dead(pids, launch) or quiet(pids["cockpit"], before)
            found += verdict(launch, seen, diary(folder))
            took = launch.end()
            found += [f"the node took {took:.1f} s to end"] if took > ENDS else []
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    log = HERE.parents[1] / "build" / "soak_web.log"
    log.write_text("\n".join(launch.lines), encoding="utf-8")
    print(f"what the nodes printed is in {log}", *found, "something broke" if found else "nothing broke", sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
