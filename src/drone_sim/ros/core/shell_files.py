"""File names of launch arguments, which are relative to the user's shell."""

from __future__ import annotations

import os
from pathlib import Path

NOT_GIVEN = "default"  # the default of launch arguments whose parameters a scene or config may set, too


def from_shell(name: str) -> str:
    """Return a file name that is valid in any folder: a relative path becomes absolute.

    It is relative to the folder of the shell that ran roslaunch: roslaunch runs nodes in ~/.ros, with the shell's PWD.
    The name of a built-in script, such as "target", stays unchanged; "none" becomes "".
    """
    if name == "none":  # roslaunch shows arguments with an empty default as required
        return ""
    if not name or name.startswith(("package://", "~", "/")) or ("/" not in name and not Path(name).suffix):
        return name
    return str(Path(os.environ.get("PWD") or os.getcwd()) / name)


def script_from_shell(name: str) -> str:
    """Return a script's name or file as `from_shell` does, but "none" unchanged, and "" for a launch file's default."""
    return {NOT_GIVEN: "", "none": "none"}.get(name, from_shell(name))
