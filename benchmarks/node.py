"""The node as a process, with a master of its own: real-time factors and latencies.

The bare node has one core and its listeners the other; what the launch file starts shares them all, as a user's does.
"""

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

Row = dict[str, Any]
CORE = "0"  # the node's; listeners have the others


def choose_port() -> str:
    """Return a port that is free for a ROS master, and name it in ROS_MASTER_URI."""
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        port = str(probe.getsockname()[1])
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    return port


@contextlib.contextmanager
def master() -> Iterator[str]:
    """Run a ROS master on a free port, which is yielded."""
    port = choose_port()
    process = subprocess.Popen(["rosmaster", "--core", "-p", port], stdout=subprocess.DEVNULL)
    try:
        while subprocess.run(["rosparam", "list"], capture_output=True, check=False).returncode:
            time.sleep(0.1)
        yield port
    finally:
        process.terminate()
        process.wait(30)


def node(*arguments: str, program: str = "") -> AbstractContextManager[list[str]]:
    """Run the simulator, or a python program, on one core until the block ends; yield its lines of output."""
    what = [sys.executable, "-c", program] if program else ["rosrun", "drone_sim", "simulator"]
    return _running("taskset", "-c", CORE, *what, *arguments)


def launched(*arguments: str, file: str = "drone.launch") -> AbstractContextManager[list[str]]:
    """Run all of a launch file until the block ends; yield its lines of output."""
    return _running("roslaunch", "drone_sim", file, *arguments)


@contextlib.contextmanager
def _running(*command: str) -> Iterator[list[str]]:
    process = subprocess.Popen(
        command,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    lines: list[str] = []
    ready = threading.Event()

    def read() -> None:
        for line in process.stdout or ():
            lines.append(line)
            if "commands on" in line:
                ready.set()

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    if not ready.wait(60):
        process.kill()
        raise RuntimeError("the node does not fly:\n" + "".join(lines))
    try:
        yield lines
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)
        reader.join()


def real_time_factors(rounds: int = 3, seconds: float = 6.0) -> list[Row]:
    """As fast as it can, by turns: the bare node, and the launch file in real and in simulated time.

    Heard by nobody, and with the front camera and odometry heard by another process. Medians, lowest and highest.
    """
    free = "real_time_factor:=0"
    running: dict[str, Callable[[], AbstractContextManager[list[str]]]] = {
        "bare node": lambda: node(f"_{free}"),
        "drone.launch": lambda: launched("rviz:=false", free),
        "drone.launch, use_sim_time": lambda: launched("rviz:=false", free, "use_sim_time:=true"),
    }
    factors: dict[str, list[float]] = {}
    for _ in range(rounds):
        for name, run in running.items():
            for heard in (False, True):
                row = f"{name}, {'front camera and odometry heard' if heard else 'nobody listens'}"
                print(f"  {row}", file=sys.stderr, flush=True)
                factors.setdefault(row, []).append(_factor(run, heard, seconds))
    return [
        {"name": name, "factor": median, "low": min(some), "high": max(some), "step_ms": 50 / median}
        for name, some in factors.items()
        for median in [float(np.median(some))]
    ]


def _factor(run: Callable[[], AbstractContextManager[list[str]]], heard: bool, seconds: float) -> float:
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import Image

    with run() as lines:
        # Another process than the node's, as a user's program is.
        listening = [listen("/drone/front", Image), listen("/drone/odom", Odometry)] if heard else []
        time.sleep(seconds)
        for subscriber in listening:
            subscriber.unregister()
        # The factor counts the whole run; ending at once keeps the unheard rest short.
    return float(flew(lines).group(2))


def flew(lines: list[str]) -> "re.Match[str]":
    """Return what the node says at its end: seconds flown, factor, late steps, by how many ms."""
    said = r"flew ([\d.]+) s at ([\d.]+) times real time, (\d+) late steps, by (\d+) ms"
    found = re.search(said, "".join(lines))
    if found is None:
        raise RuntimeError("the node said nothing of its flight:\n" + "".join(lines))
    return found


def listen(topic: str, kind: Any, callback: Any = lambda message: None) -> Any:
    """Subscribe; the latest message alone waits."""
    import rospy

    return rospy.Subscriber(topic, kind, callback, queue_size=1, buff_size=2**22, tcp_nodelay=True)


