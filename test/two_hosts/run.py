#!/usr/bin/env python3
"""`./dev.sh two-hosts [--cut SECONDS]`: the simulator on one host, a student's node on another, a bad network between.

The hosts are network namespaces of this machine; without root they are created in a user namespace, if the kernel
allows that. Namespaces, interfaces and processes end with this process. Commands go one way, compressed images the
other; then the connection is cut, restored, made slow and lossy, and cut for good. The exit status is 1 if the drone
did not obey cmd_vel_timeout, something hung or died, commands and images did not come back, or the test could not run.
It takes a minute.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

_INSIDE = "DRONE_SIM_TWO_HOSTS"
_RIGHTS = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
_NAMESPACES = ["unshare", *_RIGHTS, "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]

TIMEOUT = 0.5  # s, cmd_vel_timeout
CUT, SHORTEST, LONGEST = 10.0, 5.0, 3600.0  # s


def main() -> int:
    """Run the test in new namespaces; return the exit status."""
    parser = argparse.ArgumentParser(prog="./dev.sh two-hosts", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--cut", type=_seconds, default=CUT, help="s for which the wire is cut (default: %(default)s)")
    options = parser.parse_args()
    if _INSIDE in os.environ:
        return _run(Path(os.environ[_INSIDE]), options.cut)
    missing = _missing()
    if missing:
        print(f"two-hosts: {missing}")
        return 1
    for signal_number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signal_number, lambda number, _frame: sys.exit(128 + number))
    return _run_in_namespaces(sys.argv[1:])


def _seconds(text: str) -> float:
    try:
        if SHORTEST <= float(text) <= LONGEST:
            return float(text)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"'{text}': must be a number from {SHORTEST:g} to {LONGEST:g}")


def _missing() -> str:
    """Return what is missing or not permitted on this machine, '' for nothing."""
    try:
        interface = ["ip", "tuntap", "add", "wire0", "mode", "tun"]
        attempt = subprocess.run([*_NAMESPACES, *interface], capture_output=True, text=True)
    except FileNotFoundError:
        return "there is no unshare (Debian: util-linux)"
    reason = " ".join(attempt.stderr.split())
    return f"no network namespaces with TUN interfaces can be made here ({reason})" if attempt.returncode else ""


def _run_in_namespaces(arguments: list[str]) -> int:
    """Run this file in new namespaces, out of reach of the terminal's Ctrl-C; kill their processes at the end."""
    with tempfile.TemporaryDirectory(prefix="drone_sim_two_hosts_", ignore_cleanup_errors=True) as folder:
        command = [*_NAMESPACES, sys.executable, __file__, *arguments]
        child = subprocess.Popen(command, env={**os.environ, _INSIDE: folder}, start_new_session=True)
        try:
            return child.wait()
        finally:
            child.kill()


def _run(folder: Path, cut: float) -> int:
    from hosts import Simulator, Student, settle
    from story import told

    settle(folder)
    try:
        student = Student()
        simulator = Simulator(folder, TIMEOUT)
        student.begin()
    except OSError as error:
        print(f"two-hosts: {error}")
        return 1
    wrong = list(told(simulator, student, TIMEOUT, cut))
    print(*[f"WRONG: {reason}" for reason in wrong] or ["two-hosts: all as it should be"], sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
