"""Flights with a ROS node in the loop, in lockstep and without: how many differ, and what the wait costs.

The nodes are those of docs/lockstep: `reacting` answers each odometry, `seeing` each picture after up to 0.3 s of work.
"""

import contextlib
import hashlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.node import master

Row = dict[str, Any]
ROOT = Path(__file__).parents[1]
FLIGHTS, SECONDS = 20, 3.0  # of each kind; s of simulated time
FIRST, LAST = 10**8, round(SECONDS * 1e9)  # ns, the stamps that are compared
BUSY_LOOPS = 4
SMALL = "cameras: {front: {width: 64, height: 48, every: 4}}\n"  # 5 pictures in a simulated second
SCENE = "package://drone_sim/config/scenes/gates.yaml"
LOCKSTEP = {
    "reacting": ("_lockstep/wait_for:=cmd_vel", "_lockstep/trigger:=odom"),
    "seeing": ("_lockstep/wait_for:=cmd_vel_stamped", "_lockstep/trigger:=front"),
}
COSTLY = 4000  # steps for the cost of the wait
# `reacting`, which says at its end how long its callback takes.
TIMED = """
import runpy, signal, sys, time, rospy
spent = []
init = rospy.Subscriber.__init__
def timed(self, topic, kind, callback, **options):
    def take(message):
        began = time.perf_counter()
        callback(message)
        spent.append(time.perf_counter() - began)
    init(self, topic, kind, take, **options)
rospy.Subscriber.__init__ = timed
try:
    runpy.run_path(sys.argv[1])
finally:
    print(f"callback {1e3 * sum(spent) / len(spent):.4f} ms", flush=True)
"""


class Flights:
    """The odometry of a simulator, one digest for each flight."""

    def __init__(self) -> None:
        import rospy
        from nav_msgs.msg import Odometry

        self._rows: dict[int, tuple[float, ...]] = {}
        self._came = threading.Condition()
        self._subscriber = rospy.Subscriber("/drone/odom", Odometry, self._take, tcp_nodelay=True)

    def _take(self, message: Any) -> None:
        pose, twist = message.pose.pose, message.twist.twist
        parts = pose.position, pose.orientation, twist.linear, twist.angular
        with self._came:
            self._rows[message.header.stamp.to_nsec()] = tuple(getattr(one, k) for one in parts for k in one.__slots__)
            self._came.notify_all()

    def clear(self) -> None:
        """Forget the flight so far."""
        with self._came:
            self._rows.clear()

    def digest(self) -> str:
        """Wait for the last row, and return what tells the flight from another one."""
        with self._came:
            if not self._came.wait_for(lambda: max(self._rows, default=0) >= LAST, 120):
                raise RuntimeError(f"the flight stands at {max(self._rows, default=0) * 1e-9:.2f} s")
            rows = sorted(row for row in self._rows.items() if FIRST <= row[0] <= LAST)
        return hashlib.sha256(repr(rows).encode()).hexdigest()

    def close(self) -> None:
        """Listen no more."""
        self._subscriber.unregister()


@contextlib.contextmanager
def _process(*command: object, **options: Any) -> Iterator["subprocess.Popen[str]"]:
    """Run a process until the block ends."""
    process = subprocess.Popen([*map(str, command)], text=True, **options)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def _simulator(*arguments: str) -> Iterator[None]:
    """Run a simulator that is stopped, until the block ends."""
    import rospy

    if rospy.has_param("/drone_sim"):
        rospy.delete_param("/drone_sim")
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as config:
        config.write(SMALL)
        config.flush()
        given = (f"_config:={config.name}", f"_scene_file:={SCENE}", *arguments)
        with _process(sys.executable, ROOT / "scripts/simulator", *given, stdout=subprocess.DEVNULL):
            rospy.wait_for_service("/drone_sim/stop", 60)
            _call("stop")
            yield


