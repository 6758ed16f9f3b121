"""The shell that the doctor was called from: Python, ROS, folders."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from drone_sim.files.resources import package_path
from drone_sim.ros.doctor.line import HINT, OK, WRONG, Line

_OLDEST = (3, 10)
_COMMANDS = ("roslaunch", "rosrun", "rosmaster")


def python() -> Iterator[Line]:
    """Is it a Python that will do, and the one that other packages' nodes find?"""
    version = "{}.{}.{}".format(*sys.version_info)
    if sys.version_info < _OLDEST:
        yield Line(WRONG, "Python", f"{version}, but 3.10 is the oldest that will do")
        return
    first, own = shutil.which("python3"), package_path() / ".venv/bin"
    if own.is_dir() and Path(sys.executable).parent != own:
        yield Line(WRONG, "Python", f"the doctor runs on {sys.executable}, its package's modules are in {own.parent}")
    else:
        yield Line(OK, "Python", f"{version}, {sys.executable}")
    if own.is_dir() and (first is None or Path(first).parent != own):
        cure = f"`source {package_path()}/devel/setup.bash` puts {own} first"
        yield Line(HINT, "Python", f"the python3 on the PATH is {first}, which lacks the package's modules: {cure}")


def ros() -> Iterator[Line]:
    """Is a ROS 1 sourced, and this package in it?"""
    cure = f"`source {package_path()}/devel/setup.bash`"
    if os.environ.get("ROS_VERSION", "1") != "1":
        said = f"ROS {os.environ['ROS_VERSION']} is sourced: take a fresh terminal, and there {cure} alone"
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
        return Line(WRONG, "ROS", f"does not find the package drone_sim: {cure}")
    if found.resolve() != package_path().resolve():
        return Line(WRONG, "ROS", f"roslaunch would start the drone_sim in {found}, not this one: {cure}")
    return Line(OK, "ROS", f"{os.environ.get('ROS_DISTRO', 'ROS 1')}, drone_sim in {found}")


def _rviz() -> Line:
    from drone_sim.ros.tools import viewer

    found = viewer.rviz()
    if found is None:
        return Line(HINT, "rviz", f"is not installed, and Debian testing has none: {viewer.INSTEAD}")
    return Line(OK, "rviz", found)


def _log_folder() -> Line:
    home = os.environ.get("ROS_HOME") or "~/.ros"
    folder = Path(os.environ.get("ROS_LOG_DIR") or Path(home) / "log").expanduser()
    there = next(one for one in (folder, *folder.parents) if one.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        return Line(WRONG, "log folder", f"{there} cannot be written to: roslaunch will not start")
    free = shutil.disk_usage(there).free / 2**20
    if free < 100:
        return Line(HINT, "log folder", f"{folder} has {free:.0f} MiB left: `rosclean purge` frees what old runs left")
    return Line(OK, "log folder", str(folder))
