#!/usr/bin/env python3
"""`./dev.sh soak [MINUTES] [--seed N] [roslaunch args]`: fly the launch file in a crowd that means no good.

Several clients call every service at once, in any order, with scripts and scenes that are broken, hang or are well;
commands stream, good ones and nonsense; cameras come and go; a listener sleeps, another never says what it wants; a
bag records. Every 10 s a line on the node's process. Exit status 1 where the node died, a service hung, memory, threads
or descriptors grew, a traceback was printed, or the node did not fly again and end when it was told to.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import clients
from measure import Sample, answers, faults, report

EVERY = 10.0  # s between two lines
STARTS = 60.0  # s, time limit of the launch
SCRIPT_LIMIT = 0.5  # s; several clients may each have to wait for another's script that hangs
ENDS = 5.0  # s, time limit for the end of the node: 3, and the delay of roslaunch


class Launch:
    """roslaunch with its own master, and its output."""

    def __init__(self, folder: Path, arguments: list[str]):
        """Launch; the node writes its files into `folder`."""
        with socket.socket() as probe:
            probe.bind(("localhost", 0))
            port = probe.getsockname()[1]
        os.environ.update(ROS_MASTER_URI=f"http://localhost:{port}", HOME=str(folder), ROS_HOME=str(folder / "ros"))
        os.environ.update(PYTHONUNBUFFERED="1")
        command = ["roslaunch", "-p", str(port), "drone_sim", "drone.launch", "rviz:=false", *arguments]
        self.lines: list[str] = []
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
        """Return whether the node's process is running."""
        status = Path(f"/proc/{self.pid}/status")
        with contextlib.suppress(OSError):
            return "State:\tZ" not in status.read_text()
        return False

    def sample(self) -> Sample | None:
        """Return a sample of the node's process, None if it has ended."""
        folder = Path(f"/proc/{self.pid}")
        try:
            pages = int((folder / "statm").read_text().split()[1])
            return Sample(
                time.monotonic(), pages * 4096 / 1e6, len(os.listdir(folder / "task")), len(os.listdir(folder / "fd"))
            )
        except OSError:
            return None

    def __enter__(self) -> Launch:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.end()

    def end(self) -> float:
        """Send SIGINT like Ctrl-C; return the time until the node ended (s)."""
        start_time = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        while self.alive() and time.monotonic() < start_time + 2 * ENDS:
            time.sleep(0.05)
        duration = time.monotonic() - start_time
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self._reader.join(5)
        return duration


class Crowd:
    """The clients, one process for each, and their diaries."""

    def __init__(self, folder: Path, seed: int):
        self._folder = folder
        self._rng = random.Random(f"crowd {seed}")
        roles = ["services"] * 3 + ["commands"] * 2 + ["looker"] * 2 + ["odometry", "silent", "sleeper"]
        self._processes = [self._start(role, seed * 100 + number) for number, role in enumerate(roles)]
        self._sleeper = self._processes[-1]
        if shutil.which("rosbag"):
            topics = ["/drone/odom", "/tf", "/drone/front/compressed"]
            bag = [
                "rosbag",
                "record",
                "-q",
                "--split",
                "--size=20",
                "--max-splits=2",
                "-O",
                str(folder / "bag"),
                *topics,
            ]
            # In a new session: rosbag starts another program, which must end with it.
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            self._processes.append(subprocess.Popen(bag, start_new_session=True, **quiet))
        self._is_stopped = False

    def _start(self, role: str, seed: int) -> subprocess.Popen:
        program = [sys.executable, str(Path(clients.__file__)), role, str(seed), str(self._folder)]
        with (self._folder / f"{role}-{seed}.log").open("w") as log:
            return subprocess.Popen(program, stdout=log, stderr=subprocess.STDOUT, start_new_session=True)

    def stir(self) -> None:
        """Stop or continue the sleeper process at random times."""
        if self._rng.random() < 0.1:
            self._is_stopped = not self._is_stopped
            self._sleeper.send_signal(signal.SIGSTOP if self._is_stopped else signal.SIGCONT)

    def dead(self) -> list[str]:
        """Return the clients that ended by themselves, which is a fault of this program."""
        return [f"{one.args}" for one in self._processes if one.poll() is not None]

    def __enter__(self) -> Crowd:
        return self

    def __exit__(self, *_: object) -> None:
        for one in self._processes:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(one.pid, signal.SIGKILL)
        for one in self._processes:
            one.wait()

    def diary(self) -> list[Any]:
        entries: list[Any] = []
        for path in sorted(self._folder.glob("*.jsonl")):
            for line in path.read_text(encoding="utf-8").splitlines():
                with contextlib.suppress(ValueError):  # an incomplete line of a killed client
                    entries.append(json.loads(line))
        return entries


