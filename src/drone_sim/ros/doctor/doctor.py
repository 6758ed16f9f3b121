"""`rosrun drone_sim doctor`: checks the set-up, a line each: ok, or what to do."""

from __future__ import annotations

import argparse
import contextlib
import os
import socket
import sys
from collections.abc import Iterator

from drone_sim.ros.doctor import environment, network, packages, simulator
from drone_sim.ros.doctor.line import HINT, WRONG, Check, Line, lines
from drone_sim.ros.doctor.master import Master

_SECONDS = 10.0  # for a check
_AT_THE_END = 2.0  # s, for saying goodbye to the master
_EPILOG = "Its exit status is 0, or 1 where something is WRONG. No master needs to run."


def checks(thorough: bool) -> list[tuple[str, Check, float]]:
    """Return what to call the checks, the checks in their order, and the seconds that each may take."""
    master = Master()
    return [
        ("Python", environment.python, _SECONDS),
        ("ROS", environment.ros, _SECONDS),
        *([("packages", packages.packages, packages.PATIENCE + _SECONDS)] if thorough else []),
        ("host names", network.names, _SECONDS),
        ("host names", network.across, _SECONDS),
        ("master", master.found, _SECONDS),
        ("clock", master.clocks, _SECONDS),
        ("nodes", master.dead, 3 * _SECONDS),
        ("commands", master.commands, _SECONDS),
        ("simulator", lambda: simulator.simulator(master), _SECONDS),
    ]


def examined(thorough: bool = True) -> Iterator[Line]:
    """Yield what the checks find, as it is found. Main thread only."""
    for what, check, seconds in checks(thorough):
        yield from lines(what, check, seconds)


def _thorough() -> bool:
    parser = argparse.ArgumentParser(prog="doctor", description=__doc__, epilog=_EPILOG)
    parser.add_argument("--quick", action="store_true", help="leave out packages, pictures and the test flight")
    given = [one for one in sys.argv[1:] if ":=" not in one]  # roslaunch's and rosrun's
    return not parser.parse_args(given).quick


def main() -> int:
    """Print the lines; return the exit status."""
    thorough = _thorough()
    socket.setdefaulttimeout(network.PATIENCE)
    marks: list[str] = []
    with contextlib.suppress(BrokenPipeError):  # who reads has seen enough
        for line in examined(thorough):
            marks.append(line.mark)
            print(line, flush=True)
        wrong, hints = marks.count(WRONG), marks.count(HINT)
        print(f"{wrong} wrong, {hints} hints" if wrong or hints else "all is well", flush=True)
    lines("the end", _goodbye, _AT_THE_END)
    os._exit(1 if WRONG in marks else 0)  # a thread of rospy's may wait for a master that has gone


def _goodbye() -> list[Line]:
    rospy = sys.modules.get("rospy")
    if rospy is not None and rospy.core.is_initialized():
        rospy.signal_shutdown("ended")
    return []
