"""The watchdog: a process ends after a signal, whatever it does, and the watchdog ends with it."""

import contextlib
import os
import signal
import subprocess
import sys

import pytest

SOURCE = os.pathsep.join(path for path in sys.path if path)
TIMEOUT = 90.0  # s; every process ends much sooner unless it hangs
BEGIN = """
import ctypes, os, signal, sys, threading, time
from drone_sim.run import watchdog
watchdog._SCRIPT_PATIENCE = 1.0  # s, more than which a script may take outside of its time, and after it
watchdog = watchdog.Watchdog("it")
def hang():
    mutex = ctypes.create_string_buffer(64)
    while True: ctypes.PyDLL(None).pthread_mutex_lock(mutex)
"""


# Each program runs after BEGIN and then gets a signal. All run in parallel, since they mostly wait.
HANG = "hang()"  # in a call that holds the GIL and that no signal ends
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
    "ends": (READY + "import atexit\natexit.register(lambda: print('saved', file=sys.stderr))\nwatchdog.end(3)", None),
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
    """Start all programs, send the signals after the first line of output, and yield a function that awaits the end."""
    started = {name: _start(program) for name, (program, _) in PROGRAMS.items()}
    for name, process in started.items():
        assert process.stdout.readline() == "begun\n", name
        if PROGRAMS[name][1] is not None:
            process.send_signal(PROGRAMS[name][1])

    def ended(name):
        """Return exit status and stderr, which is complete when the watchdog has also ended."""
        _, errors = started[name].communicate(timeout=TIMEOUT)
        return started[name].returncode, errors

    yield ended
    for process in started.values():
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # with its forks
        process.communicate(timeout=TIMEOUT)


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
def test_process_that_ignores_the_signal_is_killed_after_one_line(ended, where):
    status, errors = ended(where)
    assert status == -signal.SIGKILL
    assert errors.startswith("it: killed: it did not end within 2.5 s") and errors.count("\n") == 1


@pytest.mark.parametrize("which", ["a script in a call that holds Python's lock", "a script that hides from the alarm"])
def test_a_script_that_nothing_can_stop_is_killed_after_one_line(ended, which):
    status, errors = ended(which)
    assert status == -signal.SIGKILL
    assert errors.startswith("it: killed: [init] some.py: did not return after 0.5 s (script_time_limit)")
    assert errors.count("\n") == 1


def test_paused_time_and_time_after_a_script_do_not_count(ended):
    assert ended("a script that pauses") == (4, "")


@pytest.mark.parametrize("which", ["ends beside a thread", "ends with atexit"])
def test_remaining_threads_and_exit_handlers_do_not_keep_the_process_alive(ended, which):
    status, errors = ended(which)
    assert status == 3 and errors.startswith("it: ended without waiting for ") and errors.count("\n") == 1


def test_end_waits_for_exit_handlers_that_end_in_time(ended):
    assert ended("ends") == (3, "saved\n")


def test_further_signals_do_not_extend_the_time(ended):
    assert ended("more signals")[0] == -signal.SIGKILL


def test_process_that_reacts_to_the_signal_chooses_its_exit_status(ended):
    assert ended("looks") == (7, "")


def test_watchdog_ignores_other_signals(ended):
    assert ended("another signal") == (0, "")


def test_a_signal_during_startup_ends_the_process_without_a_message(ended):
    assert ended("not ready") == (-signal.SIGINT, "")


def test_count_starts_the_time_limit_without_a_signal(ended):
    assert ended("counts")[0] == -signal.SIGKILL


def test_signal_after_stand_down_ends_the_process(ended):
    assert ended("stands down") == (-signal.SIGINT, "")


def test_watchdog_ends_with_a_killed_process(ended):
    assert ended("killed") == (-signal.SIGKILL, "")


def test_fork_is_not_watched(ended):
    """Signals to the fork do not count, and its open files do not keep the watchdog alive."""
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
        timeout=TIMEOUT,
    )
    assert ended.stdout == "['pipe', 'pipe']\n", ended.stderr