# The node with a clock at its ear: a command says, in a field that the drone does not use, when it was sent.
PROBE = """
import sys, time
from drone_sim.run.watchdog import Watchdog
from drone_sim.ros.node import node
from drone_sim.ros.vehicle import inputs
delays = []
heard = inputs.VehicleInputs._twist
def probe(self, message):
    delays.append((time.monotonic() % 10 - message.angular.x) % 10)
    return heard(self, message)
inputs.VehicleInputs._twist = probe
path, sys.argv[1:] = sys.argv[1], sys.argv[2:]
node.main(Watchdog("drone_sim"))
open(path, "w").write("\\n".join(map(repr, delays)))
"""


# What one keeps of a flight: its camera, and all that is small.
RECORDED = (
    "/drone/front",
    "/drone/camera_info",
    "/drone/odom",
    "/drone/propellers",
    "/drone/command",
    "/tf",
    "/tf_static",
)


def latencies(seconds: float = 20.0) -> list[Row]:
    """At real time with the camera on: command to the loop's inbox, stamp of an image to its subscriber, jitter."""
    import rospy
    from geometry_msgs.msg import Twist
    from sensor_msgs.msg import Image

    rospy.set_param("/use_sim_time", False)  # which a launch file before may have left
    came: list[float] = []
    ages: list[float] = []

    def image(message: Any) -> None:
        now = time.time()
        came.append(now)
        ages.append(now - message.header.stamp.to_sec())

    print(f"  latencies, for {seconds:g} s of real time", file=sys.stderr, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "delays"
        with node(str(path), "_real_time_factor:=1", program=PROBE) as lines:
            subscriber = listen("/drone/front", Image, image)
            publisher = rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
            time.sleep(2.0)
            del came[:], ages[:]
            end, random = time.monotonic() + seconds, np.random.RandomState(1)
            while time.monotonic() < end:
                twist = Twist()
                twist.angular.x = time.monotonic() % 10
                publisher.publish(twist)
                time.sleep(random.uniform(0.03, 0.07))
            subscriber.unregister()
        delays = [float(line) for line in path.read_text().split()]
    jitter = np.abs(np.diff(came) - 0.05)
    return [
        spread("cmd_vel published -> seen by the loop", delays),
        spread("image stamped -> in the subscriber's callback", ages),
        {**spread("jitter of the 20 Hz images", jitter), "late_steps": int(flew(lines).group(3))},
    ]


def late_steps(seconds: float = 60.0) -> list[Row]:
    """At real time, the launch file with the front camera heard and a bag of everything; with rviz if it is there."""
    rows = []
    for rviz in (False, True):
        name = f"drone.launch {'with' if rviz else 'without'} rviz, camera, bag"
        if rviz and not (shutil.which("Xvfb") and shutil.which("rviz")):
            print(f"  {name}: left out, it needs rviz and Xvfb", file=sys.stderr, flush=True)
            continue
        print(f"  {name}, for {seconds:g} s of real time", file=sys.stderr, flush=True)
        with screen() if rviz else contextlib.nullcontext(), tempfile.TemporaryDirectory() as folder:
            flew = _recorded(f"rviz:={str(rviz).lower()}", folder, seconds)
        rows.append({"name": name, "late_steps": int(flew.group(3)), "worst_ms": float(flew.group(4))})
    return rows


def _recorded(argument: str, folder: str, seconds: float) -> "re.Match[str]":
    from sensor_msgs.msg import Image

    with launched(argument) as lines:
        recorder = subprocess.Popen(
            ["rosbag", "record", "-q", "-O", f"{folder}/flight.bag", *RECORDED], stdout=subprocess.DEVNULL
        )
        subscriber = listen("/drone/front", Image)
        time.sleep(seconds)
        subscriber.unregister()
        recorder.send_signal(signal.SIGINT)
        recorder.wait(30)
    return flew(lines)


@contextlib.contextmanager
def screen() -> Iterator[None]:
    """Have a display without a screen, drawn by the processor, as DISPLAY."""
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1000x24"],
        pass_fds=[write],
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    before = os.environ.get("DISPLAY")
    with os.fdopen(read) as number:
        os.environ["DISPLAY"] = f":{number.readline().strip()}"
    try:
        yield
    finally:
        server.terminate()
        server.wait(30)
        del os.environ["DISPLAY"]
        if before is not None:
            os.environ["DISPLAY"] = before


def spread(name: str, seconds: Any) -> Row:
    """Return median and 95th percentile, in ms."""
    median, high = np.percentile(1e3 * np.asarray(seconds), [50, 95])
    return {"name": name, "median_ms": float(median), "p95_ms": float(high), "samples": len(seconds)}


def measure() -> list[Row]:
    """Return all rows."""
    import rospy

    with master():
        rospy.init_node("benchmark", disable_signals=True)
        rows = real_time_factors() + latencies() + late_steps()
        rospy.signal_shutdown("done")
        return rows
