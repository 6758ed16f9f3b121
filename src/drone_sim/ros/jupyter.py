"""Tile *Drone simulator* of JupyterLab: jupyter-server-proxy starts master, simulator and cockpit, and ends them.

They run in network and process namespaces of their own: no other user of the machine reaches a port of theirs, and all
of them end with the server, even if it is killed. The only way in is the UNIX socket of the proxy.

A container for one user is such namespaces already, and forbids others inside. Its image says so by a variable. There
ROS listens only at the container's own loopback, which no other container reaches.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

_ISOLATED = (
    *("bwrap", "--dev-bind", "/", "/", "--proc", "/proc", "--unshare-net", "--unshare-pid", "--die-with-parent"),
    "--",
)
# After an exit status of 0 the proxy would not start it again.
_LAUNCH = 'roslaunch --skip-log-check drone_sim drone.launch rviz:=false web:=true web_socket:="$0"; exit 1'
_SINGLE_USER = "DRONE_SIM_SINGLE_USER_CONTAINER"  # set in the image of packaging/jupyterhub
_TIMEOUT = 120  # s, for the page to answer, on a machine that starts many at once


def server() -> dict[str, Any]:
    """Return the entry of the group `jupyter_serverproxy_servers`.

    Raises OSError if the simulator cannot be started here: then there is no tile, and the server logs the reason.
    """
    isolated = () if os.environ.get(_SINGLE_USER) else _ISOLATED
    find = [*isolated, "sh", "-c", "command -v roslaunch || echo no roslaunch on the PATH >&2"]
    trial = subprocess.run(find, capture_output=True, text=True, check=False)
    if trial.stderr:
        raise OSError(" ".join(trial.stderr.split())[:300])
    return {
        "command": [*isolated, "sh", "-c", _LAUNCH, "{unix_socket}"],
        "environment": {"ROS_MASTER_URI": "http://localhost:11311", "ROS_HOSTNAME": "localhost"},
        "unix_socket": True,
        "timeout": _TIMEOUT,
        "launcher_entry": {"title": "Drone simulator", "icon_path": str(Path(__file__).with_suffix(".svg"))},
    }
