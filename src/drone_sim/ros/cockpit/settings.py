"""What a user may set of the cockpit, by its private parameters; checked before anything begins."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.files.resources import locate
from drone_sim.ros.node.paths import from_shell
from drone_sim.wording import near_names, shown

_NODE = re.compile(r"[/A-Za-z][\w/]*", re.ASCII)


class Settings(NamedTuple):
    """Address and port as given, which `address.free_place` checks; folder of scripts; the simulation's node."""

    address: Any = "127.0.0.1"
    port: Any = 8080
    scripts: Path = Path("~/drone_scripts")  # not ~/drone_sim, where a checkout of this package may be
    simulator: str = "drone_sim"


def read(given: Any) -> Settings:
    """Return the settings in a node's private parameters. Raises ValueError, and FileNotFoundError for a home."""
    if not isinstance(given, Mapping):
        raise ValueError(f"the node's parameters: must be a mapping, not {shown(given)}")
    for name in given.keys() - set(Settings._fields):
        raise ValueError(f"{name}: is no parameter of the cockpit; {near_names(name, Settings._fields)}")
    folder = given.get("scripts", str(Settings().scripts))
    if not isinstance(folder, str) or not folder:
        raise ValueError(f"scripts = {shown(folder)}: must be the name of a folder")
    node = given.get("simulator", Settings().simulator)
    if not isinstance(node, str) or not _NODE.fullmatch(node):
        raise ValueError(f"simulator = {shown(node)}: must be the name of a node, such as drone_sim")
    scripts = locate(from_shell(folder if folder.startswith(("/", "~")) else f"./{folder}"))
    return Settings(**{**given, "scripts": scripts, "simulator": node})
