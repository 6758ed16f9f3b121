"""Check the set-up. Each line says ok, or what to do."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from types import FrameType

from drone_sim.command_line import Parser
from drone_sim.ros.core.network import TIMEOUT
from drone_sim.ros.doctor import HINT, WRONG, Line, environment, packages
from drone_sim.ros.doctor.master import Master, simulator

_TIMEOUT = 10.0  # s, for a check
_END_TIMEOUT = 2.0  # s, for unregistering from the master
_MIN_TIMER = 1e-3  # s; 0 would disable the timer
_EPILOG = "The exit status is 0, or 1 if something is WRONG. It works without a master."
Check = Callable[[], Iterable[Line]]


def run_checks(thorough: bool = True) -> Iterator[Line]:
    """Yield the lines of all checks, each as soon as it is known; `thorough` adds slow checks. Main thread only."""
    master = Master()
    for what, check, seconds in (
        ("Python", environment.python, _TIMEOUT),
        ("ROS", environment.ros, _TIMEOUT),
        *([("packages", packages.packages, packages.TIMEOUT + _TIMEOUT)] if thorough else []),
        ("host names", environment.host_names, _TIMEOUT),
        ("host names", environment.remote_master, _TIMEOUT),
        ("master", master.connection, _TIMEOUT),
    ):
        yield from run_check(what, check, seconds)
    if master.is_connected:
        yield from run_check("clock", master.clocks, _TIMEOUT)
        yield from run_check("nodes", master.dead_nodes, _TIMEOUT)
        yield from run_check("commands", master.commands, _TIMEOUT)
        yield from run_check("simulator", lambda: simulator(master), _TIMEOUT)


class _CheckTimeout(Exception):
    pass


def run_check(what: str, check: Check, seconds: float) -> list[Line]:
    """Return the lines of a check, or one line if it fails or takes longer than `seconds`. Main thread only."""
    try:
        with _time_limit(seconds):
            return list(check())
    except _CheckTimeout:
        return [Line(WRONG, what, f"no answer within {seconds:g} s")]
    except Exception as error:  # an error of any type may be the fault that the user is looking for
        return [Line(WRONG, what, f"cannot be checked: {type(error).__name__}: {error}")]


@contextlib.contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise _CheckTimeout after `seconds` (real time); restore another timer, such as a test's, at the end."""

    def expire(_number: int, _frame: FrameType | None) -> None:
        raise _CheckTimeout

    handler = signal.signal(signal.SIGALRM, expire)
    remaining, interval = signal.setitimer(signal.ITIMER_REAL, seconds)
    began = time.monotonic()
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, handler)
        if remaining:
            remaining = max(remaining - (time.monotonic() - began), _MIN_TIMER)
            signal.setitimer(signal.ITIMER_REAL, remaining, interval)


def main() -> int:
    parser = Parser(prog="doctor", description=__doc__, epilog=_EPILOG)
    parser.add_argument("--quick", action="store_true", help="skip packages, pictures and the test flight")
    arguments = [argument for argument in sys.argv[1:] if ":=" not in argument]  # those are roslaunch's
    thorough = not parser.parse_args(arguments).quick
    socket.setdefaulttimeout(TIMEOUT)
    marks: list[str] = []
    with contextlib.suppress(BrokenPipeError):  # the reader has closed the pipe, as `head` does
        for line in run_checks(thorough):
            marks.append(line.mark)
            print(line, flush=True)
        wrong, hints = marks.count(WRONG), marks.count(HINT)
        print(f"{wrong} wrong, {hints} hints" if wrong or hints else "everything is ok", flush=True)
    run_check("the end", _unregister, _END_TIMEOUT)
    os._exit(1 if WRONG in marks else 0)  # at a normal exit, a thread of rospy may wait for a master that is gone


def _unregister() -> list[Line]:
    rospy = sys.modules.get("rospy")
    if rospy is not None and rospy.core.is_initialized():
        rospy.signal_shutdown("ended")
    return []
