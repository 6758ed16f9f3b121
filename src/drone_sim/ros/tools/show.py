"""Open rviz with all vehicles, whatever their names are, seen from behind the first one.

It waits for the simulator, asks the master where the topics for rviz are and /tf_static which vehicle is the first,
lays those names over rviz/drone.rviz, or over rviz/fleet.rviz where several fly, and then runs rviz.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import rosgraph
import rospkg
import rospy
from roslib.packages import find_node
from tf2_msgs.msg import TFMessage

from drone_sim.command_line import FAILED, SIGNALLED, Parser, status_of
from drone_sim.files import writing
from drone_sim.files.resources import cache_path, package_path
from drone_sim.ros.core.launch_parameters import from_shell
from drone_sim.ros.core.message_conversion import first_frame
from drone_sim.ros.core.startup import poll_master

_NAME = "show"
INSTEAD = (
    "`apt install rviz` installs it (Debian testing has none);"
    " `roslaunch drone_sim drone.launch web:=true` shows the simulation in a browser"
)
_RVIZ = "rviz"  # which need not be there
_CRASHES = (-signal.SIGSEGV, -signal.SIGABRT)
_STARTS, _STARTING = 3, 20.0  # how often rviz is started, if it has crashed within so many s
_PATHS = "ROS_PACKAGE_PATH"
_PATIENCE = 5.0  # s, for the frame that rviz follows
_TOPIC = "/view/state"  # that the simulator advertises for rviz: the last one
_ALONE, _FIRST, _SIMULATOR = "drone", "drone1", "drone_sim"  # as the files of the package name them
_NAMES = re.compile(rf"\b{_FIRST}\b|(?<=/)(?:{_ALONE}|{_SIMULATOR})(?=/)|(?<= ){_SIMULATOR}(?=/first$)", re.MULTILINE)
_TITLES = re.compile(rf"^ *Name: (.*\b{_FIRST})$", re.MULTILINE)


def main() -> int:
    """Run rviz, and return its exit status; return 1, after a line on stderr, where that cannot be.

    Where there is no rviz, a launch goes on without it: roslaunch gets 0, and reports no process that has died.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # nothing is to be put in order
    parser = Parser(prog=_NAME, description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--config", metavar="FILE", default="", help="your own rviz file instead")
    parser.add_argument("--simulator", metavar="NODE", default=_SIMULATOR, help="(default: %(default)s)")
    options = parser.parse_args(rosgraph.myargv(sys.argv)[1:])
    remappings = [one for one in sys.argv[1:] if ":=" in one]
    rviz = find_rviz()
    if rviz is None:
        print(f"{_NAME}: rviz is not installed: {INSTEAD}", file=sys.stderr, flush=True)
        return 0 if any(one.startswith("__log:=") for one in remappings) else FAILED
    return status_of(_NAME, lambda: _show(rviz, options, remappings))


def _show(rviz: str, options: argparse.Namespace, remappings: Sequence[str]) -> int:
    """Return rviz's exit status. Raises OSError and ValueError."""
    config = from_shell(options.config)
    if config and not Path(config).is_file():
        raise OSError(f"--config {config}: no such file")
    simulator = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), options.simulator)
    config = config or str(_fitting(simulator.strip("/")))
    return run([rviz, "-d", config, *remappings], with_media_export(os.environ))


def run(command: Sequence[str], environment: Mapping[str, str]) -> int:
    """Run rviz; return its exit status. If it crashes at the start, as it does at times without a GPU, start it again.

    A signal that ends this process ends rviz.
    """
    ends: list[int] = []
    started: list[subprocess.Popen[bytes]] = []

    def end(number: int, _frame: object) -> None:
        ends.append(number)
        for one in started:
            one.send_signal(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    for start in range(_STARTS):
        began = time.monotonic()
        rviz = subprocess.Popen(command, env=environment)
        started.append(rviz)
        for asked in ends:  # before rviz could be told
            rviz.send_signal(asked)
        status = rviz.wait()
        is_early = time.monotonic() - began < _STARTING
        if status not in _CRASHES or ends or not is_early or start + 1 == _STARTS:
            break
        print(f"{_NAME}: rviz crashed ({signal.strsignal(-status)}): starting it again", file=sys.stderr, flush=True)
    return SIGNALLED - status if status < 0 else status


def with_media_export(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment in which rviz finds the package media_export, the installed one before ours.

    It holds nothing, but without it, as on Debian, rviz begins with an error.
    """
    paths = filter(None, [environment.get(_PATHS), str(package_path() / "rviz" / "packages")])
    return {**environment, _PATHS: os.pathsep.join(paths)}


def _fitting(simulator: str) -> Path:
    """Return a file for what flies: one of the package's, or one made of it."""
    above = _topics_of(simulator)
    alone = above != simulator
    names = {_SIMULATOR: simulator, **({_ALONE: above} if alone else {_FIRST: _first_vehicle(simulator) or _FIRST})}
    template = package_path() / "rviz" / ("drone.rviz" if alone else "fleet.rviz")
    if all(name == given for name, given in names.items()):
        return template
    made = cache_path() / "rviz" / template.name
    made.parent.mkdir(parents=True, exist_ok=True)
    writing.write(made, renamed(template.read_text(encoding="utf-8"), names))
    return made


def renamed(text: str, names: Mapping[str, str]) -> str:
    """Return the text of a file of rviz with other names in its topics, frames and titles.

    The file also holds the layout of the docks: Qt writes their titles as UTF-16 in hexadecimal digits, each after its
    length.
    """
    for title in _TITLES.findall(text):
        text = text.replace(_as_dock(title), _as_dock(_renamed(title, names)))
    return _renamed(text, names)


def _renamed(text: str, names: Mapping[str, str]) -> str:
    return _NAMES.sub(lambda found: names.get(found[0], found[0]), text)


def _as_dock(title: str) -> str:
    coded = title.encode("utf-16-be")
    return f"{len(coded):08x}{coded.hex()}"


def _topics_of(simulator: str) -> str:
    """Wait for the simulator, and return the namespace of its topics for rviz. Raises OSError without a master."""

    def ask(master: rosgraph.Master) -> str | None:
        own = (topic for topic, nodes in master.getSystemState()[0] if f"/{simulator}" in nodes)
        return next((str(topic)[: -len(_TOPIC)].strip("/") for topic in own if topic.endswith(_TOPIC)), None)

    return poll_master(_NAME, ask, f"the node /{simulator}")


def _first_vehicle(simulator: str) -> str:
    """Return the name of the vehicle, one of several, that the view follows, '' for none. Raises OSError."""
    first = first_frame(simulator)
    found: list[str] = []
    come = threading.Event()

    def look(message: TFMessage) -> None:
        for one in message.transforms:
            if one.child_frame_id == first:
                found.append(one.header.frame_id.rpartition("/")[0])
                come.set()

    rospy.init_node(_NAME, argv=[], anonymous=True, disable_signals=True)
    rospy.Subscriber("/tf_static", TFMessage, look)
    in_time = come.wait(_PATIENCE)
    rospy.signal_shutdown("done")
    if not in_time:
        raise OSError(f"no node publishes the frame {first}")
    return found[-1]


def find_rviz() -> str | None:
    """Return the file of rviz, None where it is not installed."""
    try:
        found: list[str] = find_node(_RVIZ, _RVIZ)
    except rospkg.ResourceNotFound:
        return None
    return found[0] if found else None
