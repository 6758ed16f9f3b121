#!/usr/bin/env python3
"""`./dev.sh soak [MINUTES] [--seed N] [roslaunch args]`: fly the launch file in a crowd that means no good.

Several clients call every service at once, in any order, with scripts and scenes that are broken, hang or are well;
commands stream, good ones and nonsense; cameras come and go; a listener sleeps; a bag records. Every 10 s a line on
the node's process. Exit status 1 where the node died, a service hung, memory, threads or descriptors grew, a
traceback was printed, or the node did not fly again and end when it was told to.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional
from xmlrpc.client import ServerProxy

import clients
import numpy as np

EVERY = 10.0  # s between two lines
STARTS = 60.0  # s that the launch may take
ENDS = 10.0  # s that the node may take to end; roslaunch itself gives it 15
MOST_MEMORY = 1.0  # MB a minute after warming up, and
LEAST_MEMORY = 15.0  # MB in all, below which nothing is said of a slope
MOST_MORE = 8  # threads, descriptors
_TIDY = re.compile(r"\d[\d.e+-]*|'[^']*'|/\S+")


class Sample(NamedTuple):
    """The node's process at a moment (s): resident memory in MB, threads, open descriptors."""

    at: float
    memory: float
    threads: int
    descriptors: int


class Launch:
    """roslaunch with a master of its own, and what it prints."""

    def __init__(self, folder: Path, arguments: List[str]):
        """Launch; `folder` is the home of all that the node writes."""
        with socket.socket() as probe:
            probe.bind(("localhost", 0))
            port = probe.getsockname()[1]
        os.environ.update(ROS_MASTER_URI=f"http://localhost:{port}", HOME=str(folder), ROS_HOME=str(folder / "ros"))
        os.environ.update(PYTHONUNBUFFERED="1")
        command = ["roslaunch", "-p", str(port), "drone_sim", "drone.launch", "rviz:=false", *arguments]
        self.lines: List[str] = []
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.pid = self._wait_for_the_node()

    def _read(self) -> None:
        for line in self.process.stdout or ():
            self.lines.append(line.rstrip())

    def _wait_for_the_node(self) -> int:
        end = time.monotonic() + STARTS
        while time.monotonic() < end and self.process.poll() is None:
            with contextlib.suppress(OSError):
                code, _, uri = ServerProxy(os.environ["ROS_MASTER_URI"]).lookupNode("/soak", "/drone_sim")  # type: ignore
                if code == 1 and any("commands on" in line for line in self.lines):
                    return int(ServerProxy(str(uri)).getPid("/soak")[2])  # type: ignore
            time.sleep(0.2)
        self.process.kill()
        raise SystemExit("the node does not start:\n" + "\n".join(self.lines[-20:]))

    def alive(self) -> bool:
        """Tell whether the node's process is there."""
        status = Path(f"/proc/{self.pid}/status")
        with contextlib.suppress(OSError):
            return "State:\tZ" not in status.read_text()
        return False

    def sample(self) -> Optional[Sample]:
        """Look at the node's process; None where there is none."""
        folder = Path(f"/proc/{self.pid}")
        try:
            pages = int((folder / "statm").read_text().split()[1])
            return Sample(
                time.monotonic(), pages * 4096 / 1e6, len(os.listdir(folder / "task")), len(os.listdir(folder / "fd"))
            )
        except OSError:
            return None

    def end(self) -> float:
        """Send SIGINT as Ctrl-C does; return how long the node took to end (s)."""
        began = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        while self.alive() and time.monotonic() < began + 2 * ENDS:
            time.sleep(0.05)
        took = time.monotonic() - began
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self._reader.join(5)
        return took


