"""A process ends when it is told to, whatever it does; and the guardian ends with it."""

import contextlib
import os
import signal
import subprocess
import sys

import pytest

SOURCE = os.pathsep.join(path for path in sys.path if path)
HANGS = 20.0  # s; nothing here takes nearly as long unless it hangs
BEGIN = """
import os, signal, sys, threading, time
from drone_sim.run.guardian import Guardian
guardian = Guardian("it")
"""


@pytest.fixture(name="start")
def _start():
    started = []

    def start(program):
        """Run a program up to its first line of output."""
        process = subprocess.Popen(
            [sys.executable, "-c", BEGIN + program],
            env={**os.environ, "PYTHONPATH": SOURCE, "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        started.append(process)
        assert process.stdout.readline() == "begun\n"
        return process

    yield start
    for process in started:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # its forks, too
        process.communicate(timeout=HANGS)


def ended(process):
    """Return exit status and stderr; stderr ends when the guardian has ended, too."""
    _, errors = process.communicate(timeout=HANGS)
    return process.returncode, errors


STUCK = {
    "in a call that holds Python's lock": ("sum(range(10**13))", signal.SIGINT),
    "in a call that lets go of it": ("while True: time.sleep(1000)", signal.SIGTERM),
    "in Python": ("while True: time.sleep(0.01)", signal.SIGHUP),
}


@pytest.mark.parametrize(("busy", "number"), STUCK.values(), ids=STUCK)
def test_what_does_not_look_is_killed_after_one_line(start, busy, number):
    process = start("guardian.ready()\nprint('begun')\n" + busy)
    process.send_signal(number)
    status, errors = ended(process)
    assert status == -signal.SIGKILL
    assert errors.splitlines() == [
        "it: killed: a script, a file or the ROS master kept it busy for 2.5 s when it had to end"
    ]


def test_more_signals_give_no_more_time(start):
    again = "while True: time.sleep(0.1); os.kill(os.getpid(), signal.SIGINT)"
    process = start(f"guardian.ready()\nprint('begun')\n{again}")
    assert ended(process)[0] == -signal.SIGKILL


def test_what_looks_ends_as_it_likes(start):
    process = start("guardian.ready()\nprint('begun')\nwhile not guardian.asked: time.sleep(0.01)\nsys.exit(7)")
    process.send_signal(signal.SIGTERM)
    assert ended(process) == (7, "")


def test_other_signals_are_not_its_business(start):
    process = start(
        "signal.signal(signal.SIGALRM, lambda *_: None)\nguardian.ready()\nprint('begun')\n"
        "os.kill(os.getpid(), signal.SIGALRM)\ntime.sleep(3)\nsys.exit(guardian.asked)"
    )
    assert ended(process) == (0, "")


def test_before_it_is_ready_a_signal_ends_it_at_once_and_quietly(start):
    process = start("print('begun')\nsum(range(10**13))")
    process.send_signal(signal.SIGINT)
    assert ended(process) == (-signal.SIGINT, "")


def test_it_counts_without_a_signal_too(start):
    assert ended(start("guardian.ready()\nprint('begun')\nguardian.count()\ntime.sleep(1000)"))[0] == -signal.SIGKILL


def test_once_it_stands_down_the_next_signal_ends_it(start):
    process = start(
        "guardian.ready()\nprint('begun')\nwhile not guardian.asked: time.sleep(0.01)\n"
        "guardian.stand_down()\nprint('in hand')\ntime.sleep(3)\nos.kill(os.getpid(), signal.SIGINT)"
    )
    process.send_signal(signal.SIGINT)
    assert ended(process) == (-signal.SIGINT, "")


def test_it_ends_with_the_process_however_that_ends(start):
    process = start("guardian.ready()\nprint('begun')\nsum(range(10**13))")
    process.kill()
    assert ended(process) == (-signal.SIGKILL, "")


def test_a_fork_goes_its_own_way(start):
    """Its signals do not count, and what it holds open does not keep the guardian."""
    process = start(
        "guardian.ready()\nchild = os.fork()\nif child == 0:\n    time.sleep(1000)\n"
        "os.kill(child, signal.SIGTERM)\nassert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGTERM\n"
        "print('begun')\ntime.sleep(3)\nsys.exit(guardian.asked)"
    )
    assert ended(process) == (0, "")
