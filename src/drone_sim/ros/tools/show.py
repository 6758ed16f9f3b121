"""Open rviz with all vehicles, whatever their names are, seen from behind the first one.

The command waits for the simulator, gets the namespace of the topics for rviz from the master, and the first vehicle
from /tf_static. It runs rviz with rviz/drone.rviz, or with rviz/fleet.rviz for several vehicles, with these names.
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
from drone_sim.ros.core.message_conversion import first_frame
from drone_sim.ros.core.shell_files import from_shell
from drone_sim.ros.core.startup import poll_master

_NAME = "show"
INSTEAD = (
    "`apt install rviz` installs it (Debian testing has none);"
    " `roslaunch drone_sim drone.launch web:=true` shows the simulation in a browser"
)
_RVIZ = "rviz"
_CRASHES = (-signal.SIGSEGV, -signal.SIGABRT)
_MAX_STARTS, _EARLY_CRASH = 3, 20.0  # s; rviz is started again only after a crash within this time
_PATHS = "ROS_PACKAGE_PATH"
_FRAME_TIMEOUT = 5.0  # s, for the frame that rviz follows
_TOPIC = "/view/state"  # the last topic that the simulator advertises for rviz
_ALONE, _FIRST, _SIMULATOR = "drone", "drone1", "drone_sim"  # names in the package's rviz files
_NAMES = re.compile(rf"\b{_FIRST}\b|(?<=/)(?:{_ALONE}|{_SIMULATOR})(?=/)|(?<= ){_SIMULATOR}(?=/first$)", re.MULTILINE)
_TITLES = re.compile(rf"^ *Name: (.*\b{_FIRST})$", re.MULTILINE)


def main() -> int:
    """Run rviz and return its exit status; return 1, after a line on stderr, if that fails.

    If rviz is not installed, return 0 to a roslaunch, so that it does not report a process that has died.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # until rviz runs, there is nothing to clean up
    parser = Parser(prog=_NAME, description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--config", metavar="FILE", default="", help="your own rviz file instead")
    parser.add_argument("--simulator", metavar="NODE", default=_SIMULATOR, help="(default: %(default)s)")
    options = parser.parse_args(rosgraph.myargv(sys.argv)[1:])
    remappings = [argument for argument in sys.argv[1:] if ":=" in argument]
    rviz = find_rviz()
    if rviz is None:
        print(f"{_NAME}: rviz is not installed: {INSTEAD}", file=sys.stderr, flush=True)
        is_launched = any(argument.startswith("__log:=") for argument in remappings)
        return 0 if is_launched else FAILED
    return status_of(_NAME, lambda: _show(rviz, options, remappings))


def _show(rviz: str, options: argparse.Namespace, remappings: Sequence[str]) -> int:
    """Return rviz's exit status. Raises OSError and ValueError."""
    config = from_shell(options.config)
    if config and not Path(config).is_file():
        raise OSError(f"--config {config}: no such file")
    simulator = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), options.simulator)
    config = config or str(_config_for(simulator.strip("/")))
    return run([rviz, "-d", config, *remappings], with_media_export(os.environ))


def run(command: Sequence[str], environment: Mapping[str, str]) -> int:
    """Run rviz and return its exit status. If it crashes early, as sometimes without a GPU, start it again.

    SIGINT and SIGTERM are forwarded to rviz.
    """
    signals: list[int] = []
    processes: list[subprocess.Popen[bytes]] = []

    def forward(number: int, _frame: object) -> None:
        signals.append(number)
        for process in processes:
            process.send_signal(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, forward)
    for start in range(_MAX_STARTS):
        began = time.monotonic()
        rviz = subprocess.Popen(command, env=environment)
        processes.append(rviz)
        for received in signals:  # before rviz ran
            rviz.send_signal(received)
        status = rviz.wait()
        is_early = time.monotonic() - began < _EARLY_CRASH
        if status not in _CRASHES or signals or not is_early or start + 1 == _MAX_STARTS:
            break
        print(f"{_NAME}: rviz crashed ({signal.strsignal(-status)}): starting it again", file=sys.stderr, flush=True)
    return SIGNALLED - status if status < 0 else status


def with_media_export(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with the package's own, empty media_export as the last place on ROS_PACKAGE_PATH.

    Without a package media_export, as on Debian, rviz starts with an error.
    """
    paths = filter(None, [environment.get(_PATHS), str(package_path() / "rviz" / "packages")])
    return {**environment, _PATHS: os.pathsep.join(paths)}


def _config_for(simulator: str) -> Path:
    """Return an rviz file with the names of this simulator and its vehicles. Raises OSError."""
    namespace = _wait_for_namespace(simulator)
    is_alone = namespace != simulator
    names = {_SIMULATOR: simulator, **({_ALONE: namespace} if is_alone else {_FIRST: _first_vehicle(simulator)})}
    template = package_path() / "rviz" / ("drone.rviz" if is_alone else "fleet.rviz")
    if all(new == old for old, new in names.items()):
        return template
    config = cache_path() / "rviz" / template.name
    config.parent.mkdir(parents=True, exist_ok=True)
    writing.write(config, rename(template.read_text(encoding="utf-8"), names))
    return config


def rename(text: str, names: Mapping[str, str]) -> str:
    """Return the text of an rviz file with other names in its topics, frames and titles.

    The file also has the layout of the docks: Qt writes their titles as UTF-16 in hexadecimal digits, each after its
    length.
    """

    def replace(part: str) -> str:
        return _NAMES.sub(lambda match: names.get(match[0], match[0]), part)

    def dock(title: str) -> str:
        encoded = title.encode("utf-16-be")
        return f"{len(encoded):08x}{encoded.hex()}"

    for title in _TITLES.findall(text):
        text = text.replace(dock(title), dock(replace(title)))
    return replace(text)


def _wait_for_namespace(simulator: str) -> str:
    """Wait for the simulator, and return the namespace of its topics for rviz. Raises OSError without a master."""

    def namespace(master: rosgraph.Master) -> str | None:
        topics = (topic for topic, nodes in master.getSystemState()[0] if f"/{simulator}" in nodes)
        return next((str(topic)[: -len(_TOPIC)].strip("/") for topic in topics if topic.endswith(_TOPIC)), None)

    return poll_master(_NAME, namespace, f"the node /{simulator}")


def _first_vehicle(simulator: str) -> str:
    """Return the name of the vehicle that the view follows, one of several. Raises OSError."""
    frame = first_frame(simulator)
    vehicles: list[str] = []
    is_received = threading.Event()

    def on_transforms(message: TFMessage) -> None:
        for transform in message.transforms:
            if transform.child_frame_id == frame:
                vehicles.append(transform.header.frame_id.rpartition("/")[0])
                is_received.set()

    rospy.init_node(_NAME, argv=[], anonymous=True, disable_signals=True)
    rospy.Subscriber("/tf_static", TFMessage, on_transforms)
    is_in_time = is_received.wait(_FRAME_TIMEOUT)
    rospy.signal_shutdown("done")
    if not is_in_time:
        raise OSError(f"no node publishes the frame {frame}")
    return vehicles[-1] or _FIRST


def find_rviz() -> str | None:
    """Return the path of rviz's program; None if it is not installed."""
    try:
        paths: list[str] = find_node(_RVIZ, _RVIZ)
    except rospkg.ResourceNotFound:
        return None
    return paths[0] if paths else None
