"""Helper that ends the processes of a test and kills those that hang, so that the test fails with a message."""

import shlex
import signal
import subprocess

HANGS = 90.0  # s; nothing takes nearly as long to end unless it hangs


def end(*processes, number=signal.SIGTERM):
    """Send a signal to `processes` and wait until they end; kill those that hang, and fail with their commands."""
    running = [one for one in processes if one.poll() is None]
    for process in running:
        process.send_signal(number)
    hung = [process for process in running if not _ends(process)]
    commands = "; ".join(shlex.join(map(str, process.args)) for process in hung)
    assert not hung, f"killed, since {signal.Signals(number).name} did not end them within {HANGS:g} s: {commands}"


def _ends(process):
    try:
        process.communicate(timeout=HANGS)  # reads the pipe: a full pipe would block the process
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait(HANGS)
        return False
    return True