def _call(service: str) -> None:
    import rospy
    from std_srvs.srv import Trigger

    answer = rospy.ServiceProxy(f"/drone_sim/{service}", Trigger)()
    if not answer.success:
        raise RuntimeError(answer.message)


@contextlib.contextmanager
def _busy(loops: int) -> Iterator[None]:
    with contextlib.ExitStack() as stack:
        for _ in range(loops):
            stack.enter_context(_process(sys.executable, "-c", "while True: pass", stderr=subprocess.DEVNULL))
        yield


def different(node: str, factor: float, is_lockstep: bool, flights: int = FLIGHTS) -> int:
    """Return how many different flights a node makes of the same task."""
    arguments = LOCKSTEP[node] if is_lockstep else ()
    digests, flown = set(), Flights()
    try:
        with (
            _simulator(f"_real_time_factor:={factor:g}", *arguments),
            _process(sys.executable, ROOT / f"docs/lockstep/{node}.py", stdout=subprocess.DEVNULL),
        ):
            time.sleep(3)  # until the node is connected
            for _ in range(flights):
                time.sleep(0.2)  # what the last flight has left
                flown.clear()
                _call("start")
                digests.add(flown.digest())
                _call("stop")
    finally:
        flown.close()
    return len(digests)


def flights() -> list[Row]:
    """Return a row for each node, pace and load."""
    rows = []
    for loops in (0, BUSY_LOOPS):
        with _busy(loops):
            for node in LOCKSTEP:
                for factor in (1.0, 5.0, 0.0):
                    name = f"{node}, real_time_factor {factor:g}, {f'beside {loops} busy loops' if loops else 'quiet'}"
                    print(f"  {name}", file=sys.stderr, flush=True)
                    row: Row = {"name": name, "flights": FLIGHTS}
                    for key, is_lockstep in (("different_in_lockstep", True), ("different_without", False)):
                        row[key] = different(node, factor, is_lockstep)
                    print(f"    {row}", file=sys.stderr, flush=True)
                    rows.append(row)
    return rows


def cost() -> list[Row]:
    """Return the time of a step, in lockstep and free running, and what the wait takes beyond the node's own time."""
    lockstep, callback = _step_time(*LOCKSTEP["reacting"])
    free, _ = _step_time()
    return [
        {
            "name": "reacting, real_time_factor 0",
            "lockstep_ms": lockstep,
            "free_ms": free,
            "node_ms": callback,
            "wait_beyond_node_ms": lockstep - free - callback,
        }
    ]


def _step_time(*arguments: str) -> tuple[float, float]:
    """Return the time of a step, and of the node's callback, in ms."""
    import rospy
    from rosgraph_msgs.msg import Clock

    times: list[tuple[float, float]] = []
    with (
        _simulator("_real_time_factor:=0", *arguments),
        _process(sys.executable, "-c", TIMED, ROOT / "docs/lockstep/reacting.py", stdout=subprocess.PIPE) as node,
    ):
        time.sleep(3)
        clock = rospy.Subscriber("/clock", Clock, lambda m: times.append((time.perf_counter(), m.clock.to_sec())))
        _call("start")
        end = time.monotonic() + 120
        while (not times or times[-1][1] < COSTLY * 0.05) and time.monotonic() < end:
            time.sleep(0.05)
        clock.unregister()
        node.send_signal(signal.SIGINT)
        said = node.stdout.read() if node.stdout else ""
    (began, first), (ended, last) = times[len(times) // 10], times[-1]
    found = re.search(r"callback ([\d.]+) ms", said)
    return 1e3 * (ended - began) / ((last - first) / 0.05), float(found[1]) if found else float("nan")


def measure() -> list[Row]:
    """Return all rows."""
    import rospy

    with master():
        rospy.set_param("/use_sim_time", True)
        rospy.init_node("benchmark", disable_signals=True, disable_rostime=True)
        rows = cost() + flights()
        rospy.signal_shutdown("done")
        return rows
