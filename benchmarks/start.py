"""From `roslaunch` to the first picture of the front camera, at a subscriber that waits for it."""

import os
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from multiprocessing import get_context
from typing import Any
from xmlrpc.client import ServerProxy

import numpy as np

from benchmarks import node

Row = dict[str, Any]
PATIENCE = 60.0  # s


def measure(rounds: int = 5) -> list[Row]:
    """Return the seconds with a master of roslaunch's own, and with a roscore that runs."""
    own = [_in_a_process(False) for _ in range(rounds)]
    beside = [_in_a_process(True) for _ in range(rounds)]
    return [
        _spread("roslaunch -> the master answers", [answered for answered, _ in own]),
        _spread("roslaunch -> first picture", [picture for _, picture in own]),
        _spread("roslaunch -> first picture, a roscore runs", [picture for _, picture in beside]),
    ]


def _in_a_process(roscore: bool) -> tuple[float, float]:
    with ProcessPoolExecutor(1, get_context("spawn")) as process:  # a process can be a ROS node but once
        return process.submit(started, roscore).result()


def started(roscore: bool) -> tuple[float, float]:
    """Launch; return after how many s the master answered, and the first picture came."""
    import rospy
    from sensor_msgs.msg import Image

    with node.master() if roscore else nullcontext(node.choose_port()) as port:
        began, times = time.monotonic(), []

        def watch() -> None:
            _wait_for_master(began)
            times.append(time.monotonic() - began)
            rospy.init_node("benchmark", disable_signals=True)
            rospy.wait_for_message("/drone/front", Image, PATIENCE)
            times.append(time.monotonic() - began)

        with ThreadPoolExecutor(1) as watcher:
            watched = watcher.submit(watch)
            with node.launched("-p", port, "rviz:=false"):
                watched.result()
        rospy.signal_shutdown("done")
    return times[0], times[1]


def _wait_for_master(began: float) -> None:
    while time.monotonic() < began + PATIENCE:
        try:
            ServerProxy(os.environ["ROS_MASTER_URI"]).getPid("/benchmark")
            return
        except OSError:
            time.sleep(0.01)
    raise RuntimeError(f"roslaunch has no master after {PATIENCE:g} s")


def _spread(name: str, seconds: list[float]) -> Row:
    return {"name": name, "median_s": float(np.median(seconds)), "low": min(seconds), "high": max(seconds)}
