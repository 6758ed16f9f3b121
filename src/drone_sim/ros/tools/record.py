"""Record a flight: `rosbag record` of all topics except pictures; compressed pictures on request.

Topics for rviz are not recorded, either. The command waits for the simulator, gets the topics from the master, and then
becomes rosbag's own recorder: topics that are added later, such as those of a new vehicle, are not recorded.
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
from drone_sim.ros.core.shell_files import from_shell
from drone_sim.ros.core.startup import poll_master

_NAME = "record"
_LARGE = r"sensor_msgs/(Image|PointCloud2?)|visualization_msgs/.*|dynamic_reconfigure/.*|theora_image_transport/.*"
_IMAGES = r"sensor_msgs/(CompressedImage|CameraInfo)"  # a twentieth of the size of raw images
_REDUNDANT = ("/rosout_agg", "/clock")  # a copy of /rosout; `rosbag play --clock` publishes the time
_PROBE_SIZE = 1 << 16  # bytes, for a test of the disk; if it fills up later, rosbag reports that
_LAST_SERVICE = "pause"  # the last one that the simulator advertises, after all its topics


def main() -> int:
    """Become rosbag's recorder; return 1, after a line on stderr, if that fails."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # nothing is recorded yet, so nothing can be lost
    parser = Parser(prog=_NAME, description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--images", choices=("true", "false"), default="false", help="record compressed pictures, too")
    parser.add_argument("--folder", metavar="DIR", default="", help="the folder for the bag (default: ~/.ros)")
    parser.add_argument("--simulator", metavar="NODE", default="drone_sim", help="(default: %(default)s)")
    options = parser.parse_args(rosgraph.myargv(sys.argv)[1:])
    remappings = [argument for argument in sys.argv[1:] if ":=" in argument]
    return status_of(_NAME, lambda: _record(options, remappings))


def topics_to_record(kinds: Mapping[str, str], images: bool) -> list[str]:
    """Return the names of the topics to record; `kinds` has the types of all topics."""
    excluded = _LARGE if images else f"{_LARGE}|{_IMAGES}"
    return sorted(name for name, kind in kinds.items() if name not in _REDUNDANT and not re.fullmatch(excluded, kind))


def _record(options: argparse.Namespace, remappings: Sequence[str]) -> NoReturn:
    """Become rosbag's recorder. Raises OSError and ValueError."""
    folder = "" if options.folder in ("", "none") else from_shell(f"{options.folder}/")
    bag = _bag_path(folder)
    recorder = roslib.packages.find_node("rosbag", "record")
    if not recorder:
        raise OSError("rosbag's recorder is not installed (on Debian: python3-rosbag)")
    topics = topics_to_record(_wait_for_topics(f"/{options.simulator.strip('/')}"), options.images == "true")
    # roslaunch shows stderr; the recorder's own lines, one for each topic, go into roslaunch's log.
    print(f"{_NAME}: {len(topics)} topics into {bag}", file=sys.stderr, flush=True)
    os.execv(recorder[0], [recorder[0], "--quiet", "-O", str(bag), *topics, *remappings])


def _bag_path(folder: str) -> Path:
    """Return the path for the new bag. Raises OSError if it cannot be written."""
    parent = Path(folder or rospkg.get_ros_home()).expanduser()
    if folder and not parent.is_dir():
        raise OSError(f"--folder {parent}: no such folder")
    try:
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=parent) as probe:
            probe.write(bytes(_PROBE_SIZE))
            probe.flush()
    except OSError as error:
        raise OSError(f"--folder {parent}: {error.strerror}") from None
    return parent / time.strftime("drone_sim_%Y-%m-%d-%H-%M-%S.bag")


def _wait_for_topics(simulator: str) -> dict[str, str]:
    """Wait for the simulator, and return the types of all topics. Raises OSError without a master."""

    def topic_types(master: rosgraph.Master) -> dict[str, str] | None:
        try:
            master.lookupService(f"{simulator}/{_LAST_SERVICE}")
        except rosgraph.MasterError:  # the simulator is not ready yet
            return None
        return dict(master.getTopicTypes())

    return poll_master(_NAME, topic_types, f"{simulator}, which is not running yet")
