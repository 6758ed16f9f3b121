"""End what a test has begun: a test that waits for ever for a process that hangs says nothing."""

import shlex
import signal
import subprocess

HANGS = 90.0  # s; nothing takes nearly as long to end unless it hangs


def end(*processes, number=signal.SIGTERM):
    """Send processes a signal and wait for their ends; those that hang are killed, and fail the test by their names."""
    running = [one for one in processes if one.poll() is None]
    for process in running:
        process.send_signal(number)
    hung = [process for process in running if not _ends(process)]
    said = "; ".join(shlex.join(map(str, process.args)) for process in hung)
    assert not hung, f"killed, since {signal.Signals(number).name} did not end it within {HANGS:g} s: {said}"


def _ends(process):
    try:
        process.communicate(timeout=HANGS)  # what it prints into a pipe is read, so that it can end
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait(HANGS)
        return False
    return True
