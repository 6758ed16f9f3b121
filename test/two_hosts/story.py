"""What happens to the wire between the two hosts, what is seen meanwhile, and what is wrong with it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import rospy
from hosts import Simulator, Student
from std_srvs.srv import SetBool, Trigger

_STEP = 0.05  # s of simulated time
LOOK = 5.0  # s, for which each network is measured
AGAIN = 10.0  # s, and as long as it was cut, after which all is as before: TCP tries again at doubled intervals
ANSWERS = 2.0  # s that a service may take
ENDS = 6.0  # s that the launch may take to end: the node 3, and what roslaunch takes beside it
HOVERS = 0.05  # m/s
HUNG = 0.5  # s between two steps that no busy machine explains


def told(simulator: Simulator, student: Student, timeout: float, cut: float) -> Iterator[str]:
    """Tell the story, with its figures; yield what is wrong. `timeout` is cmd_vel_timeout, `cut` for how long (s)."""
    good = _look(student, "a good network")
    if not good.pictures or not good.round_trip[0]:
        yield "pictures or commands do not get across"
    yield from _cut(simulator, student, timeout, cut)
    yield from _mend(student, AGAIN + cut)
    for name, delay, loss in (("100 ms of delay each way", 0.1, 0.0), ("1 % of the packets lost", 0.0, 0.01)):
        student.wire.delay, student.wire.loss = delay, loss
        if not _look(student, name).pictures:
            yield f"with {name}: no pictures"
    student.wire.delay = student.wire.loss = 0.0
    student.ask("raw")
    _look(student, "a good network, raw pictures")
    student.wire.cut = True
    yield from _end(simulator)


def _look(student: Student, name: str) -> Any:
    """Let time pass, and say what the student saw."""
    time.sleep(1.0)  # what is under way
    student.ask()
    carried = student.wire.carried
    time.sleep(LOOK)
    seen, carried = student.ask(), student.wire.carried - carried
    print(
        f"{name}: {seen.pictures / LOOK:.1f} pictures per s, {_ms(seen.age)} old; "
        f"a command comes back as the topic `command` after {_ms(seen.round_trip)}; {carried / LOOK / 1e3:.0f} kB/s",
        flush=True,
    )
    return seen


def _ms(times: tuple[float, float]) -> str:
    return f"{times[0] * 1e3:.0f} ms ({times[1] * 1e3:.0f} at most)"


def _cut(simulator: Simulator, student: Student, timeout: float, cut: float) -> Iterator[str]:
    """Cut the wire, and see what the simulator's host does about it."""
    student.wire.cut = True
    student.ask()
    first = len(simulator.steps)
    if not _within(LOOK, lambda: simulator.stopped):
        yield "the command was not zeroed"
    after = (len(simulator.steps) - first) * _STEP
    time.sleep(cut)
    gap, speed = simulator.worst_gap(first), simulator.speed
    print(f"cut: the command was zero after {after:.2f} s of simulated time; {cut:g} s later it flew {speed:.3f} m/s")
    if after > timeout + 3 * _STEP:
        yield f"the command was zeroed after {after:.2f} s, and cmd_vel_timeout is {timeout} s"
    if speed > HOVERS:
        yield f"it does not hover: {speed:.2f} m/s"
    slowest = max(_asked("snapshot"), _asked("pause", True), _asked("pause", False))
    print(f"cut: {gap * 1e3:.0f} ms at most between two steps; the slowest of three services took {slowest:.2f} s")
    if gap > HUNG or slowest > ANSWERS:
        yield "the simulator was held up"


def _asked(name: str, *arguments: bool) -> float:
    """Return how long a service took, s."""
    began = time.monotonic()
    proxy = rospy.ServiceProxy(f"/drone_sim/{name}", SetBool if arguments else Trigger)
    rospy.wait_for_service(f"/drone_sim/{name}", ANSWERS)
    if not proxy(*arguments).success:
        return math.inf
    return time.monotonic() - began


def _mend(student: Student, limit: float) -> Iterator[str]:
    """Bring the wire back, and see that all is as before, without anybody's help."""
    began = time.time()
    student.wire.cut = False
    pictures = commands = 0.0
    stale = 0
    while not (pictures and commands) and time.time() - began < limit:
        time.sleep(0.1)
        seen = student.ask()
        pictures, commands = pictures or seen.fresh, commands or seen.echo
        stale += seen.stale
    if not (pictures and commands):
        yield f"pictures or commands did not come back within {limit:g} s"
        return
    pictures, commands = pictures - began, commands - began
    print(f"back: fresh pictures after {pictures:.1f} s, behind {stale} old ones; commands after {commands:.1f} s")


def _end(simulator: Simulator) -> Iterator[str]:
    """End the launch as Ctrl-C does, while the wire is cut."""
    took = simulator.end()
    print(f"cut, and Ctrl-C: ended after {took:.1f} s")
    if took > ENDS:
        yield f"the launch took {took:.1f} s to end"
    flew = [line.partition("drone_sim: ")[2] for line in simulator.lines if "times real time" in line]
    print(*flew)
    if not flew or any("exit code" in line for line in simulator.lines):
        yield "the node did not end well: " + " | ".join(simulator.lines[-5:])


def _within(seconds: float, true: Callable[[], bool]) -> bool:
    """Wait until something is true, but not longer; return whether it is."""
    end = time.monotonic() + seconds
    while not true() and time.monotonic() < end:
        time.sleep(0.005)
    return true()
