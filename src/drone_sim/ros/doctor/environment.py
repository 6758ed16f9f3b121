"""The shell that the doctor was called from: Python, ROS, folders, the names under which nodes are reached."""

from __future__ import annotations

import os
import shutil
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

from drone_sim.files.resources import package_path
from drone_sim.ros.core.network import MASTER, TIMEOUT, addresses
from drone_sim.ros.doctor import HINT, OK, WRONG, Line

_CURE = "`export ROS_HOSTNAME=localhost` works if all nodes run on this machine"
_OLDEST = (3, 10)
_COMMANDS = ("roslaunch", "rosrun", "rosmaster")


def python() -> Iterator[Line]:
    """Is it a Python that will do, and the one that other packages' nodes find?"""
    version = "{}.{}.{}".format(*sys.version_info)
    if sys.version_info < _OLDEST:
        yield Line(WRONG, "Python", f"{version} is too old: 3.10 or newer is needed")
        return
    first, own = shutil.which("python3"), package_path() / ".venv/bin"
    if own.is_dir() and Path(sys.executable).parent != own:
        yield Line(
            WRONG,
            "Python",
            f"the doctor runs with {sys.executable}, but the package's modules are installed in {own.parent}",
        )
    else:
        yield Line(OK, "Python", f"{version}, {sys.executable}")
    if own.is_dir() and (first is None or Path(first).parent != own):
        cure = f"`source {package_path()}/devel/setup.bash` puts {own} first"
        yield Line(HINT, "Python", f"the python3 on the PATH is {first}, which lacks the package's modules: {cure}")


def ros() -> Iterator[Line]:
    """Is a ROS 1 sourced, and this package in it?"""
    cure = f"`source {package_path()}/devel/setup.bash`"
    if os.environ.get("ROS_VERSION", "1") != "1":
        said = f"ROS {os.environ['ROS_VERSION']} is sourced: open a new terminal and run only {cure}"
        yield Line(WRONG, "ROS", said)
        return
    missing = [one for one in _COMMANDS if shutil.which(one) is None]
    if missing:
        yield Line(WRONG, "ROS", f"no {', '.join(missing)} on the PATH: {cure}, or install ROS with `./dev.sh setup`")
        return
    yield _package(cure)
    yield _rviz()
    yield _log_folder()


def _package(cure: str) -> Line:
    import rospkg

    try:
        found = Path(rospkg.RosPack().get_path("drone_sim"))
    except rospkg.ResourceNotFound:
        return Line(WRONG, "ROS", f"ROS does not find the package drone_sim: {cure}")
    if found.resolve() != package_path().resolve():
        return Line(WRONG, "ROS", f"roslaunch would start drone_sim from {found}, not from this folder: {cure}")
    return Line(OK, "ROS", f"{os.environ.get('ROS_DISTRO', 'ROS 1')}, drone_sim in {found}")


def _rviz() -> Line:
    from drone_sim.ros.tools import show

    found = show.find_rviz()
    if found is None:
        return Line(HINT, "rviz", f"is not installed: {show.INSTEAD}")
    return Line(OK, "rviz", found)


def _log_folder() -> Line:
    home = os.environ.get("ROS_HOME") or "~/.ros"
    folder = Path(os.environ.get("ROS_LOG_DIR") or Path(home) / "log").expanduser()
    there = next(one for one in (folder, *folder.parents) if one.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        return Line(
            WRONG,
            "log folder",
            f"{there} is not writable, so roslaunch will not start: make it writable, or set ROS_LOG_DIR",
        )
    free = shutil.disk_usage(there).free / 2**20
    if free < 100:
        return Line(HINT, "log folder", f"{folder} has {free:.0f} MiB left: `rosclean purge` frees what old runs left")
    return Line(OK, "log folder", str(folder))


def own_host() -> tuple[str, str]:
    """Return the name under which nodes of this shell tell others to reach them, and what says so."""
    for given in ("ROS_HOSTNAME", "ROS_IP"):
        if given in os.environ:
            return os.environ[given], given
    return socket.gethostname(), "the name of this machine"


def is_loopback(host: str) -> bool:
    """Whether a host's name means this machine, from inside only. Raises OSError for one that is not known."""
    return all(one.startswith("127.") or one == "::1" for one in addresses(host))


def host_names() -> Iterator[Line]:
    """Does `localhost` mean this machine, and can its own nodes be reached under their name?"""
    try:
        if not is_loopback("localhost"):
            raise OSError
    except OSError:
        yield Line(
            WRONG,
            "host names",
            "'localhost' does not resolve to this machine: add the line '127.0.0.1 localhost' to /etc/hosts",
        )
    host, given = own_host()
    if {"ROS_HOSTNAME", "ROS_IP"} <= os.environ.keys():
        yield Line(HINT, "host names", f"ROS_IP = '{os.environ['ROS_IP']}' has no effect, because ROS_HOSTNAME is set")
    try:
        addresses(host)
    except OSError:
        yield Line(WRONG, "host names", f"{given} = '{host}' cannot be resolved: {_CURE}")
        return
    yield _reaches_itself(host, given)


def _reaches_itself(host: str, given: str) -> Line:
    """Listen on a free port and connect to it, as another node would."""
    with socket.socket() as listening:
        listening.bind(("", 0))
        listening.listen(1)
        try:
            socket.create_connection((host, listening.getsockname()[1]), timeout=TIMEOUT).close()
        except OSError as error:
            said = f"{given} = '{host}' does not lead back to this machine ({error}): {_CURE}"
            return Line(WRONG, "host names", said)
    return Line(OK, "host names", f"nodes from here are reached at {host} ({given})")


def across() -> Iterator[Line]:
    """Where the master is on another machine: can nodes there reach those from here?"""
    master = urlsplit(os.environ.get("ROS_MASTER_URI", MASTER)).hostname or "localhost"
    host, given = own_host()
    try:
        if is_loopback(host) and not is_loopback(master):
            cure = "`unset ROS_HOSTNAME`, and `export ROS_IP=` with an address of this machine that they can reach"
            yield Line(
                WRONG,
                "host names",
                f"the master is on {master}, and nodes there cannot reach {given} = '{host}': {cure}",
            )
    except OSError:  # said by others
        return
