"""A process ends when it is told to, whatever it does; and the watchdog ends with it."""

import contextlib
import os
import signal
import subprocess
import sys

import pytest

SOURCE = os.pathsep.join(path for path in sys.path if path)
HANGS = 90.0  # s; nothing here takes nearly as long unless it hangs
BEGIN = """
import ctypes, os, signal, sys, threading, time
from drone_sim.run import watchdog
watchdog._SCRIPT_PATIENCE = 1.0  # s, more than which a script may take outside of its time, and after it
watchdog = watchdog.Watchdog("it")
def hang():
    mutex = ctypes.create_string_buffer(64)
    while True: ctypes.PyDLL(None).pthread_mutex_lock(mutex)
"""


# What runs after BEGIN, and the signal that it gets then. All run at once: most of their time is patience.
HANG = "hang()"  # in a call that holds Python's lock, and that no signal ends
LOOKS = "while not watchdog.asked: time.sleep(0.01)\n"
SCRIPT = """
from drone_sim.scripting.time_limit import Labels, TimeLimit
def hide():
    import _signal
    _signal.pthread_sigmask(_signal.SIG_BLOCK, {{_signal.SIGALRM}})
    time.sleep(1000)
def pause():
    limit.outside(lambda: time.sleep(3))
limit = TimeLimit(0.5)
limit.label = Labels("some.py", limit)["init"]
limit.run({})
"""
READY = "watchdog.ready()\nprint('begun')\n"
PROGRAMS = {
    "in a call that holds Python's lock": (READY + HANG, signal.SIGINT),
    "in a call that lets go of it": (READY + "while True: time.sleep(1000)", signal.SIGTERM),
    "in Python": (READY + "while True: time.sleep(0.01)", signal.SIGHUP),
    "more signals": (READY + "while True: time.sleep(0.1); os.kill(os.getpid(), signal.SIGINT)", None),
    "looks": (READY + LOOKS + "sys.exit(7)", signal.SIGTERM),
    "another signal": (
        "signal.signal(signal.SIGALRM, lambda *_: None)\n" + READY + "os.kill(os.getpid(), signal.SIGALRM)\n"
        "time.sleep(3)\nsys.exit(watchdog.asked)",
        None,
    ),
    "not ready": ("print('begun')\n" + HANG, signal.SIGINT),
    "counts": (READY + "watchdog.count()\ntime.sleep(1000)", None),
    "stands down": (
        READY + LOOKS + "watchdog.stand_down()\nprint('in hand')\ntime.sleep(3)\nos.kill(os.getpid(), signal.SIGINT)",
        signal.SIGINT,
    ),
    "a script in a call that holds Python's lock": (READY + SCRIPT.format("lambda: " + HANG), None),
    "a script that hides from the alarm": (READY + SCRIPT.format("hide"), None),
    "a script that pauses": (READY + SCRIPT.format("pause") + "time.sleep(3)\nsys.exit(4)", None),
    "ends beside a thread": (
        READY + "threading.Thread(target=time.sleep, args=(1000,)).start()\nwatchdog.end(3)",
        None,
    ),
    "ends with atexit": (READY + "import atexit\natexit.register(time.sleep, 1000)\nwatchdog.end(3)", None),
    "ends": (READY + "import atexit\natexit.register(print, 'saved')\nwatchdog.end(3)", None),
    "killed": (READY + HANG, signal.SIGKILL),
    "a fork": (
        "watchdog.ready()\nchild = os.fork()\nif child == 0:\n    time.sleep(1000)\n"
        "os.kill(child, signal.SIGTERM)\nassert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGTERM\n"
        "print('begun')\ntime.sleep(3)\nsys.exit(watchdog.asked)",
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
        """Return exit status and stderr; stderr ends when the watchdog has ended, too."""
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
    assert errors.startswith("it: killed: it did not end within 2.5 s") and errors.count("\n") == 1


@pytest.mark.parametrize("which", ["a script in a call that holds Python's lock", "a script that hides from the alarm"])
def test_a_script_that_nothing_can_stop_is_killed_after_one_line(ended, which):
    status, errors = ended(which)
    assert status == -signal.SIGKILL
    assert errors.startswith("it: killed: [init] some.py: did not return after 0.5 s (script_time_limit)")
    assert errors.count("\n") == 1


def test_the_simulators_own_time_and_that_after_a_script_are_not_the_scripts(ended):
    assert ended("a script that pauses") == (4, "")


@pytest.mark.parametrize("which", ["ends beside a thread", "ends with atexit"])
def test_what_a_script_leaves_behind_does_not_keep_the_process(ended, which):
    status, errors = ended(which)
    assert status == 3 and errors.startswith("it: ended without waiting for ") and errors.count("\n") == 1


def test_what_ends_in_time_is_waited_for(ended):
    assert ended("ends") == (3, "")


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
    """Its signals do not count, and what it holds open does not keep the watchdog."""
    assert ended("a fork") == (0, "")


LINKS = """
(child,) = open(f"/proc/self/task/{os.getpid()}/children").read().split()
for _ in range(200_000):
    if len(links := os.listdir(f"/proc/{child}/fd")) == 2: break
print(sorted(os.readlink(f"/proc/{child}/fd/{one}").partition(":")[0] for one in links))
"""


def test_the_watchdog_has_no_file_of_the_process_open(tmp_path):
    opened = f"file = open({str(tmp_path / 'results')!r}, 'w')"
    program = f"{opened}{BEGIN}{LINKS}"
    ended = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": SOURCE},
        capture_output=True,
        text=True,
        timeout=HANGS,
    )
    assert ended.stdout == "['pipe', 'pipe']\n", ended.stderr
