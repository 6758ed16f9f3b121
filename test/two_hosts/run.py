#!/usr/bin/env python3
"""`./dev.sh two-hosts [--cut SECONDS]`: the simulator on one host, a student's node on another, a bad network between.

The hosts are network namespaces of this machine; whoever is not root makes them in a namespace of users, where the
kernel allows that. They, their interfaces and all processes go with this one. Commands go one way, compressed pictures
the other; then the wire is cut, comes back, gets slow and bad, and is cut for good. Exit status 1 where the drone did
not do what cmd_vel_timeout says, something hung or died, commands and pictures did not come back, or nothing could be
tried. It takes a minute.
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
    """Go into namespaces of its own, and run there."""
    parser = argparse.ArgumentParser(prog="./dev.sh two-hosts", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--cut", type=_seconds, default=CUT, help="s for which the wire is cut (default: %(default)s)")
    options = parser.parse_args()
    if _INSIDE in os.environ:
        return _run(Path(os.environ[_INSIDE]), options.cut)
    missing = _missing()
    if missing:
        print(f"two-hosts: {missing}")
        return 1
    for asked in (signal.SIGINT, signal.SIGTERM):
        signal.signal(asked, lambda number, _frame: sys.exit(128 + number))
    return _inside(sys.argv[1:])


def _seconds(text: str) -> float:
    try:
        if SHORTEST <= float(text) <= LONGEST:
            return float(text)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"'{text}': must be a number from {SHORTEST:g} to {LONGEST:g}")


def _missing() -> str:
    """Return what is not here, or not allowed; nothing where all is."""
    try:
        interface = ["ip", "tuntap", "add", "wire0", "mode", "tun"]
        tried = subprocess.run([*_NAMESPACES, *interface], capture_output=True, text=True)
    except FileNotFoundError:
        return "there is no unshare (Debian: util-linux)"
    said = " ".join(tried.stderr.split())
    return f"no network namespaces with TUN interfaces can be made here ({said})" if tried.returncode else ""


def _inside(arguments: list[str]) -> int:
    """Run this file in namespaces of its own, out of reach of the terminal's Ctrl-C; with it, all in there ends."""
    with tempfile.TemporaryDirectory(prefix="drone_sim_two_hosts_", ignore_cleanup_errors=True) as folder:
        command = [*_NAMESPACES, sys.executable, __file__, *arguments]
        inside = subprocess.Popen(command, env={**os.environ, _INSIDE: folder}, start_new_session=True)
        try:
            return inside.wait()
        finally:
            inside.kill()


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
    print(*[f"WRONG: {said}" for said in wrong] or ["two-hosts: all as it should be"], sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