@contextlib.contextmanager
def home(keep: bool) -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="soak"))
    for name, text in {**clients.SCRIPTS, **clients.SCENES}.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "flown.py").symlink_to(clients.GOOD_SCRIPTS[0])
    (folder / "config.yaml").write_text(f"script_time_limit: {SCRIPT_LIMIT}\n", encoding="utf-8")
    try:
        yield folder
    finally:
        if keep:
            print(f"kept: {folder}")
        else:
            shutil.rmtree(folder, ignore_errors=True)


def soak(launch: Launch, crowd: Crowd, minutes: float) -> list[Sample]:
    """Run the crowd for `minutes`, and print a report every 10 s; return the samples."""
    start_time = time.monotonic()
    samples: list[Sample] = []
    next_report = start_time + EVERY
    while time.monotonic() < start_time + 60 * minutes:
        time.sleep(1.0)
        crowd.stir()
        sample = launch.sample()
        if sample is None:
            break
        samples.append(sample)
        if time.monotonic() > next_report:
            next_report += EVERY
            print(report(samples, launch.lines, crowd.diary(), start_time), flush=True)
    return samples


def afterwards(folder: Path) -> list[str]:
    """Start a good script in the empty scene, and return a failure if the node does not publish odometry."""
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
        result = subprocess.run(
            [sys.executable, "-c", program, str(folder)],
            env=environment,
            timeout=40,
            capture_output=True,
            text=True,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return ["it does not answer afterwards"]
    return [] if result.returncode == 0 else [f"it does not fly afterwards: {result.stderr[-300:]}"]


def finish(launch: Launch, crowd: Crowd, folder: Path, samples: list[Sample]) -> list[str]:
    """Check that the node still flies, end it, and print the services' replies; return the failures."""
    survived = launch.alive()
    found = afterwards(folder) if survived else ["the node died; it said last:", *launch.lines[-3:]]
    duration = launch.end()
    if duration > ENDS:
        found.append(f"the node took {duration:.1f} s to end")
    diary = crowd.diary()
    for what, counts in sorted(answers(diary).items()):
        print(f"{what}: " + "; ".join(f"{count} {text}" for text, count in counts.most_common(8)))
    flights = [line.partition("drone_sim: ")[2] for line in launch.lines if "times real time" in line]
    print(f"ended within {duration:.1f} s; {flights[-1] if flights else 'it did not say how far it flew'}")
    return found + (faults(launch.lines, diary, samples) if survived else [])


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="./dev.sh soak", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("minutes", nargs="?", type=float, default=5.0, help="how long (default: 5)")
    parser.add_argument("--seed", type=int, default=0, help="of what the clients do (default: 0)")
    parser.add_argument(
        "--keep", action="store_true", help="keep the folder with scripts, scenes and the clients' diaries"
    )
    options, arguments = parser.parse_known_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # and clean up
    with home(options.keep) as folder:
        own_arguments = [f"script:={folder / 'flown.py'}", f"config:={folder / 'config.yaml'}"]
        with Launch(folder, [*own_arguments, *arguments]) as launch:
            with Crowd(folder, options.seed) as crowd:
                samples = soak(launch, crowd, options.minutes)
                found = [f"a client of the soak ended: {one}" for one in crowd.dead()]
            found += finish(launch, crowd, folder, samples)
    if found:
        log = Path(__file__).parents[2] / "build" / "soak.log"
        log.write_text("\n".join(launch.lines), encoding="utf-8")
        print(f"seed {options.seed}; what the node printed is in {log}", *found, sep="\n")
        return 1
    print(f"seed {options.seed}: nothing broke")
    return 0


if __name__ == "__main__":
    sys.exit(main())
