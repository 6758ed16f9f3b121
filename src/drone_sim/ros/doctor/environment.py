"""Checks of the shell: Python, ROS, the log folder, and the host names by which nodes reach each other."""

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
_MIN_VERSION = (3, 10)
_COMMANDS = ("roslaunch", "rosrun", "rosmaster")


def python() -> Iterator[Line]:
    """Check the version of Python, and whether the shell's python3 has the package's modules."""
    version = "{}.{}.{}".format(*sys.version_info)
    if sys.version_info < _MIN_VERSION:
        yield Line(WRONG, "Python", f"{version} is too old: 3.10 or newer is needed")
        return
    first, own = shutil.which("python3"), package_path() / ".venv/bin"
    if own.is_dir() and Path(sys.executable).parent != own:
        problem = f"the doctor runs with {sys.executable}, but the package's modules are installed in {own.parent}"
        yield Line(WRONG, "Python", problem)
    else:
        yield Line(OK, "Python", f"{version}, {sys.executable}")
    if own.is_dir() and (first is None or Path(first).parent != own):
        cure = f"`source {package_path()}/devel/setup.bash` puts {own} first"
        yield Line(HINT, "Python", f"the python3 on the PATH is {first}, which lacks the package's modules: {cure}")


def ros() -> Iterator[Line]:
    """Check that ROS 1 is sourced with this package in it, whether rviz is installed, and the log folder."""
    cure = f"`source {package_path()}/devel/setup.bash`"
    if os.environ.get("ROS_VERSION", "1") != "1":
        version = os.environ["ROS_VERSION"]
        yield Line(WRONG, "ROS", f"ROS {version} is sourced: open a new terminal and run only {cure}")
        return
    missing = [command for command in _COMMANDS if shutil.which(command) is None]
    if missing:
        yield Line(WRONG, "ROS", f"no {', '.join(missing)} on the PATH: {cure}, or install ROS with `./dev.sh setup`")
        return
    yield _package(cure)
    from drone_sim.ros.tools import show

    rviz = show.find_rviz()
    yield Line(OK, "rviz", rviz) if rviz else Line(HINT, "rviz", f"is not installed: {show.INSTEAD}")
    yield _log_folder()


def _package(cure: str) -> Line:
    import rospkg

    try:
        folder = Path(rospkg.RosPack().get_path("drone_sim"))
    except rospkg.ResourceNotFound:
        return Line(WRONG, "ROS", f"ROS does not find the package drone_sim: {cure}")
    if folder.resolve() != package_path().resolve():
        return Line(WRONG, "ROS", f"roslaunch would start drone_sim from {folder}, not from this folder: {cure}")
    return Line(OK, "ROS", f"{os.environ.get('ROS_DISTRO', 'ROS 1')}, drone_sim in {folder}")


def _log_folder() -> Line:
    home = os.environ.get("ROS_HOME") or "~/.ros"
    folder = Path(os.environ.get("ROS_LOG_DIR") or Path(home) / "log").expanduser()
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        problem = f"{existing} is not writable, so roslaunch will not start"
        return Line(WRONG, "log folder", f"{problem}: make it writable, or set ROS_LOG_DIR")
    free = shutil.disk_usage(existing).free / 2**20
    if free < 100:
        return Line(HINT, "log folder", f"{folder} has {free:.0f} MiB left: `rosclean purge` frees what old runs left")
    return Line(OK, "log folder", str(folder))


def own_host() -> tuple[str, str]:
    """Return the host name that nodes of this shell register with the master, and its source for messages."""
    for variable in ("ROS_HOSTNAME", "ROS_IP"):
        if variable in os.environ:
            return os.environ[variable], variable
    return socket.gethostname(), "the name of this machine"


def is_loopback(host: str) -> bool:
    """Return whether a host name resolves to loopback addresses only. Raises OSError for an unknown name."""
    return all(address.startswith("127.") or address == "::1" for address in addresses(host))


def host_names() -> Iterator[Line]:
    """Check that `localhost` is this machine, and that nodes can be reached by the name that they register."""
    try:
        if not is_loopback("localhost"):
            raise OSError
    except OSError:
        cure = "add the line '127.0.0.1 localhost' to /etc/hosts"
        yield Line(WRONG, "host names", f"'localhost' does not resolve to this machine: {cure}")
    host, source = own_host()
    if {"ROS_HOSTNAME", "ROS_IP"} <= os.environ.keys():
        yield Line(HINT, "host names", f"ROS_IP = '{os.environ['ROS_IP']}' has no effect, because ROS_HOSTNAME is set")
    try:
        addresses(host)
    except OSError:
        yield Line(WRONG, "host names", f"{source} = '{host}' cannot be resolved: {_CURE}")
        return
    with socket.socket() as server:  # connect to a free port of this machine, as another node would
        server.bind(("", 0))
        server.listen(1)
        try:
            socket.create_connection((host, server.getsockname()[1]), timeout=TIMEOUT).close()
        except OSError as error:
            problem = f"{source} = '{host}' does not lead back to this machine ({error})"
            yield Line(WRONG, "host names", f"{problem}: {_CURE}")
            return
    yield Line(OK, "host names", f"nodes from here are reached at {host} ({source})")


def remote_master() -> Iterator[Line]:
    """If the master is on another machine, check that nodes there can reach the nodes of this shell."""
    master = urlsplit(os.environ.get("ROS_MASTER_URI", MASTER)).hostname or "localhost"
    host, source = own_host()
    try:
        if is_loopback(host) and not is_loopback(master):
            problem = f"the master is on {master}, and nodes there cannot reach {source} = '{host}'"
            cure = "`unset ROS_HOSTNAME`, and `export ROS_IP=` with an address of this machine that they can reach"
            yield Line(WRONG, "host names", f"{problem}: {cure}")
    except OSError:  # reported by other checks
        return
