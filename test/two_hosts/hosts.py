"""The two hosts: this process runs on the simulator's, the student's node in another network namespace."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import rospy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from wire import Wire

HERE, THERE = "10.77.0.1", "10.77.0.2"
STARTS = 60.0  # s, time limit of the launch and of the student's first image
_PORT = 11311


def settle(folder: Path) -> None:
    """Configure this process for the simulator's host; nodes write their files into `folder`."""
    os.environ.pop("ROS_HOSTNAME", None)
    os.environ.update(ROS_MASTER_URI=f"http://{HERE}:{_PORT}", ROS_IP=HERE, PYTHONUNBUFFERED="1")
    os.environ.update(HOME=str(folder), ROS_HOME=str(folder / "ros"))


class Student:
    """The student's host, and the network connection to it."""

    def __init__(self) -> None:
        """Start the student's node. Raises OSError."""
        command = ["unshare", "--net", sys.executable, str(Path(__file__).with_name("student.py"))]
        environment = {**os.environ, "ROS_IP": THERE}
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, env=environment, stdin=pipe, stdout=pipe, text=True)
        self._wait_for_the_namespace()
        self.wire = Wire(HERE, THERE, self._process.pid)

    def _wait_for_the_namespace(self) -> None:
        own, its = Path("/proc/self/ns/net"), Path(f"/proc/{self._process.pid}/ns/net")
        while own.readlink() == its.readlink():
            if self._process.poll() is not None:
                raise OSError("no second network namespace can be made here")
            time.sleep(0.01)

    def ask(self, word: str = "") -> Any:
        """Return the student's report since the previous request: see student.py."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(f"{word}\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline(), object_hook=lambda fields: SimpleNamespace(**fields))

    def begin(self) -> None:
        """Start the flight, and wait for fresh images. Raises OSError if none arrive."""
        assert self._process.stdin
        self._process.stdin.write("\n")
        end = time.monotonic() + STARTS
        while not self.ask().fresh:
            if time.monotonic() > end:
                raise OSError("no pictures come")
            time.sleep(0.5)


class Simulator:
    """The simulator's host: drone.launch, and a local node that subscribes to the drone's topics."""

    def __init__(self, folder: Path, timeout: float):
        """Launch; `timeout` is cmd_vel_timeout (s)."""
        config = folder / "config.yaml"
        config.write_text(f"cmd_vel_timeout: {timeout}\n")
        command = ["roslaunch", "-p", str(_PORT), "drone_sim", "drone.launch", "rviz:=false", f"config:={config}"]
        self.lines: list[str] = []
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdout=pipe, stderr=subprocess.STDOUT, text=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._wait()
        rospy.init_node("near_by", disable_signals=True)
        self.steps: list[Odometry] = []
        self.command = TwistStamped()
        rospy.Subscriber("/drone/odom", Odometry, self._on_odometry, queue_size=100)
        rospy.Subscriber("/drone/command", TwistStamped, self._on_command, queue_size=100)

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self.lines.append(line.rstrip())

    def _wait(self) -> None:
        end = time.monotonic() + STARTS
        while not any("commands on" in line for line in self.lines):
            if time.monotonic() > end or self._process.poll() is not None:
                self.end()
                raise OSError("\n".join(["the simulator does not start", *self.lines[-5:]]))
            time.sleep(0.1)

    def _on_odometry(self, message: Odometry) -> None:
        self.steps.append(message)

    def _on_command(self, message: TwistStamped) -> None:
        self.command = message

    @property
    def stopped(self) -> bool:
        """Whether the command in force has no forward speed."""
        return self.command.twist.linear.x == 0.0

    @property
    def speed(self) -> float:
        """Speed of the drone (m/s)."""
        velocity = self.steps[-1].twist.twist.linear
        return math.hypot(velocity.x, velocity.y, velocity.z)

    def worst_gap(self, first: int) -> float:
        """Return the longest time between the stamps of two successive steps (s), from index `first` on."""
        stamps = [message.header.stamp.to_sec() for message in self.steps[first:]]
        return max(later - sooner for sooner, later in itertools.pairwise(stamps))

    def end(self) -> float:
        """Send SIGINT like Ctrl-C; return the time until the launch ended (s)."""
        start_time = time.monotonic()
        self._process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(STARTS)
        self._process.kill()
        self._reader.join(5)
        return time.monotonic() - start_time
