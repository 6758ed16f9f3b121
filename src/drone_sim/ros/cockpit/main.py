"""`rosrun drone_sim cockpit`: checks the parameters, serves the page, and then imports the rest."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import rospy

from drone_sim.files.resources import locate
from drone_sim.message_text import near_names, shown
from drone_sim.ros.cockpit.server.address import address_file, print_to_terminal
from drone_sim.ros.cockpit.server.page_server import PageServer
from drone_sim.ros.core.shell_files import from_shell
from drone_sim.ros.core.shutdown import end_on_signals
from drone_sim.ros.core.startup import init_node, status_of_node

_NAME = "cockpit"
_NODE = re.compile(r"[/A-Za-z][\w/]*", re.ASCII)


class CockpitParameters(NamedTuple):
    """Parameters of the node. `PageServer` checks the address and the port; `simulator` is the simulator's node."""

    address: Any = "127.0.0.1"
    port: Any = 8080
    scripts: Path = Path("~/drone_scripts")  # not ~/drone_sim, where a checkout of this package may be
    simulator: str = "drone_sim"
    socket: str = ""  # a UNIX socket for a proxy of the same user, instead of address and port


def read_parameters(given: Any) -> CockpitParameters:
    """Return the node's parameters with defaults. Raises ValueError, or FileNotFoundError for an unknown home."""
    if not isinstance(given, Mapping):
        raise ValueError(f"the node's parameters: must be a mapping, not {shown(given)}")
    for name in given.keys() - set(CockpitParameters._fields):
        raise ValueError(f"{name}: is not a parameter of the cockpit; {near_names(name, CockpitParameters._fields)}")
    folder = given.get("scripts", str(CockpitParameters().scripts))
    if not isinstance(folder, str) or not folder:
        raise ValueError(f"scripts = {shown(folder)}: must be the name of a folder")
    node = given.get("simulator", CockpitParameters().simulator)
    if not isinstance(node, str) or not _NODE.fullmatch(node):
        raise ValueError(f"simulator = {shown(node)}: must be the name of a node, such as drone_sim")
    socket = given.get("socket", CockpitParameters().socket)
    if not isinstance(socket, str):
        raise ValueError(f"socket = {shown(socket)}: must be the name of a UNIX socket, or none")
    scripts = locate(from_shell(folder if folder.startswith(("/", "~")) else f"./{folder}"))
    return CockpitParameters(**{**given, "scripts": scripts, "simulator": node, "socket": from_shell(socket)})


def main() -> int:
    """Serve until the node ends, and return the exit status."""
    # Anonymous, since there may be several cockpits. Real time, because /clock stands still during a pause.
    if not init_node(_NAME, anonymous=True, disable_rostime=True, disable_signals=True):
        return 1
    end_on_signals()
    return status_of_node(_NAME, _serve)


def _serve() -> None:
    parameters = read_parameters(rospy.get_param("~", {}))
    server = PageServer(parameters.address, parameters.port, parameters.socket)
    with contextlib.ExitStack() as stack:
        if parameters.socket:
            rospy.loginfo(f"the cockpit listens at {parameters.socket}, for a proxy of the same user")
        else:
            where = stack.enter_context(address_file(server.address, server.port))
            rospy.loginfo(f"the cockpit listens at {server.address.partition('?')[0]}; {where}")
            print_to_terminal(f"the cockpit is at {server.addresses}")

        from drone_sim.ros.cockpit.cockpit import Cockpit  # takes more than a second

        Cockpit(server, parameters.simulator, parameters.scripts).run()


if __name__ == "__main__":
    sys.exit(main())
