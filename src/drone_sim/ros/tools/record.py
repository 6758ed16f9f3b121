"""Record a flight: `rosbag record` of all topics except pictures; compressed pictures on request.

What is for rviz alone is not recorded, either. It waits for the simulator, asks the master which topics there are, and
then becomes rosbag's own recorder: topics that come later, as of a vehicle that comes in flight, are not recorded.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NoReturn

import rosgraph
import roslib.packages
import rospkg

from drone_sim.command_line import Parser, status_of
from drone_sim.ros.core.launch_parameters import from_shell
from drone_sim.ros.core.startup import poll_master

_NAME = "record"
_LARGE = r"sensor_msgs/(Image|PointCloud2?)|visualization_msgs/.*|dynamic_reconfigure/.*|theora_image_transport/.*"
_IMAGES = r"sensor_msgs/(CompressedImage|CameraInfo)"  # a twentieth of the raw ones
_OF_OTHERS = ("/rosout_agg", "/clock")  # said twice; told by `rosbag play --clock`, and in the times of all messages
_ENOUGH = 1 << 16  # bytes, for the beginning of a bag; of a disk that fills up later rosbag itself tells
_LAST_SERVICE = "pause"  # that the simulator advertises: its topics are there by then


def main() -> int:
    """Become rosbag's recorder; return 1, after a line on stderr, where that cannot be."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # nothing is recorded yet
    parser = Parser(prog=_NAME, description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--images", choices=("true", "false"), default="false", help="record compressed pictures, too")
    parser.add_argument("--folder", metavar="DIR", default="", help="the folder for the bag (default: ~/.ros)")
    parser.add_argument("--simulator", metavar="NODE", default="drone_sim", help="(default: %(default)s)")
    options = parser.parse_args(rosgraph.myargv(sys.argv)[1:])
    remappings = [one for one in sys.argv[1:] if ":=" in one]
    return status_of(_NAME, lambda: _record(options, remappings))


def chosen(kinds: Mapping[str, str], images: bool) -> list[str]:
    """Return the topics to record, of all with their kinds of message."""
    left_out = _LARGE if images else f"{_LARGE}|{_IMAGES}"
    return sorted(name for name, kind in kinds.items() if name not in _OF_OTHERS and not re.fullmatch(left_out, kind))


def _record(options: argparse.Namespace, remappings: Sequence[str]) -> NoReturn:
    """Raises OSError and ValueError."""
    folder = "" if options.folder in ("", "none") else from_shell(f"{options.folder}/")
    bag = _file(folder)
    recorder = roslib.packages.find_node("rosbag", "record")
    if not recorder:
        raise OSError("rosbag's recorder is not installed (on Debian: python3-rosbag)")
    topics = chosen(_kinds(f"/{options.simulator.strip('/')}"), options.images == "true")
    # roslaunch shows this, and what goes wrong, and keeps the recorder's own lines, one for each topic, in its log.
    print(f"{_NAME}: {len(topics)} topics into {bag}", file=sys.stderr, flush=True)
    os.execv(recorder[0], [recorder[0], "--quiet", "-O", str(bag), *topics, *remappings])


def _file(folder: str) -> Path:
    """Return the name of the bag. Raises OSError where it cannot be written."""
    where = Path(folder or rospkg.get_ros_home()).expanduser()
    if folder and not where.is_dir():
        raise OSError(f"--folder {where}: no such folder")
    try:
        where.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=where) as probe:
            probe.write(bytes(_ENOUGH))
            probe.flush()
    except OSError as error:
        raise OSError(f"--folder {where}: {error.strerror}") from None
    return where / time.strftime("drone_sim_%Y-%m-%d-%H-%M-%S.bag")


def _kinds(simulator: str) -> dict[str, str]:
    """Wait for the simulator, and return all topics with their kinds. Raises OSError without a master."""

    def ask(master: rosgraph.Master) -> dict[str, str] | None:
        try:
            master.lookupService(f"{simulator}/{_LAST_SERVICE}")
        except rosgraph.MasterError:  # not yet
            return None
        return dict(master.getTopicTypes())

    return poll_master(_NAME, ask, f"{simulator}, which is not running yet")
