"""Files named on the command line: relative to where the user stands, although roslaunch runs nodes in ~/.ros."""

from __future__ import annotations

import os
from pathlib import Path


def from_shell(name: str) -> str:
    """Return the name of a file as it is seen from anywhere; of a built-in script ("target") as it is; "none" is "".

    A relative path is taken from the folder of the shell that ran roslaunch, which hands that shell's PWD on.
    """
    if name == "none":  # roslaunch's arguments cannot default to nothing without looking required
        return ""
    if not name or name.startswith(("package://", "~", "/")) or ("/" not in name and not Path(name).suffix):
        return name
    return str(Path(os.environ.get("PWD") or os.getcwd()) / name)
