"""`python -m drone_sim COMMAND ...`: the commands that need no ROS, as pip installs no scripts for `rosrun`."""

from __future__ import annotations

import importlib
import sys

from drone_sim.run.watchdog import Watchdog

WATCHED = {"fly": "offline.fly", "grade": "grading.grade", "sweep": "grading.sweep"}  # modules with a function `main`
COMMANDS = {**WATCHED, "import_scene": "importing.main"}
_USAGE = f"usage: python -m drone_sim COMMAND ..., with one of {', '.join(COMMANDS)}; COMMAND --help explains it"


def main(command: str, arguments: list[str]) -> None:
    """Run a command, and exit with its status; 1 for an unknown command."""
    if command in ("-h", "--help"):
        print(_USAGE)
        sys.exit(0)
    if command not in COMMANDS:
        sys.exit(f"drone_sim: {repr(command)[:80]} is not a command; {_USAGE}")
    watchdog = Watchdog(command) if command in WATCHED else None  # before the imports, which take a second
    module = importlib.import_module(f"drone_sim.{COMMANDS[command]}")
    if watchdog is None:
        sys.exit(module.main(arguments))
    watchdog.end(module.main(arguments, watchdog))


if __name__ == "__main__":
    main(next(iter(sys.argv[1:]), ""), sys.argv[2:])
