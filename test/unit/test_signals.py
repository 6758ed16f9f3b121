"""A signal that arrives while rospy holds a lock that the shutdown also needs: the node ends anyway."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")

PACKAGE = Path(__file__).parents[2]
LIMIT = 90.0  # s; every node ends much sooner unless it hangs

# A node without a master. It holds a lock, as rospy does while a message goes into the queue of a connection, and the
# signal arrives just then; the shutdown takes the same lock, as rospy does to close the connection.
NODE = """
import signal, sys, threading
import rospy
from drone_sim.run.watchdog import Watchdog
class Lock:
    def __init__(self):
        self.lock, self.armed = threading.Lock(), True
        self.acquire, self.release = self.lock.acquire, self.lock.release
    def __enter__(self):
        self.acquire()
        if self.armed:
            self.armed = False
            signal.raise_signal(signal.{signal})
    def __exit__(self, *_):
        self.release()
lock = Lock()
def shut(reason):
    with lock:
        pass
watchdog = Watchdog("node") if {guarded} else None
from drone_sim.ros.core.shutdown import Shutdown, end_on_signals
rospy.core.add_shutdown_hook(shut)
{install}
with lock:
    pass
while not {over}:
    rospy.rostime.wallsleep(0.01)
{last}
print("ended")
"""
WAYS = {
    "shut down": ("end_on_signals()", "rospy.is_shutdown()", "", False),
    "asked": ("shutdown = Shutdown()", "shutdown.is_requested()", "shutdown.complete()", False),
    "guarded": ("shutdown = Shutdown(watchdog)", "shutdown.is_requested()", "shutdown.complete()", True),
}


def run(number, install, over, last, guarded):
    program = NODE.format(signal=number.name, install=install, over=over, last=last, guarded=guarded)
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=LIMIT, check=False, cwd=PACKAGE / "src"
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("way", WAYS)
def test_signal_during_a_write_ends_the_node(way, number):
    done = run(number, *WAYS[way])
    assert (done.returncode, done.stdout, done.stderr) == (0, "ended\n", "")


def test_signal_ignored_by_nohup_stays_ignored():
    install = "signal.signal(signal.SIGHUP, signal.SIG_IGN); end_on_signals()"
    done = run(signal.SIGHUP, install, "signal.raise_signal(signal.SIGTERM) is None and rospy.is_shutdown()", "", False)
    assert (done.returncode, done.stdout) == (0, "ended\n")


def test_every_node_disables_the_signal_handlers_of_rospy():
    files = [file for folder in ("src", "docs", "scripts") for file in (PACKAGE / folder).rglob("*") if file.is_file()]
    calls = {
        f"{file.name}: {call}"
        for file in files
        if file.suffix in ("", ".py")
        and file.parent.name not in ("lockstep", "drivers")  # examples of nodes that users write
        and "html" not in file.parts  # the manual has copies of the examples
        for call in re.findall(r"\binit_node\([^\n]+", file.read_text(encoding="utf-8"))
        if "disable_signals=True" not in call and "**options" not in call
    }
    assert not calls
