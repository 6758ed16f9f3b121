"""The arguments that roslaunch was given: it leaves out, without a word, one that the launch file does not have."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

from drone_sim.files.resources import package_path
from drone_sim.run.parameters import ParameterError
from drone_sim.wording import near_names

_SUFFIXES = (".launch", ".xml", ".test")


def check_launch_arguments() -> None:
    """Raise ParameterError for an argument on roslaunch's command line that the launch file does not have.

    Looks only where this process's parent is a roslaunch of one of ours alone: what another launch file, that
    includes it, does with its own arguments is not known here, and roslaunch itself refuses wrong ones of an include.
    """
    parent = Path(f"/proc/{os.getppid()}")
    try:
        command = (parent / "cmdline").read_bytes().decode(errors="replace").split("\0")
        folder = Path(os.readlink(parent / "cwd"))
    except OSError:  # not on Linux, or the parent has ended
        return
    check(command, folder)


def check(command: Sequence[str], folder: Path) -> None:
    """Raise ParameterError for a wrong argument of a command that was given in a folder."""
    arguments = _arguments(command)
    files = [number for number, one in enumerate(arguments) if one.endswith(_SUFFIXES) and ":=" not in one]
    for launch in sorted((package_path() / "launch").glob("*.launch")):
        if len(files) == 1 and _is(launch, arguments, files[0], folder):
            _check_names(launch, arguments)


def _check_names(launch: Path, arguments: Sequence[str]) -> None:
    known = [str(one.get("name")) for one in ElementTree.parse(launch).getroot().findall("arg")]
    for argument in arguments:
        name, given, _ = argument.partition(":=")
        if given and not name.startswith("__") and name not in known:
            raise ParameterError(f"{argument}: {launch.name} has no argument {name}; {near_names(name, known)}")


def _arguments(command: Sequence[str]) -> list[str]:
    """Return what follows `roslaunch`; nothing for another program."""
    for number, word in enumerate(command[:2]):  # python may come first
        if Path(word).name == "roslaunch":
            return list(command[number + 1 :])
    return []


def _is(launch: Path, arguments: Sequence[str], number: int, folder: Path) -> bool:
    """Whether an argument means that launch file, as a path or as `PACKAGE FILE`."""
    if number and arguments[number - 1] == "drone_sim" and arguments[number] == launch.name:
        return True
    path = folder / arguments[number]
    return path.is_file() and path.samefile(launch)
