"""rviz, which need not be there: Debian testing has none."""

from __future__ import annotations

import rospkg
from roslib.packages import find_node

INSTEAD = "`roslaunch drone_sim drone.launch web:=true` shows the simulation in a browser"
_PACKAGE = "rviz"


def rviz() -> str | None:
    """Return the file of rviz, None where it is not installed."""
    try:
        found: list[str] = find_node(_PACKAGE, _PACKAGE)
    except rospkg.ResourceNotFound:
        return None
    return found[0] if found else None
