"""Scenario of the network test: faults of the connection, measurements, and failures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import rospy
from hosts import Simulator, Student
from std_srvs.srv import SetBool, Trigger

_STEP = 0.05  # s of simulated time
SPAN = 5.0  # s, for each condition of the network
RECOVERY_LIMIT = 10.0  # s plus the time of the cut: TCP retransmits at doubled intervals
SERVICE_LIMIT = 2.0  # s
END_LIMIT = 6.0  # s for the end of the launch: 3 for the node, the rest for roslaunch
HOVER_SPEED = 0.05  # m/s
LONGEST_GAP = 0.5  # s between two steps; longer than a busy machine explains


def told(simulator: Simulator, student: Student, timeout: float, cut: float) -> Iterator[str]:
    """Run the scenario, print its figures, yield the failures; `timeout` is cmd_vel_timeout (s), `cut` is in s."""
    good = _measure(student, "a good network")
    if not good.pictures or not good.round_trip[0]:
        yield "pictures or commands do not get across"
    yield from _cut(simulator, student, timeout, cut)
    yield from _mend(student, RECOVERY_LIMIT + cut)
    for name, delay, loss in (("100 ms of delay each way", 0.1, 0.0), ("1 % of the packets lost", 0.0, 0.01)):
        student.wire.delay, student.wire.loss = delay, loss
        if not _measure(student, name).pictures:
            yield f"with {name}: no pictures"
    student.wire.delay = student.wire.loss = 0.0
    student.ask("raw")
    _measure(student, "a good network, raw pictures")
    student.wire.cut = True
    yield from _end(simulator)


def _measure(student: Student, name: str) -> Any:
    """Print and return the student's report about SPAN seconds."""
    time.sleep(1.0)  # for packets in transit
    student.ask()
    carried = student.wire.carried
    time.sleep(SPAN)
    report, carried = student.ask(), student.wire.carried - carried
    print(
        f"{name}: {report.pictures / SPAN:.1f} pictures per s, {_ms(report.age)} old; "
        f"a command comes back as the topic `command` after {_ms(report.round_trip)}; {carried / SPAN / 1e3:.0f} kB/s",
        flush=True,
    )
    return report


def _ms(times: tuple[float, float]) -> str:
    return f"{times[0] * 1e3:.0f} ms ({times[1] * 1e3:.0f} at most)"


def _cut(simulator: Simulator, student: Student, timeout: float, cut: float) -> Iterator[str]:
    """Cut the connection, and yield the failures of the simulator's host."""
    student.wire.cut = True
    student.ask()
    first = len(simulator.steps)
    if not _within(SPAN, lambda: simulator.stopped):
        yield "the command was not zeroed"
    after = (len(simulator.steps) - first) * _STEP
    time.sleep(cut)
    gap, speed = simulator.worst_gap(first), simulator.speed
    print(f"cut: the command was zero after {after:.2f} s of simulated time; {cut:g} s later it flew {speed:.3f} m/s")
    if after > timeout + 3 * _STEP:
        yield f"the command was zeroed after {after:.2f} s, and cmd_vel_timeout is {timeout} s"
    if speed > HOVER_SPEED:
        yield f"it does not hover: {speed:.2f} m/s"
    slowest = max(_service_time("snapshot"), _service_time("pause", True), _service_time("pause", False))
    print(f"cut: {gap * 1e3:.0f} ms at most between two steps; the slowest of three services took {slowest:.2f} s")
    if gap > LONGEST_GAP or slowest > SERVICE_LIMIT:
        yield "the simulator was held up"


def _service_time(name: str, *arguments: bool) -> float:
    """Return the duration of a service call (s), infinity if it fails."""
    start_time = time.monotonic()
    proxy = rospy.ServiceProxy(f"/drone_sim/{name}", SetBool if arguments else Trigger)
    rospy.wait_for_service(f"/drone_sim/{name}", SERVICE_LIMIT)
    if not proxy(*arguments).success:
        return math.inf
    return time.monotonic() - start_time


def _mend(student: Student, limit: float) -> Iterator[str]:
    """Restore the connection; yield a failure if images and commands do not come back by themselves."""
    start_time = time.time()
    student.wire.cut = False
    pictures = commands = 0.0
    stale = 0
    while not (pictures and commands) and time.time() - start_time < limit:
        time.sleep(0.1)
        report = student.ask()
        pictures, commands = pictures or report.fresh, commands or report.echo
        stale += report.stale
    if not (pictures and commands):
        yield f"pictures or commands did not come back within {limit:g} s"
        return
    pictures, commands = pictures - start_time, commands - start_time
    print(f"back: fresh pictures after {pictures:.1f} s, behind {stale} old ones; commands after {commands:.1f} s")


def _end(simulator: Simulator) -> Iterator[str]:
    """End the launch like Ctrl-C while the connection is cut, and yield the failures."""
    duration = simulator.end()
    print(f"cut, and Ctrl-C: ended after {duration:.1f} s")
    if duration > END_LIMIT:
        yield f"the launch took {duration:.1f} s to end"
    flight_lines = [line.partition("drone_sim: ")[2] for line in simulator.lines if "times real time" in line]
    print(*flight_lines)
    if not flight_lines or any("exit code" in line for line in simulator.lines):
        yield "the node did not end well: " + " | ".join(simulator.lines[-5:])


def _within(seconds: float, condition: Callable[[], bool]) -> bool:
    """Wait at most `seconds` until the condition holds; return whether it does."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.005)
    return condition()
