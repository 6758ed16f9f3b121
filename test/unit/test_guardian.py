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


# What runs after BEGIN, and the signal that it gets then. All run at once: most of their time is patience.
SPIN, LOOKS = "sum(range(10**13))", "while not guardian.asked: time.sleep(0.01)\n"
READY = "guardian.ready()\nprint('begun')\n"
PROGRAMS = {
    "in a call that holds Python's lock": (READY + SPIN, signal.SIGINT),
    "in a call that lets go of it": (READY + "while True: time.sleep(1000)", signal.SIGTERM),
    "in Python": (READY + "while True: time.sleep(0.01)", signal.SIGHUP),
    "more signals": (READY + "while True: time.sleep(0.1); os.kill(os.getpid(), signal.SIGINT)", None),
    "looks": (READY + LOOKS + "sys.exit(7)", signal.SIGTERM),
    "another signal": (
        "signal.signal(signal.SIGALRM, lambda *_: None)\n" + READY + "os.kill(os.getpid(), signal.SIGALRM)\n"
        "time.sleep(3)\nsys.exit(guardian.asked)",
        None,
    ),
    "not ready": ("print('begun')\n" + SPIN, signal.SIGINT),
    "counts": (READY + "guardian.count()\ntime.sleep(1000)", None),
    "stands down": (
        READY + LOOKS + "guardian.stand_down()\nprint('in hand')\ntime.sleep(3)\nos.kill(os.getpid(), signal.SIGINT)",
        signal.SIGINT,
    ),
    "killed": (READY + SPIN, signal.SIGKILL),
    "a fork": (
        "guardian.ready()\nchild = os.fork()\nif child == 0:\n    time.sleep(1000)\n"
        "os.kill(child, signal.SIGTERM)\nassert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGTERM\n"
        "print('begun')\ntime.sleep(3)\nsys.exit(guardian.asked)",
        None,
    ),
}


@pytest.fixture(name="ended", scope="module")
def _ended():
    """Run all programs up to their first line of output, send the signals, and give what returns how one ended."""
    started = {name: _start(program) for name, (program, _) in PROGRAMS.items()}
    for name, process in started.items():
        assert process.stdout.readline() == "begun\n", name
        if PROGRAMS[name][1] is not None:
            process.send_signal(PROGRAMS[name][1])

    def ended(name):
        """Return exit status and stderr; stderr ends when the guardian has ended, too."""
        _, errors = started[name].communicate(timeout=HANGS)
        return started[name].returncode, errors

    yield ended
    for process in started.values():
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # its forks, too
        process.communicate(timeout=HANGS)


def _start(program):
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN + program],
        env={**os.environ, "PYTHONPATH": SOURCE, "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


STUCK = ("in a call that holds Python's lock", "in a call that lets go of it", "in Python")


@pytest.mark.parametrize("where", STUCK)
def test_what_does_not_look_is_killed_after_one_line(ended, where):
    status, errors = ended(where)
    assert status == -signal.SIGKILL
    assert errors.splitlines() == [
        "it: killed: a script, a file or the ROS master kept it busy for 2.5 s when it had to end"
    ]


def test_more_signals_give_no_more_time(ended):
    assert ended("more signals")[0] == -signal.SIGKILL


def test_what_looks_ends_as_it_likes(ended):
    assert ended("looks") == (7, "")


def test_other_signals_are_not_its_business(ended):
    assert ended("another signal") == (0, "")


def test_before_it_is_ready_a_signal_ends_it_at_once_and_quietly(ended):
    assert ended("not ready") == (-signal.SIGINT, "")


def test_it_counts_without_a_signal_too(ended):
    assert ended("counts")[0] == -signal.SIGKILL


def test_once_it_stands_down_the_next_signal_ends_it(ended):
    assert ended("stands down") == (-signal.SIGINT, "")


def test_it_ends_with_the_process_however_that_ends(ended):
    assert ended("killed") == (-signal.SIGKILL, "")


def test_a_fork_goes_its_own_way(ended):
    """Its signals do not count, and what it holds open does not keep the guardian."""
    assert ended("a fork") == (0, "")