class Crowd:
    """The clients, a process each, and what they have seen."""

    def __init__(self, folder: Path, seed: int):
        """Start them."""
        self._folder = folder
        self._dice = random.Random(f"crowd {seed}")
        roles = ["services"] * 3 + ["commands"] * 2 + ["looker"] * 2 + ["odometry", "sleeper"]
        self._processes = [self._start(role, seed * 100 + number) for number, role in enumerate(roles)]
        self._sleeper = self._processes[-1]
        if shutil.which("rosbag"):
            topics = ["/drone/odom", "/tf", "/drone/front/compressed"]
            bag = ["rosbag", "record", "-q", "--split", "--size=20", "--max-splits=2", "-O", str(folder / "bag"), *topics]
            self._processes.append(subprocess.Popen(bag, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        self._stopped = False

    def _start(self, role: str, seed: int) -> subprocess.Popen:
        program = [sys.executable, str(Path(clients.__file__)), role, str(seed), str(self._folder)]
        with (self._folder / f"{role}-{seed}.log").open("w") as log:
            return subprocess.Popen(program, stdout=log, stderr=subprocess.STDOUT)

    def stir(self) -> None:
        """Put the sleeper to sleep, or wake it."""
        if self._dice.random() < 0.1:
            self._stopped = not self._stopped
            self._sleeper.send_signal(signal.SIGSTOP if self._stopped else signal.SIGCONT)

    def dead(self) -> List[str]:
        """Name the clients that ended by themselves, which is the harness's own fault."""
        return [f"{one.args}" for one in self._processes if one.poll() is not None]

    def close(self) -> None:
        """End them."""
        for one in self._processes:
            one.kill()
        for one in self._processes:
            one.wait()

    def diary(self) -> List[Any]:
        """Return all that they have noted."""
        noted: List[Any] = []
        for path in sorted(self._folder.glob("*.jsonl")):
            for line in path.read_text(encoding="utf-8").splitlines():
                with contextlib.suppress(ValueError):  # cut off, where the client was ended
                    noted.append(json.loads(line))
        return noted


# ---- what is made of it


def slope(samples: List[Sample]) -> float:
    """Return by how many MB a minute the memory grew: the median of the slopes between any two (Theil and Sen)."""
    at, memory = np.array([[s.at, s.memory] for s in samples]).T
    first, second = np.triu_indices(len(at), 1)
    far = at[second] - at[first] > 0.2 * (at[-1] - at[0])
    slopes = (memory[second] - memory[first])[far] / (at[second] - at[first])[far]
    return float(np.median(slopes) * 60.0) if len(slopes) else 0.0


def settled(samples: List[Sample]) -> List[Sample]:
    """Return the samples after the warm-up: a third of the run, at most two minutes."""
    warm = samples[0].at + min(120.0, (samples[-1].at - samples[0].at) / 3)
    return [sample for sample in samples if sample.at >= warm]


def growth(samples: List[Sample]) -> List[str]:
    """Name what grew after the warm-up."""
    rest = settled(samples)
    if len(rest) < 12:
        return []
    found = []
    third = len(rest) // 3
    early, late = rest[:third], rest[-third:]
    risen = min(s.memory for s in late) - min(s.memory for s in early)
    if slope(rest) > MOST_MEMORY and risen > LEAST_MEMORY:
        found.append(f"memory grows by {slope(rest):.1f} MB a minute")
    for name in ("threads", "descriptors"):
        more = min(getattr(s, name) for s in late) - min(getattr(s, name) for s in early)
        if more > MOST_MORE:
            found.append(f"{name} grow: {more} more")
    return found


def late_steps(lines: List[str]) -> int:
    """Return how many late steps the node has counted."""
    counts = [int(n) for line in lines for n in re.findall(r"\((\d+) so far\)|(\d+) late steps", line)[0:1] for n in n if n]
    return max(counts, default=0)


def answers(diary: List[Any]) -> Dict[str, Counter]:
    """Count what the services said, with numbers and names left out."""
    said: Dict[str, Counter] = {}
    for what, _, well, text in diary:
        if what != "odom":
            key = "well" if well else _TIDY.sub("_", text)[:110]
            said.setdefault(what, Counter())[key] += 1
    return said


def faults(launch: Launch, diary: List[Any], samples: List[Sample]) -> List[str]:
    """Name what went wrong."""
    found = [f"{what}: {text} after {seconds:.1f} s" for what, seconds, _, text in diary if text[:4] in ("HUNG", "NOT ", "NO A")]
    found += [f"the node printed: {line[:200]}" for line in launch.lines if "Traceback" in line]
    return [*found[:10], *growth(samples)]


def report(samples: List[Sample], launch: Launch, diary: List[Any], began: float) -> str:
    """Return the line of now."""
    now = samples[-1]
    odometry = [int(text) for what, _, well, text in diary if what == "odom" and well][-10:]
    calls = [entry for entry in diary if entry[0] != "odom"]
    return (
        f"{now.at - began:6.0f} s  {now.memory:6.1f} MB {slope(settled(samples)):+6.2f} MB/min  {now.threads:3d} threads "
        f"{now.descriptors:4d} descriptors  {late_steps(launch.lines):4d} late  {len(calls):5d} calls "
        f"{sum(not entry[2] for entry in calls):4d} refused, slowest {max([c[1] for c in calls], default=0):.1f} s  "
        f"{np.mean(odometry) if odometry else 0:5.1f} odom/s"
    )


@contextlib.contextmanager
def home(keep: bool) -> Iterator[Path]:
    """Make a folder for all that is written."""
    folder = Path(tempfile.mkdtemp(prefix="soak"))
    for name, text in {**clients.SCRIPTS, **clients.SCENES}.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "flown.py").symlink_to(clients.GOOD_SCRIPTS[0])
    yield folder
    if keep:
        print(f"kept: {folder}")
    else:
        shutil.rmtree(folder, ignore_errors=True)


def soak(launch: Launch, crowd: Crowd, minutes: float) -> List[Sample]:
    """Let the crowd at the node for so long, and say every 10 s how it is."""
    began = time.monotonic()
    samples: List[Sample] = []
    due = began + EVERY
    while time.monotonic() < began + 60 * minutes:
        time.sleep(1.0)
        crowd.stir()
        sample = launch.sample()
        if sample is None:
            break
        samples.append(sample)
        if time.monotonic() > due:
            due += EVERY
            print(report(samples, launch, crowd.diary(), began), flush=True)
    return samples


def afterwards(folder: Path) -> List[str]:
    """Start the tutorial's script in the empty scene, and see that it answers: the node must be what it was."""
    program = (
        "import rospy, sys, clients; from pathlib import Path; from nav_msgs.msg import Odometry\n"
        "rospy.init_node('soak_after'); rospy.set_param('/drone_sim/scene_file', '')\n"
        "diary = clients.Diary(Path(sys.argv[1]) / 'after.jsonl')\n"
        "clients._call('load_scene', False, diary)\n"
        "rospy.wait_for_message('/drone/odom', Odometry, 5)\n"
    )
    link = folder / "link"
    link.symlink_to(clients.GOOD_SCRIPTS[-1])
    link.replace(folder / "flown.py")
    environment = {**os.environ, "PYTHONPATH": f"{Path(__file__).parent}:{os.environ.get('PYTHONPATH', '')}"}
    try:
        done = subprocess.run(
            [sys.executable, "-c", program, str(folder)], env=environment, timeout=40, capture_output=True, text=True, check=False
        )
    except subprocess.TimeoutExpired:
        return ["it does not answer afterwards"]
    return [] if done.returncode == 0 else [f"it does not fly afterwards: {done.stderr[-300:]}"]


def main() -> int:
    """Run."""
    parser = argparse.ArgumentParser(prog="./dev.sh soak", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("minutes", nargs="?", type=float, default=5.0, help="how long (default: 5)")
    parser.add_argument("--seed", type=int, default=0, help="of what the clients do (default: 0)")
    parser.add_argument("--keep", action="store_true", help="keep the folder with scripts, scenes and the clients' diaries")
    options, arguments = parser.parse_known_args()
    with home(options.keep) as folder:
        launch = Launch(folder, [f"script:={folder / 'flown.py'}", *arguments])
        crowd = Crowd(folder, options.seed)
        try:
            samples = soak(launch, crowd, options.minutes)
            dead = crowd.dead()
        finally:
            crowd.close()
        found = [f"a client of the soak ended: {one}" for one in dead]
        survived = launch.alive()
        found += afterwards(folder) if survived else ["the node died; it said last:", *launch.lines[-3:]]
        took = launch.end()
        found += [f"the node took {took:.1f} s to end"] if took > ENDS else []
        diary = crowd.diary()
        found += faults(launch, diary, samples) if survived else []
        for what, counts in sorted(answers(diary).items()):
            print(f"{what}: " + "; ".join(f"{count} {text}" for text, count in counts.most_common(8)))
        flew = [line for line in launch.lines if "times real time" in line]
        print(f"ended within {took:.1f} s; {flew[-1].partition('drone_sim: ')[2] if flew else 'it did not say how far it flew'}")
        if found:
            (Path("build") / "soak.log").write_text("\n".join(launch.lines), encoding="utf-8")
            print(f"seed {options.seed}; what the node printed is in build/soak.log", *found, sep="\n")
        else:
            print(f"seed {options.seed}: nothing broke")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
