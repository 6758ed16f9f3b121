"""`rosrun drone_sim doctor`: checks the set-up; each line says ok, or what to do."""

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

_SECONDS = 10.0  # for a check
_AT_THE_END = 2.0  # s, for saying goodbye to the master
_SOON = 1e-3  # s; 0 would be never
_EPILOG = "The exit status is 0, or 1 if something is WRONG. It works without a master."


Check = Callable[[], Iterable[Line]]


def run_checks(thorough: bool = True) -> Iterator[Line]:
    """Yield what the checks find, as it is found; with `thorough` those that take long, too. Main thread only."""
    master = Master()
    checks: list[tuple[str, Check, float]] = [
        ("Python", environment.python, _SECONDS),
        ("ROS", environment.ros, _SECONDS),
        *([("packages", packages.packages, packages.TIMEOUT + _SECONDS)] if thorough else []),
        ("host names", environment.host_names, _SECONDS),
        ("host names", environment.across, _SECONDS),
        ("master", master.found, _SECONDS),
        ("clock", master.clocks, _SECONDS),
        ("nodes", master.dead, _SECONDS),
        ("commands", master.commands, _SECONDS),
        ("simulator", lambda: simulator(master), _SECONDS),
    ]
    for what, check, seconds in checks:
        yield from run_check(what, check, seconds)


class _TooLongError(Exception):
    pass


def run_check(what: str, check: Check, seconds: float) -> list[Line]:
    """Return what a check finds; where it fails or takes longer than `seconds` (real time), that. Main thread only."""
    try:
        with _limited(seconds):
            found = list(check())
    except _TooLongError:
        found = [Line(WRONG, what, f"no answer within {seconds:g} s")]
    except Exception as error:  # whatever is broken here is what the user wants to know
        found = [Line(WRONG, what, f"cannot be checked: {type(error).__name__}: {error}")]
    return found


@contextlib.contextmanager
def _limited(seconds: float) -> Iterator[None]:
    def expire(_number: int, _frame: FrameType | None) -> None:
        raise _TooLongError

    before = signal.signal(signal.SIGALRM, expire)
    left, again = signal.setitimer(signal.ITIMER_REAL, seconds)  # of a timer that somebody else has set
    began = time.monotonic()
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        if left:
            signal.setitimer(signal.ITIMER_REAL, max(left - (time.monotonic() - began), _SOON), again)


def main() -> int:
    """Print the lines; return the exit status."""
    parser = Parser(prog="doctor", description=__doc__, epilog=_EPILOG)
    parser.add_argument("--quick", action="store_true", help="skip packages, pictures and the test flight")
    given = [one for one in sys.argv[1:] if ":=" not in one]  # roslaunch's and rosrun's
    thorough = not parser.parse_args(given).quick
    socket.setdefaulttimeout(TIMEOUT)
    marks: list[str] = []
    with contextlib.suppress(BrokenPipeError):  # who reads has seen enough
        for line in run_checks(thorough):
            marks.append(line.mark)
            print(line, flush=True)
        wrong, hints = marks.count(WRONG), marks.count(HINT)
        print(f"{wrong} wrong, {hints} hints" if wrong or hints else "everything is ok", flush=True)
    run_check("the end", _goodbye, _AT_THE_END)
    os._exit(1 if WRONG in marks else 0)  # a thread of rospy's may wait for a master that has gone


def _goodbye() -> list[Line]:
    rospy = sys.modules.get("rospy")
    if rospy is not None and rospy.core.is_initialized():
        rospy.signal_shutdown("ended")
    return []
