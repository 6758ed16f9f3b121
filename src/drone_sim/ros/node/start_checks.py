"""Checks before the node starts: roslaunch's arguments, and other simulators with the same master."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Sequence
from pathlib import Path

import rosgraph
import rospy

from drone_sim.files.resources import package_path
from drone_sim.message_text import near_names
from drone_sim.ros.core.network import call, is_alive
from drone_sim.run.parameters import ParameterError

_SUFFIXES = (".launch", ".xml", ".test")
_OURS = "set_vehicles"  # a service that only simulators have
_OF_A_VEHICLE = "odom"
_CLOCK = "/clock"


def check_launch_arguments() -> None:
    """Raise ParameterError for an argument on roslaunch's command line that the launch file does not have.

    roslaunch ignores such an argument silently. Checks only if this process's parent is a roslaunch that was given one
    of our launch files: if another launch file includes ours, its own arguments are not known here, and roslaunch
    itself refuses wrong arguments of an include.
    """
    parent = Path(f"/proc/{os.getppid()}")
    try:
        command = (parent / "cmdline").read_bytes().decode(errors="replace").split("\0")
        folder = Path(os.readlink(parent / "cwd"))
    except OSError:  # not on Linux, or the parent has ended
        return
    check(command, folder)


def check(command: Sequence[str], folder: Path) -> None:
    """Raise ParameterError for a wrong argument of a `roslaunch` command that was given in a folder."""
    starts = [number for number, word in enumerate(command[:2], 1) if Path(word).name == "roslaunch"]
    if not starts:  # another program; the first word may be python
        return
    arguments = list(command[starts[0] :])
    files = [number for number, word in enumerate(arguments) if word.endswith(_SUFFIXES) and ":=" not in word]
    for launch in sorted((package_path() / "launch").glob("*.launch")):
        if len(files) == 1 and _is(launch, arguments, files[0], folder):
            known = [str(each.get("name")) for each in ElementTree.parse(launch).getroot().findall("arg")]
            for argument in arguments:
                name, given, _ = argument.partition(":=")
                if given and not name.startswith("__") and name not in known:
                    raise ParameterError(f"{argument}: {launch.name} has no argument {name}; {near_names(name, known)}")


def _is(launch: Path, arguments: Sequence[str], number: int, folder: Path) -> bool:
    """Return whether an argument names the file `launch`, as a path or as `PACKAGE FILE`."""
    if number and arguments[number - 1] == "drone_sim" and arguments[number] == launch.name:
        return True
    path = folder / arguments[number]
    return path.is_file() and path.samefile(launch)


# ---- other simulators


def check_others(vehicles: Iterable[str], simulated: bool) -> None:
    """Raise ValueError if another simulator flies one of `vehicles`, or both would publish /clock.

    Two simulators must not fly the same vehicle, and only one may publish /clock.
    """
    uri = rosgraph.get_master_uri()
    published, _, services = map(dict, call(uri, "getSystemState"))
    own = rospy.get_name()

    def others(topic: str) -> list[str]:
        """Return the simulators that publish a topic, and still answer."""
        nodes = [node for node in published.get(topic, ()) if node != own]
        return [node for node in nodes if node in services.get(f"{node}/{_OURS}", ()) and is_alive(uri, node)]

    for name in vehicles:
        there = others(rospy.resolve_name(f"{name}/{_OF_A_VEHICLE}"))
        if there:
            cure = "a namespace (__ns:=a, or ns of <include>) or another drone/name"
            raise ValueError(f"a vehicle named {name} already flies in {there[0]}: give one of the two {cure}")
    if simulated and others(_CLOCK):
        cure = "two simulators can share one master only in real time (use_sim_time:=false)"
        raise ValueError(f"/use_sim_time is true, but {others(_CLOCK)[0]} already publishes /clock: {cure}")
