"""Where the token is told: on the terminal, and in a file for its user alone. What is logged is without it."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

import rospkg

_MODE = stat.S_IRUSR | stat.S_IWUSR


@contextlib.contextmanager
def kept(address: str, port: int) -> Iterator[str]:
    """Keep the address in `$ROS_HOME/drone_sim/cockpit_PORT.txt` meanwhile; give one line on where it is."""
    file = Path(rospkg.get_ros_home()) / "drone_sim" / f"cockpit_{port}.txt"
    content = f"{address}\n"
    try:
        _write(file, content)
    except OSError as error:
        yield f"the token that opens it is on the terminal alone: {file}: {error.strerror}"
        return
    try:
        yield f"the address with the token that opens it is in {file}"
    finally:
        with contextlib.suppress(OSError, ValueError):
            if file.read_text(encoding="utf-8") == content:  # or another one is at that port by now
                file.unlink()


def _write(file: Path, content: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.unlink(missing_ok=True)  # of one that was killed; whoever may read that must not read this
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, _MODE)
    with os.fdopen(descriptor, "w", encoding="utf-8") as opened:
        opened.write(content)


def tell(line: str) -> None:
    """Print a line for the user, but not into the log that roslaunch makes of nodes without output="screen"."""
    if sys.stdout is None or _is_logged():
        return
    with contextlib.suppress(OSError):  # nobody reads it
        print(line, flush=True)


def _is_logged() -> bool:
    try:
        target = os.readlink(f"/proc/self/fd/{sys.stdout.fileno()}")
    except (OSError, ValueError):  # no file at all, as in a test
        return False
    return target.startswith(os.path.realpath(rospkg.get_log_dir()) + os.sep)
