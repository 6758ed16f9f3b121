"""Common parts of Lua and Python scripts: fragments of code, put into the phases of a script."""

import re
from pathlib import Path

from case import Case
from hypothesis import strategies as st

_API = Path(__file__).parents[3] / "src" / "drone_sim" / "scripting" / "api"
_PARTS = ("drawings", "matrices", "names", "objects", "scene_objects", "scripts", "signals", "threads", "vision")
_SOURCES = [_API / f"{part}.py" for part in _PARTS]
# Read from the text, so that making cases does not import drone_sim.
FUNCTIONS = sorted({name for path in _SOURCES for name in re.findall(r"^    def ([a-z]\w*)\(", path.read_text(), re.M)})
ROS_FUNCTIONS = (
    *("subscribe", "shutdownSubscriber", "advertise", "publish", "shutdownPublisher", "imageTransportAdvertise"),
    *("imageTransportPublish", "imageTransportShutdownPublisher"),
)
OBJECTS = ("Drone", "Quadricopter_base", "DronePosition", "FrontVision", "Quadricopter_propeller_respondable1", "no")
PHASES = ("", "init", "actuation", "sensing", "cleanup", "thread")


def scripts(suffix, fragments, put):
    """Return a strategy of cases: one to three fragments, each in a phase ('' is the top level), joined by `put`."""
    placed = st.lists(st.tuples(st.sampled_from(PHASES), fragments), min_size=1, max_size=3)
    return placed.map(lambda some: Case("script", {f"script.{suffix}": put(some).encode("utf-8", "replace")}))
